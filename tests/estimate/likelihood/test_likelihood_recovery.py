"""Profiles of a known response lead back to it, and the band says how near."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.estimate import (
    Finding,
    MaximumLikelihood,
    ResponseStatus,
    estimate_response,
)
from napari_crfdeblur.profiles import ProfileSource
from napari_crfdeblur.psf.projection import project
from napari_crfdeblur.psf.shapes import kernel_b
from napari_crfdeblur.quality import response_error
from napari_crfdeblur.response import SRGB, Cameras, Emor, Gamma, GeneralizedGamma, Identity
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles
from napari_crfdeblur.simulate.profiles import (
    any_levels,
    edge_shape,
    random_displacement,
    recorded,
)

CURVES = {
    "linear": Identity(),
    "gamma 2.2": Gamma(2.2),
    "sRGB": SRGB(),
    "EMoR": Emor((1.5, -0.6, 0.1)),
    "generalized gamma": GeneralizedGamma((0.45, 0.1)),
    "generalized gamma of degree 2": GeneralizedGamma((0.6, -0.3, 0.2)),
}
CASES = {"rising": {}, "both polarities": {"falling": 0.5}, "a quarter bad": {"bad": 0.25}}
NOISE = 0.005
# Of 4 x 8 profiles; the error of a median draw is .0015, a prior's .02 to .06.
NEAR = 0.01
PSF = kernel_b()  # differs from its mirror image in every direction
ML = MaximumLikelihood()


def error_of(estimate, curve):
    return response_error(estimate.curve, curve, estimate.covered)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_a_response_is_found_again(curve, case):
    camera = Camera(curve, noise=NOISE)
    groups = random_profiles(camera, ProfileCase(groups=4, profiles=8, **case), seed=2)
    estimate = estimate_response(groups, ML)
    assert error_of(estimate, curve) < NEAR
    assert error_of(estimate, curve) < response_error(
        Cameras.DIGITAL.prior.curve(), curve, estimate.covered
    )
    assert estimate.status in (ResponseStatus.GOOD, ResponseStatus.DOUBTFUL)


@pytest.mark.parametrize("cameras", Cameras)
def test_every_kind_of_camera_can_be_assumed(cameras):
    groups = random_profiles(
        Camera(Gamma(1.8), noise=NOISE), ProfileCase(groups=4, falling=0.5), seed=5
    )
    estimate = estimate_response(groups, MaximumLikelihood(cameras))
    assert error_of(estimate, Gamma(1.8)) < NEAR


def shifted(curve, seed, *, spread=0.3, apart=0.0, groups=4, edges=8, channels=1):
    """Profiles of edges that lie `spread` pixels beside their places, channels `apart` besides."""
    rng = np.random.default_rng(seed)
    position, camera = np.arange(41) - 20.0, Camera(curve, noise=NOISE)
    found = []
    for number in range(groups):
        path = random_displacement(rng, rng.uniform(15, 30))
        light, sides, sources = [], [], []
        for edge in range(edges):
            off = spread * rng.standard_normal() + apart * rng.standard_normal(channels)
            levels = any_levels(rng, channels)[:, :: 1 if edge % 2 else -1]
            shapes = np.array([edge_shape(position + o, path) for o in off])
            light.append(levels[:, :1] + np.diff(levels) * shapes)
            sides.append(levels)
            sources += [ProfileSource(0, 100 * number + edge, c) for c in range(channels)]
        group = recorded(
            np.concatenate(light),
            np.concatenate(sides),
            camera,
            rng,
            orientation=np.pi * number / groups,
        )
        found.append(replace(group, sources=tuple(sources)))
    return found


@pytest.mark.parametrize("spread", [0.3, 0.6])
@pytest.mark.parametrize("seed", [0, 1])
def test_edges_beside_their_places_are_tolerated(spread, seed):
    curve = Gamma(1.7)
    estimate = estimate_response(shifted(curve, seed, spread=spread), ML)
    assert error_of(estimate, curve) < NEAR


def test_shifts_that_are_not_allowed_for_cost_evidence():
    groups = shifted(Gamma(1.7), 1, spread=0.6)
    free, fixed = (
        estimate_response(groups, MaximumLikelihood(shift=shift)) for shift in (0.6, 1e-4)
    )
    assert fixed.diagnostics["evidence"] < 0.3 * free.diagnostics["evidence"]
    # That of the typical edge only: those that are far beside their places have lost their weight.
    assert fixed.diagnostics["misfit"] > free.diagnostics["misfit"]
    assert fixed.diagnostics["error to expect"] > 1.5 * free.diagnostics["error to expect"]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_three_channels_of_three_edges_suffice(seed):
    curve = Gamma(1.7)
    groups = shifted(curve, seed, apart=0.02, groups=1, edges=3, channels=3)
    estimate = estimate_response(groups, ML)
    assert error_of(estimate, curve) < NEAR
    assert estimate.diagnostics["profiles"] == 9


def test_three_channels_of_one_edge_come_closer_than_the_prior_but_are_not_called_good():
    curve, errors, priors = Gamma(1.7), [], []
    for seed in range(6):
        estimate = estimate_response(shifted(curve, seed, groups=1, edges=1, channels=3), ML)
        errors.append(error_of(estimate, curve))
        priors.append(response_error(Cameras.DIGITAL.prior.curve(), curve, estimate.covered))
        assert estimate.status is not ResponseStatus.GOOD
        assert Finding.FEW_EDGES in estimate.findings
    assert np.median(errors) < 0.5 * np.median(priors)


def shaken(curve, seed, *, angles, rows, off=0.0):
    """Groups of edges blurred by PSF, aligned by their end points and `off` pixels besides."""
    rng = np.random.default_rng(seed)
    position, fine = np.arange(41) - 20.0, np.linspace(-30, 30, 6001)
    groups = []
    for angle in angles:
        middle = np.interp([0.01, 0.99], project(PSF, angle, fine), fine).mean() + off
        sides = any_levels(rng, rows)
        sides[1::2] = sides[1::2, ::-1]
        light = sides[:, :1] + np.diff(sides) * project(PSF, angle, position + middle)
        camera = Camera(curve, noise=0.003)
        groups.append(recorded(light, sides, camera, rng, orientation=angle))
    return groups


@pytest.mark.parametrize("off", [0.0, 0.8])
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("curve", [SRGB(), Gamma(1.9)], ids=["sRGB", "gamma 1.9"])
def test_with_a_known_psf_one_edge_comes_closer_than_the_prior(curve, seed, off):
    groups = shaken(curve, seed, angles=(0.3,), rows=1, off=off)
    estimate = estimate_response(groups, MaximumLikelihood(psf=PSF))
    prior = response_error(Cameras.DIGITAL.prior.curve(), curve, estimate.covered)
    assert error_of(estimate, curve) < 0.7 * prior
    blind = estimate_response(groups, ML)
    assert blind.status is ResponseStatus.CANNOT_TELL


@pytest.mark.parametrize("seed", [0, 4])
@pytest.mark.parametrize("curve", [Identity(), Gamma(1.7)], ids=["linear", "gamma 1.7"])
def test_a_known_psf_does_no_harm_where_the_prior_is_far_from_the_truth(curve, seed):
    groups = shaken(curve, seed, angles=(0.3, 1.1), rows=4)
    estimate = estimate_response(groups, MaximumLikelihood(psf=PSF))
    assert error_of(estimate, curve) < 0.005  # blind, these are found to .003


def test_a_wrong_psf_leads_astray():
    groups = shaken(SRGB(), 0, angles=(0.3, 1.1, 2.5), rows=4)
    right, wrong = (
        estimate_response(groups, MaximumLikelihood(psf=psf)) for psf in (PSF, PSF[::-1, ::-1])
    )
    assert error_of(wrong, SRGB()) > 3 * error_of(right, SRGB())
    assert wrong.diagnostics["misfit"] > 1.5 * right.diagnostics["misfit"]
    assert wrong.status is not ResponseStatus.GOOD


def drawn_response(seed):
    """A response as the prior of digital cameras expects it."""
    prior, rng = Cameras.DIGITAL.prior, np.random.default_rng(seed)
    while True:
        coefficients = rng.standard_normal(prior.size)
        if np.all(np.diff(prior.mean + coefficients @ prior.directions) > 0):
            return prior.curve(coefficients)


@pytest.fixture(scope="module")
def drawn():
    """Truths and estimates of 16 cameras, from 18 profiles each."""
    pairs = []
    for seed in range(16):
        curve = drawn_response(seed)
        noise, bad = (0.005, 0.01)[seed % 2], (0, 0.25)[seed // 2 % 2]
        case = ProfileCase(groups=3, profiles=6, falling=0.3, bad=bad)
        groups = random_profiles(Camera(curve, noise=noise), case, seed=seed)
        pairs.append((curve, estimate_response(groups, ML)))
    return pairs


def test_the_band_holds_the_truth_for_most_intensities(drawn):
    # A 95 % band, widened for cameras that are not drawn from the prior as these are. Errors of
    # one estimate go together, so that 16 of them tell the share to about a tenth.
    shares = []
    for curve, estimate in drawn:
        low, high = estimate.covered
        inside = (estimate.intensity > low) & (estimate.intensity < high)
        truth = curve.to_irradiance(estimate.intensity)
        held = (truth >= estimate.lower) & (truth <= estimate.upper)
        shares.append(held[inside].mean())
    assert 0.9 <= np.mean(shares) <= 1


def test_the_error_to_expect_is_about_that_which_is_made(drawn):
    ratios = [
        error_of(estimate, curve) / estimate.diagnostics["error to expect"]
        for curve, estimate in drawn
    ]
    # Computed on the safe side; a normal error is above three times its deviation in 1 of 400.
    assert 0.1 < np.sqrt(np.mean(np.square(ratios))) < 1.5
    assert max(ratios) < 3


def test_the_band_holds_the_curve_and_is_narrower_than_the_prior(drawn):
    prior = Cameras.DIGITAL.prior
    for _, estimate in drawn:
        center = estimate.curve.to_irradiance(estimate.intensity)
        # The mirror of rounding: the band is the estimate plus and minus a width, clipped.
        assert np.all(estimate.lower <= center + 1e-15)
        assert np.all(estimate.upper >= center - 1e-15)
        assert estimate.lower.min() >= 0
        assert estimate.upper.max() <= 1
        light = np.linspace(0.1, 0.9, 81)
        assert np.all(estimate.posterior.deviation(light) < prior.deviation(light))


def test_the_posterior_has_the_estimate_as_its_mean(drawn):
    for _, estimate in drawn:
        # Toe and shoulder are made steady, which leaves an affine change of the rest; and a
        # curve that is made strictly increasing changes by up to a thousandth.
        mean = estimate.posterior.curve()
        assert response_error(estimate.curve, mean, estimate.covered) < 1e-3


@pytest.fixture(scope="module")
def photos():
    """Estimates from three photos of one camera: each with the posterior of the last as prior."""
    curve, prior, found = Gamma(1.7), Cameras.DIGITAL, []
    for number in range(3):
        groups = random_profiles(
            Camera(curve, noise=0.02), ProfileCase(groups=2, profiles=4), seed=21 + number
        )
        found.append(estimate_response(groups, MaximumLikelihood(prior)))
        prior = found[-1].posterior
    return curve, found


def test_the_next_photo_of_a_camera_adds_to_the_last(photos):
    curve, (first, second, third) = photos
    levels = np.linspace(0.2, 0.8, 61)
    wide, middle, narrow = (np.mean(e.posterior.deviation(levels)) for e in (first, second, third))
    assert middle < wide
    assert narrow < 1.05 * middle  # what is known never widens but for the curve's own slope
    assert error_of(third, curve) < max(error_of(first, curve), 0.004)


def test_a_known_camera_stays_known_after_many_photos():
    prior, curve = Cameras.DIGITAL, Gamma(1.7)
    for seed in range(4):
        groups = random_profiles(
            Camera(curve, noise=NOISE), ProfileCase(groups=3, falling=0.5), seed=seed
        )
        estimate = estimate_response(groups, MaximumLikelihood(prior))
        prior = estimate.posterior
    assert error_of(estimate, curve) < NEAR
    assert estimate.status is ResponseStatus.GOOD


def photo(curve, number, seed):
    """Profiles of one photo among others."""
    case = ProfileCase(groups=2, profiles=8, falling=0.5)
    return [
        replace(g, sources=tuple(replace(source, image=number) for source in g.sources))
        for g in random_profiles(Camera(curve, noise=NOISE), case, seed=seed)
    ]


@pytest.mark.parametrize("other", [Gamma(2.2), Gamma(1.1)], ids=["one camera", "two cameras"])
def test_photos_of_unlike_cameras_contradict_each_other(other):
    groups = photo(Gamma(2.2), 0, seed=0) + photo(other, 1, seed=1)
    estimate = estimate_response(groups, ML)
    alike = other == Gamma(2.2)
    assert (Finding.CONTRADICTION in estimate.findings) is not alike
    assert (estimate.status is ResponseStatus.GOOD) is alike


@pytest.mark.parametrize(
    "curve",
    [
        pytest.param(Gamma(2.2), id="the same camera"),
        pytest.param(
            Gamma(1.1),
            id="another",
        ),
    ],
)
def test_a_photo_of_another_camera_contradicts_what_is_known(curve):
    known = estimate_response(photo(Gamma(2.2), 0, seed=0), ML).posterior
    estimate = estimate_response(photo(curve, 0, seed=3), MaximumLikelihood(known))
    alike = curve == Gamma(2.2)
    assert (Finding.CONTRADICTION in estimate.findings) is not alike
    assert (estimate.status is ResponseStatus.GOOD) is alike


def test_the_same_profiles_give_the_same_estimate():
    groups = shifted(SRGB(), 3, groups=2, edges=4, channels=2)
    a, b = estimate_response(groups, ML), estimate_response(groups, MaximumLikelihood())
    np.testing.assert_array_equal(a.curve.intensity, b.curve.intensity)
    np.testing.assert_array_equal([a.lower, a.upper], [b.lower, b.upper])
    np.testing.assert_array_equal(a.posterior.directions, b.posterior.directions)
    assert a.diagnostics == b.diagnostics


@pytest.mark.parametrize("psf", [None, PSF], ids=["blind", "known PSF"])
def test_profiles_and_psf_are_left_as_they_were(psf):
    groups = shifted(SRGB(), 3, groups=1, edges=4, channels=2)
    names = ("position", "intensity", "variance", "count", "sides", "sides_variance")
    before = [[getattr(g, name).copy() for name in names] for g in groups]
    given = None if psf is None else psf.copy()
    estimate_response(groups, MaximumLikelihood(psf=given))
    for group, kept in zip(groups, before, strict=True):
        for name, values in zip(names, kept, strict=True):
            np.testing.assert_array_equal(getattr(group, name), values)
    if psf is not None:
        np.testing.assert_array_equal(given, psf)
        assert given.flags.writeable


def test_what_is_handed_out_is_read_only(drawn):
    estimate = drawn[0][1]
    method = MaximumLikelihood(psf=PSF)
    posterior = estimate.posterior
    for values in (
        estimate.lower,
        estimate.upper,
        estimate.intensity,
        posterior.mean,
        posterior.directions,
        method.psf,
    ):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1
