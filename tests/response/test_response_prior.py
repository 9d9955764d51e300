"""Families of responses: what they hold, what is left of them after an estimate."""

import numpy as np
import pytest

from napari_crfdeblur.response import (
    SRGB,
    Cameras,
    Emor,
    Gamma,
    Identity,
    ResponsePrior,
    Tabulated,
    around,
    dorf_mean,
)
from napari_crfdeblur.response.prior import NODES

EACH = [camera.prior for camera in Cameras]
each_prior = pytest.mark.parametrize("prior", EACH, ids=[camera.name for camera in Cameras])
LIGHT = np.linspace(0, 1, 701)
# A curve that is made strictly increasing moves by at most a thousandth.
STRICT = 1e-3


def curves(count, seed=0, directions=3):
    """Rising responses that differ in so many directions."""
    rng = np.random.default_rng(seed)
    weights = rng.uniform(-1, 1, (count, directions)) * [0.6, 0.3, 0.1][:directions]
    return [Emor(tuple(w)) for w in weights]


def covariance(prior):
    """Of the intensities at the nodes, shape (513, 513)."""
    return prior.directions.T @ prior.directions


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"mean": NODES[:-1]}, r"finite mean at 513 .* got shape \(512,\)"),
        ({"mean": np.where(NODES == 0.25, np.nan, NODES)}, "finite values of mean"),
        ({"mean": NODES[np.newaxis]}, "one mean curve"),
        ({"mean": 0.9 * NODES}, "increases strictly from 0 to 1"),
        ({"mean": 0.1 + 0.9 * NODES}, "increases strictly from 0 to 1"),
        ({"mean": np.clip(NODES, 0, 0.5) * 2}, "increases strictly from 0 to 1"),
        ({"mean": NODES[::-1]}, "increases strictly from 0 to 1"),
        ({"directions": np.zeros((2, 512))}, "finite directions at 513"),
        ({"directions": np.zeros(513)}, r"shape \(n, 513\)"),
        ({"directions": np.full((1, 513), np.inf)}, "finite values of directions"),
        ({"directions": np.sqrt(NODES)[np.newaxis]}, "leave both ends"),
        ({"directions": 1 - NODES[np.newaxis]}, "leave both ends"),
    ],
)
def test_what_is_no_family_is_refused(wrong, message):
    fields = {"mean": NODES, "directions": np.sin(np.pi * NODES)[np.newaxis]}
    fields["directions"][:, [0, -1]] = 0
    ResponsePrior(**fields)
    with pytest.raises(ValueError, match=message):
        ResponsePrior(**(fields | wrong))


def test_a_family_keeps_copies_that_cannot_be_written():
    mean, directions = NODES.copy(), np.zeros((2, 513))
    prior = ResponsePrior(mean, directions)
    mean[3] = directions[0, 3] = 0.7
    assert prior.mean[3] == NODES[3]
    assert prior.directions[0, 3] == 0
    for values in (prior.mean, prior.directions):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1


def test_the_mean_of_a_family_of_curves_is_their_mean():
    some = curves(9)
    expected = np.mean([c.to_intensity(LIGHT) for c in some], axis=0)
    found = ResponsePrior.from_curves(some, 3).curve().to_intensity(LIGHT)
    np.testing.assert_allclose(found, expected, atol=STRICT)


def test_the_directions_of_a_family_of_curves_hold_their_covariance():
    some = curves(9)
    samples = np.array([c.to_intensity(NODES) for c in some])
    prior = ResponsePrior.from_curves(some, 3)
    assert prior.size == 3
    np.testing.assert_allclose(covariance(prior), np.cov(samples.T), atol=1e-12)
    sizes = np.linalg.norm(prior.directions, axis=1)
    assert np.all(np.diff(sizes) < 0)


