"""Profiles that cannot tell the response, or are none: a status says so, no curve is wild."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    Finding,
    MaximumLikelihood,
    ResponseStatus,
    estimate_response,
)
from napari_crfdeblur.estimate.likelihood.verdict import steady_shoulder, steady_toe
from napari_crfdeblur.profiles import ProfileSource
from napari_crfdeblur.response import SRGB, Cameras, Gamma, ResponsePrior, Tabulated, around
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles
from napari_crfdeblur.simulate.profiles import constant_contrast, from_black

CAMERA = Camera(Gamma(1.7), noise=0.005)
ML = MaximumLikelihood()
DOUBTS = (ResponseStatus.DOUBTFUL, ResponseStatus.CANNOT_TELL, ResponseStatus.NOT_CONVERGED)


def one_range(rng, rows):  # noqa: ARG001, a drawing of levels
    return np.tile([0.2, 0.7], (rows, 1))


def tiny_range(rng, rows):
    return np.tile([0.35, 0.55], (rows, 1)) + rng.uniform(-0.02, 0.02, (rows, 2))


def drawn(seed, **kinds):
    return random_profiles(CAMERA, ProfileCase(**kinds), seed=seed)


def identical(seed):
    """One profile, claimed to be that of eight edges."""
    (group,) = drawn(seed, profiles=1)
    same = group.select([0] * 8)
    return [replace(same, sources=tuple(ProfileSource(0, j, 0) for j in range(8)))]


def of_noise(seed, *, sides=False):
    rng = np.random.default_rng(seed)
    found = []
    for group in drawn(seed, groups=2, samples=25):
        noise = rng.random(group.intensity.shape)
        ends = noise[:, [0, -1]] if sides else group.sides
        found.append(replace(group, intensity=noise, sides=ends))
    return found


UNTOLD = {
    "one profile": (lambda s: drawn(s, profiles=1), {Finding.FEW_EDGES, Finding.ALIKE}),
    "identical profiles": (identical, {Finding.ALIKE}),
    "one range": (lambda s: drawn(s, groups=2, levels=one_range), {Finding.ALIKE}),
    "all from black": (lambda s: drawn(s, groups=4, levels=from_black), {Finding.ALIKE}),
    "constant contrast": (
        lambda s: drawn(s, groups=4, levels=constant_contrast),
        {Finding.ALIKE},
    ),
    "a tiny range": (lambda s: drawn(s, groups=4, levels=tiny_range), {Finding.NARROW}),
    "noise": (of_noise, {Finding.MISFIT}),
    "noise, sides too": (lambda s: of_noise(s, sides=True), {Finding.MISFIT}),
}


@pytest.fixture(scope="module", params=UNTOLD.values(), ids=UNTOLD)
def untold(request):
    """Estimates of two draws of profiles that cannot tell, and what is to be said of them."""
    make, findings = request.param
    return [estimate_response(make(seed), ML) for seed in range(2)], findings


def test_what_cannot_be_told_is_never_called_good(untold):
    estimates, _ = untold
    for estimate in estimates:
        assert estimate.status in DOUBTS


def test_the_findings_name_the_reason(untold):
    estimates, findings = untold
    for estimate in estimates:
        assert findings <= set(estimate.findings)
        assert len(set(estimate.findings)) == len(estimate.findings)


def no_wild_curve(estimate):
    """Strictly increasing from 0 to 1, with a band around it."""
    grid = np.linspace(0, 1, 2001)
    assert np.all(np.diff(estimate.curve.to_irradiance(grid)) > 0)
    assert np.all(np.diff(estimate.curve.to_intensity(grid)) > 0)
    np.testing.assert_array_equal(estimate.curve.to_irradiance([0, 1]), [0, 1])
    assert np.isfinite([estimate.lower, estimate.upper]).all()
    assert np.all(estimate.lower <= estimate.upper)
    assert np.isfinite(list(estimate.diagnostics.values())).all()


def test_no_curve_is_wild(untold):
    for estimate in untold[0]:
        no_wild_curve(estimate)


def test_what_cannot_be_told_is_what_the_prior_says(untold):
    prior = Cameras.DIGITAL.prior
    for estimate in untold[0]:
        if estimate.status is not ResponseStatus.CANNOT_TELL:
            continue
        np.testing.assert_array_equal(estimate.curve.intensity, prior.curve().intensity)
        light = np.linspace(0, 1, 101)
        np.testing.assert_allclose(
            estimate.posterior.deviation(light), prior.deviation(light), atol=1e-12
        )


@pytest.mark.parametrize("make", [lambda s: drawn(s, profiles=1), identical])
@pytest.mark.parametrize("seed", [0, 1])
def test_one_edge_alone_cannot_tell(make, seed):
    estimate = estimate_response(make(seed), ML)
    assert estimate.status is ResponseStatus.CANNOT_TELL
    assert "add edges" in estimate.status.value


def test_varied_profiles_are_called_good():
    estimate = estimate_response(drawn(0, groups=4, falling=0.5), ML)
    assert estimate.status is ResponseStatus.GOOD
    assert estimate.findings == ()


def hostile():
    """Intensities and sides that are nothing of the kind."""
    noise = np.random.default_rng(4).random((6, 19))
    ends = np.array([[0.1, 0.9], [0.2, 0.5], [0.6, 0.1], [0.0, 1.0], [0.3, 0.55], [0.9, 0.2]])
    ramps = ends[:, :1] + np.diff(ends) * np.linspace(0, 1, 19)
    return {
        "flat profiles": (np.full((6, 19), 0.5), ends),
        "steps": (np.where(np.arange(19) < 9, ends[:, :1], ends[:, 1:]), ends),
        "black and white": ((noise > 0.5).astype(float), ends),
        "sides swapped": (ramps, ends[:, ::-1]),
        "clipped": (np.clip(3 * ramps - 1, 0, 1), np.clip(3 * ends - 1, 0, 1)),
    }


HOSTILE = hostile()


def group_of(intensity, sides, variance=1e-6):
    (group,) = drawn(0, profiles=len(intensity), samples=intensity.shape[1])
    flat = np.full(intensity.shape, variance)
    return replace(
        group,
        intensity=intensity,
        variance=flat,
        sides=sides,
        sides_variance=flat[:, :2],
        polarity=0,
    )


@pytest.mark.parametrize("variance", [0, 1e6], ids=["no noise", "all noise"])
@pytest.mark.parametrize(("intensity", "sides"), HOSTILE.values(), ids=HOSTILE)
def test_whatever_the_profiles_no_curve_is_wild(intensity, sides, variance):
    estimate = estimate_response([group_of(intensity, sides, variance)], ML)
    no_wild_curve(estimate)
    if variance == 1e6:
        assert estimate.status is ResponseStatus.CANNOT_TELL


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_profiles_that_are_black_or_white_throughout_are_no_failure(level):
    _, sides = HOSTILE["steps"]
    no_wild_curve(estimate_response([group_of(np.full((6, 19), level), sides)], ML))


def faint():
    (group,) = drawn(0)
    return [replace(group, sides=0.5 + np.tile([0, 0.03], (len(group), 1)))]


def saturated():
    (group,) = drawn(0)
    return [replace(group, intensity=np.ones_like(group.intensity), sides=np.ones((len(group), 2)))]


NOTHING = {
    "no groups": list,
    "empty groups": lambda: [g.select(np.zeros(len(g), dtype=bool)) for g in drawn(0, groups=2)],
    "faint profiles": faint,
    "clipped profiles": saturated,
}


@pytest.mark.parametrize("groups", NOTHING.values(), ids=NOTHING)
@pytest.mark.parametrize("psf", [None, np.eye(7)], ids=["blind", "known PSF"])
def test_with_nothing_to_learn_from_the_prior_is_handed_out(groups, psf):
    estimate = estimate_response(groups(), MaximumLikelihood(Cameras.DORF, psf=psf))
    assert estimate.status is ResponseStatus.CANNOT_TELL
    assert estimate.findings == (Finding.NO_EDGES,)
    assert estimate.covered == (0.0, 0.0)
    intensity = np.linspace(0, 1, 65)
    assumed = Cameras.DORF.prior.curve().to_irradiance(intensity)
    np.testing.assert_array_equal(estimate.curve.to_irradiance(intensity), assumed)
    lower, upper = (
        np.interp(intensity, estimate.intensity, b) for b in (estimate.lower, estimate.upper)
    )
    assert np.all((lower <= assumed) & (assumed <= upper))


@pytest.mark.parametrize("name", ["intensity", "variance", "sides", "position"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_profiles_that_are_not_finite_cannot_be_made(name, value):
    (group,) = drawn(0)
    values = np.array(getattr(group, name))
    values.flat[-1] = value
    with pytest.raises(ValueError, match=f"expected finite values of {name}"):
        replace(group, **{name: values})


@pytest.mark.parametrize("prior", [SRGB(), "digital", None, Cameras.DIGITAL.prior.mean])
def test_a_prior_of_another_kind_is_refused(prior):
    with pytest.raises(ValueError, match="expected a kind of camera or a prior"):
        MaximumLikelihood(prior)


@pytest.mark.parametrize("name", ["shift", "channel_shift"])
@pytest.mark.parametrize("value", [0, -0.1, float("inf"), float("nan")])
def test_an_impossible_shift_is_refused(name, value):
    with pytest.raises(ValueError, match="positive shift"):
        MaximumLikelihood(**{name: value})


@pytest.mark.parametrize(
    ("psf", "message"),
    [
        (-np.eye(3), "negative"),
        (np.zeros((3, 5)), "zero everywhere"),
        (np.full((3, 5), np.nan), "not finite"),
        (np.ones((3, 5, 3)), "grayscale"),
    ],
)
def test_an_impossible_psf_is_refused(psf, message):
    with pytest.raises(CrfDeblurError, match=message):
        MaximumLikelihood(psf=psf)


@pytest.mark.parametrize(
    "prior",
    [
        pytest.param(around(SRGB(), 1e-9), id="hardly any spread"),
        pytest.param(around(SRGB(), 1e3), id="any curve"),
        pytest.param(
            ResponsePrior(Cameras.SRGB.prior.mean, np.zeros((2, 513))),
            id="no spread",
        ),
    ],
)
def test_no_prior_leads_to_a_wild_curve(prior):
    no_wild_curve(estimate_response(drawn(0), MaximumLikelihood(prior)))


@pytest.mark.parametrize(
    "samples",
    [
        9,
        pytest.param(
            4,
        ),
    ],
)
def test_short_profiles_are_no_failure(samples):
    (group,) = drawn(0)
    cut = {name: getattr(group, name)[:, :samples] for name in ("intensity", "variance", "count")}
    no_wild_curve(estimate_response([replace(group, position=group.position[:samples], **cut)], ML))


@pytest.mark.parametrize("low", [0.04, 0.2])
def test_a_steep_toe_is_made_steady_and_the_rest_stays_but_for_an_affine_change(low):
    # A jump of .1 in the darkest tones, as an estimate has that knows the curve up to an offset.
    intensity = np.linspace(0, 1, 501)
    gamma = Gamma(1.8).to_irradiance(np.maximum(intensity, low)) - Gamma(1.8).to_irradiance(low)
    light = 0.1 * np.minimum(intensity / low, 1) + 0.9 * gamma / gamma[-1]
    steady = steady_toe(Tabulated(light, intensity), low)
    slopes = np.diff(steady.irradiance) / np.diff(intensity)
    covered = intensity >= low + 0.002  # a step of the grid
    assert slopes[~covered[1:]].max() < slopes[covered[1:]][:40].max()
    line = np.polyval(np.polyfit(light[covered], steady.irradiance[covered], 1), light[covered])
    np.testing.assert_allclose(steady.irradiance[covered], line, atol=1e-12)  # rounding of sums


@pytest.mark.parametrize("high", [0.7, 0.9])
@pytest.mark.parametrize("usual", [SRGB(), Cameras.DIGITAL.prior.curve(), Gamma(1)])
def test_a_steep_shoulder_rises_as_usual_and_the_rest_stays_but_for_an_affine_change(high, usual):
    # Level response near white: a few pixels there would hold most of the light.
    intensity = np.linspace(0, 1, 501)
    beyond = np.maximum(intensity - high, 0)
    light = Gamma(1.6).to_irradiance(intensity) + 40 * beyond**2
    steep = Tabulated(light / light[-1], intensity)
    steady = steady_shoulder(steep, high, usual)
    covered = intensity <= high - 0.002  # a step of the grid
    line = np.polyfit(steep.irradiance[covered], steady.irradiance[covered], 1)
    np.testing.assert_allclose(
        steady.irradiance[covered], np.polyval(line, steep.irradiance[covered]), atol=1e-12
    )
    slopes = np.diff(steady.irradiance) / np.diff(intensity)
    known = np.diff(usual.to_irradiance(intensity)) / np.diff(intensity)
    border = (intensity[1:] <= high) & (intensity[1:] > high - 0.05)
    growth = np.maximum(known / known[border].mean(), 1)
    above = intensity[:-1] > high
    assert np.all(slopes[above] <= 1.03 * growth[above] * slopes[border].mean())
    assert slopes[above].min() > 0


def test_a_shoulder_that_is_no_steeper_than_usual_stays():
    curve = Tabulated(np.linspace(0, 1, 301) ** 2, np.linspace(0, 1, 301))
    found = steady_shoulder(curve, 0.8, Gamma(2.6))
    np.testing.assert_allclose(found.irradiance, curve.irradiance, atol=1e-12)
