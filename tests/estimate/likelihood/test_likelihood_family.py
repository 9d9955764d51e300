"""What a family of responses records of any light, and how that follows its coefficients."""

import numpy as np
import pytest

from napari_crfdeblur.estimate.likelihood.family import Family
from napari_crfdeblur.response import Cameras, Gamma, ResponsePrior, Tabulated, around
from napari_crfdeblur.response.prior import NODES


def drawn_prior(seed):
    """A prior of random curves: neither its mean nor its directions are those of EMoR."""
    rng = np.random.default_rng(seed)
    rises = rng.uniform(0.2, 1, (9, NODES.size - 1)) * np.diff(NODES)
    samples = np.concatenate([np.zeros((9, 1)), np.cumsum(rises, axis=1)], axis=1)
    samples = (samples / samples[:, -1:]) ** rng.uniform(0.4, 2, (9, 1))
    return ResponsePrior.from_curves([Tabulated(NODES, s) for s in samples], 4)


PRIORS = {
    "digital": Cameras.DIGITAL.prior,
    "DoRF": Cameras.DORF.prior,
    "near a gamma": around(Gamma(1.4)),
    "one direction": ResponsePrior(Cameras.SRGB.prior.mean, Cameras.SRGB.prior.directions[:1]),
    "drawn": drawn_prior(3),
}
each_prior = pytest.mark.parametrize("prior", PRIORS.values(), ids=PRIORS)
WITHIN = np.array([[-0.93, -0.41, -0.12, -0.017], [0.013, 0.31, 0.77, 0.991]])
BEYOND = np.array([-2.3, -1.04, 1.02, 1.7])
LIGHT = np.concatenate([WITHIN.ravel(), BEYOND])
# Pieces between nodes are straight: a central difference within a piece is exact but for
# rounding, 1e-16 / 1e-7.
STEP, ROUNDING = 1e-7, 1e-8


def drawn_family(prior, seed, size=0.5):
    return Family(prior, size * np.random.default_rng(seed).standard_normal(prior.size))


def differences(prior, coefficients, record):
    """``d record / dc`` by central differences, coefficients last."""
    steps = STEP * np.eye(prior.size)
    pairs = [(Family(prior, coefficients + s), Family(prior, coefficients - s)) for s in steps]
    return np.stack([(record(a) - record(b)) / (2 * STEP) for a, b in pairs], axis=-1)


@each_prior
@pytest.mark.parametrize("seed", [0, 1])
def test_exposed_light_is_recorded_light(prior, seed):
    family = drawn_family(prior, seed)
    for light in (LIGHT, WITHIN):
        exposure = family.expose(light)
        # The same sums in another order.
        np.testing.assert_allclose(exposure.intensity, family.record(light), atol=1e-14)
        assert exposure.gain.shape == light.shape
        assert exposure.sensitivity.shape == (*light.shape, prior.size)


def test_a_single_value_of_light_leaves_the_family_as_it_is():
    prior = around(Gamma(1.3))  # its own: what is kept of a prior may be overwritten
    family = drawn_family(prior, 1)
    before = family.expose(WITHIN).sensitivity
    family.expose(WITHIN[1, 1])
    np.testing.assert_array_equal(family.expose(WITHIN).sensitivity, before)


@each_prior
def test_within_the_range_recorded_light_is_that_of_the_curve(prior):
    family = Family(prior, np.zeros(prior.size))
    # The curve of a prior has a smallest slope, a thousandth of the mean.
    light = np.linspace(0, 1, 777)
    np.testing.assert_allclose(family.record(light), prior.curve().to_intensity(light), atol=1e-3)


@each_prior
@pytest.mark.parametrize("seed", [0, 1])
def test_the_gain_is_the_slope_of_what_is_recorded(prior, seed):
    family = drawn_family(prior, seed)
    slope = (family.record(LIGHT + STEP) - family.record(LIGHT - STEP)) / (2 * STEP)
    np.testing.assert_allclose(family.expose(LIGHT).gain, slope, atol=ROUNDING * 10)


@each_prior
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(
    "light", [pytest.param(WITHIN, id="up to 1"), pytest.param(BEYOND, id="beyond 1")]
)
def test_the_sensitivity_is_how_what_is_recorded_follows_the_coefficients(prior, light, seed):
    family = drawn_family(prior, seed)
    expected = differences(prior, family.coefficients, lambda f: f.record(light))
    # Beyond 1 the last piece is continued a few hundredfold, and so are errors of rounding.
    atol = ROUNDING * (100 if light is BEYOND else 1)
    np.testing.assert_allclose(family.expose(light).sensitivity, expected, atol=atol)


@each_prior
def test_light_below_zero_is_recorded_as_its_mirror_image(prior):
    family = drawn_family(prior, 4)
    np.testing.assert_array_equal(family.record(-LIGHT), -family.record(LIGHT))
    assert family.record(np.zeros(1)) == 0


@each_prior
def test_beyond_one_the_response_goes_on_along_its_last_slope(prior):
    family = drawn_family(prior, 4)
    steps = np.diff(family.record(np.array([0.998, 1.0, 1.002, 1.2, 1.4])))
    np.testing.assert_allclose(steps[[1, 2]], steps[0] * np.array([1, 99]), rtol=1e-9)
    np.testing.assert_allclose(steps[3], 100 * steps[0], rtol=1e-9)


@each_prior
def test_undoing_inverts_a_rising_response(prior):
    family = Family(prior, np.zeros(prior.size))
    light = np.linspace(0, 1, 401)
    # What is undone is tilted by 1e-9, which a slope of .02 makes 5e-8.
    np.testing.assert_allclose(family.undo(family.record(light)), light, atol=5e-8)


def test_undoing_a_response_that_falls_somewhere_still_rises():
    prior = Cameras.DORF.prior
    family = drawn_family(prior, 2, size=4)
    assert np.any(np.diff(family.samples) < 0)
    light = family.undo(np.linspace(-0.2, 1.2, 301))
    assert np.all(np.diff(light) >= 0)
    assert light.min() == 0
    assert light.max() == 1


@each_prior
def test_a_rising_response_pays_nothing(prior):
    family = Family(prior, np.zeros(prior.size))
    value, gradient, hessian = family.penalty(1.0)
    assert value == 0
    np.testing.assert_array_equal(gradient, np.zeros(prior.size))
    np.testing.assert_array_equal(hessian, np.zeros((prior.size, prior.size)))


@each_prior
@pytest.mark.parametrize("weight", [1.0, 7.3])
def test_gradient_and_hessian_of_the_penalty_are_its_differences(prior, weight):
    family = drawn_family(prior, 6, size=20)
    value, gradient, hessian = family.penalty(weight)
    assert value > 0

    def slope(order):
        return differences(prior, family.coefficients, lambda f: f.penalty(weight)[order])

    # Piecewise quadratic: the difference is exact but for rounding of a value of this size.
    np.testing.assert_allclose(gradient, slope(0), atol=1e-7 * max(value, 1))
    np.testing.assert_allclose(hessian, slope(1), atol=1e-7 * max(np.abs(hessian).max(), value, 1))


def test_the_penalty_is_proportional_to_its_weight():
    family = drawn_family(Cameras.DORF.prior, 6, size=8)
    for one, nine in zip(family.penalty(1.0), family.penalty(9.0), strict=True):
        np.testing.assert_allclose(nine, 9 * np.asarray(one), rtol=1e-12)