def test_a_curve_that_was_left_out_lies_in_the_span_of_the_others():
    *some, other = curves(9)
    prior = ResponsePrior.from_curves(some, 3)
    samples = other.to_intensity(NODES)
    weights = np.linalg.lstsq(prior.directions.T, samples - prior.mean, rcond=None)[0]
    # The mean was made strictly increasing.
    np.testing.assert_allclose(prior.curve(weights).to_intensity(NODES), samples, atol=2 * STRICT)
    assert np.abs(weights).max() < 4  # standard deviations


def test_fewer_directions_are_the_main_ones():
    some = curves(9)
    all_of_them, main = (ResponsePrior.from_curves(some, n) for n in (3, 2))
    np.testing.assert_array_equal(main.directions, all_of_them.directions[:2])


@pytest.mark.parametrize("few", [[], [SRGB()]])
def test_less_than_two_curves_are_no_family(few):
    with pytest.raises(ValueError, match=f"at least 2 curves, got {len(few)}"):
        ResponsePrior.from_curves(few)


@each_prior
@pytest.mark.parametrize("size", [0.3, 3, 100, 1e6])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_curve_increases_strictly_however_wild_its_coefficients(prior, size, seed):
    weights = size * np.random.default_rng(seed).standard_normal(prior.size)
    curve = prior.curve(weights)
    assert np.all(np.diff(curve.to_intensity(LIGHT)) > 0)
    assert np.all(np.diff(curve.to_irradiance(LIGHT)) > 0)
    np.testing.assert_array_equal(curve.to_intensity([0, 1]), [0, 1])


@each_prior
def test_a_curve_that_rises_by_itself_stays_as_it_is(prior):
    weights = 0.2 * np.random.default_rng(1).standard_normal(prior.size)
    samples = prior.mean + weights @ prior.directions
    assert np.all(np.diff(samples) > 0)
    np.testing.assert_allclose(prior.curve(weights).to_intensity(NODES), samples, atol=STRICT)


@each_prior
def test_no_coefficients_give_the_mean(prior):
    np.testing.assert_array_equal(
        prior.curve().intensity, prior.curve(np.zeros(prior.size)).intensity
    )
    np.testing.assert_allclose(prior.curve().to_intensity(NODES), prior.mean, atol=STRICT)


@pytest.mark.parametrize("size", [11, 13])
def test_coefficients_of_another_number_are_refused(size):
    with pytest.raises(ValueError, match="mismatch"):
        Cameras.DORF.prior.curve(np.ones(size))


@each_prior
def test_the_deviation_is_that_of_drawn_members(prior):
    rng = np.random.default_rng(2)
    drawn = prior.mean + rng.standard_normal((4000, prior.size)) @ prior.directions
    # 4000 draws tell a deviation to about a hundredth of it.
    np.testing.assert_allclose(prior.deviation(NODES), drawn.std(axis=0), rtol=0.05, atol=1e-12)
    np.testing.assert_array_equal(prior.deviation([-1, 0, 1, 2]), 0)


def some_covariance(size, seed=5):
    root = np.random.default_rng(seed).standard_normal((size, size)) / size
    return root @ root.T


@each_prior
def test_a_family_narrowed_by_a_covariance_has_it(prior):
    weights, spread = np.linspace(0.4, -0.4, prior.size), some_covariance(prior.size)
    narrow = prior.narrowed(weights, spread)
    expected = prior.directions.T @ spread @ prior.directions
    np.testing.assert_allclose(covariance(narrow), expected, atol=1e-12)
    np.testing.assert_allclose(
        narrow.curve().to_intensity(NODES), prior.curve(weights).to_intensity(NODES), atol=STRICT
    )


@each_prior
def test_no_covariance_leaves_one_curve(prior):
    narrow = prior.narrowed(np.zeros(prior.size), np.zeros((prior.size, prior.size)))
    np.testing.assert_array_equal(narrow.deviation(LIGHT), 0)
    np.testing.assert_allclose(
        narrow.curve(np.ones(narrow.size)).to_intensity(NODES), prior.mean, atol=2 * STRICT
    )


@each_prior
def test_a_covariance_of_one_leaves_the_family_as_it_is(prior):
    same = prior.narrowed(np.zeros(prior.size), np.eye(prior.size))
    np.testing.assert_allclose(same.mean, prior.mean, atol=STRICT)
    np.testing.assert_allclose(covariance(same), covariance(prior), atol=1e-12)


@each_prior
def test_the_main_directions_of_a_narrowed_family_come_first(prior):
    # As the search, which starts along the first, relies on.
    known = np.where(np.arange(prior.size) < 2, 0.3, 0.9)
    narrow = prior.narrowed(np.zeros(prior.size), np.diag(known**2))
    sizes = np.linalg.norm(narrow.directions, axis=1)
    assert np.all(np.diff(sizes) <= 0)


@each_prior
def test_rounding_may_leave_a_covariance_slightly_negative(prior):
    spread = np.eye(prior.size)
    spread[0, 0] = -1e-18
    assert np.isfinite(prior.narrowed(np.zeros(prior.size), spread).directions).all()


@pytest.mark.parametrize("curve", [SRGB(), Gamma(1.4), Identity(), Gamma(0.7)], ids=repr)
def test_a_family_around_a_curve_has_it_as_its_mean(curve):
    prior = around(curve)
    # A curve as it is at the nodes, made strictly increasing.
    np.testing.assert_allclose(prior.mean, curve.to_intensity(NODES), atol=STRICT)
    wide = around(curve, share=0.6)
    np.testing.assert_allclose(wide.directions, 3 * prior.directions, rtol=1e-12)


def test_a_family_around_the_mean_of_dorf_with_its_spread_is_that_of_dorf():
    prior = around(dorf_mean(), share=1.0)
    np.testing.assert_allclose(prior.mean, Cameras.DORF.prior.mean, atol=STRICT)
    np.testing.assert_array_equal(prior.directions, Cameras.DORF.prior.directions)


@pytest.mark.parametrize("share", [0, -0.1, float("nan")])
def test_a_family_without_spread_is_refused(share):
    with pytest.raises(ValueError, match="expected a share above 0"):
        around(SRGB(), share)


@each_prior
def test_the_mean_of_every_kind_of_camera_increases_strictly(prior):
    assert np.all(np.diff(prior.mean) > 0)
    assert prior.mean[0] == 0
    assert prior.mean[-1] == 1


@pytest.mark.parametrize("camera", Cameras)
def test_a_kind_of_camera_is_made_once(camera):
    assert camera.prior is camera.prior


@each_prior
def test_srgb_is_a_likely_camera_of_every_kind(prior):
    samples = SRGB().to_intensity(NODES) - prior.mean
    main = prior.directions[:4]  # the others are small, and make up for one another
    weights = np.linalg.lstsq(main.T, samples, rcond=None)[0]
    assert np.abs(weights).max() < 2  # standard deviations
    assert np.sqrt(np.mean((samples - weights @ main) ** 2)) < 0.01


def test_curves_assumed_near_srgb_have_it_as_their_mean():
    np.testing.assert_allclose(
        Cameras.SRGB.prior.curve().to_intensity(LIGHT), SRGB().to_intensity(LIGHT), atol=2 * STRICT
    )


def test_the_more_is_assumed_the_narrower_the_family():
    light = np.linspace(0.05, 0.95, 91)
    dorf, digital, srgb = (
        c.prior.deviation(light) for c in (Cameras.DORF, Cameras.DIGITAL, Cameras.SRGB)
    )
    assert np.all(srgb < digital)
    assert np.all(digital < dorf)


def test_the_mean_of_dorf_is_that_of_its_table():
    curve = Cameras.DORF.prior.curve()
    np.testing.assert_allclose(
        curve.to_intensity(LIGHT), dorf_mean().to_intensity(LIGHT), atol=2 * STRICT
    )
    assert isinstance(curve, Tabulated)
