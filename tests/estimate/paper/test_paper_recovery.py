"""Ideal profiles lead every method back to the response that made them."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    GivenResponse,
    KnownPsf,
    MeanProfile,
    PolynomialFit,
    RankMinimization,
    ResponseStatus,
    RowScale,
    Tail,
    estimate_response,
)
from napari_crfdeblur.profiles.base import ProfileGroup, ProfileSource
from napari_crfdeblur.psf.projection import project
from napari_crfdeblur.psf.shapes import kernel_b
from napari_crfdeblur.quality import response_error
from napari_crfdeblur.response import Gamma, Identity, Polynomial, dorf_mean
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles
from napari_crfdeblur.simulate.profiles import any_levels, recorded

ALONE = PolynomialFit(resamples=0)
PSF = kernel_b()  # differs from its mirror image in every direction
INSIDE = {
    "identity": Identity(),
    "square": Polynomial((0.0001, 0.9999)),
    "fifth degree": Polynomial((0.2, -0.1, 0.5, 0.1, 0.3)),
    "concave": Polynomial((1.6, -0.6)),
}
BLIND = {
    "Eq. 5": MeanProfile(ALONE),
    **{
        f"{tail.name}, {scale.name}": RankMinimization(tail, scale, ALONE)
        for tail in Tail
        for scale in RowScale
    },
}
# Recorded as float32 without noise: what is left is the end of the search, which is taken as
# reached when six steps gain less than a ten-thousandth of the objective.
FOUND = 2e-3


def exact(curve):
    return Camera(curve, bits=None)


def shaken(curve, *, angles=(0.3, 1.1, 2.5), rows=4, seed=0, samples=41):
    """Groups of edges blurred by PSF, rising and falling, aligned by their end points."""
    rng = np.random.default_rng(seed)
    position = np.arange(samples) - (samples - 1) / 2
    fine = np.linspace(-30, 30, 6001)
    groups = []
    for angle in angles:
        middle = np.interp([0.01, 0.99], project(PSF, angle, fine), fine).mean()
        sides = any_levels(rng, rows)
        sides[1::2] = sides[1::2, ::-1]
        light = sides[:, :1] + np.diff(sides) * project(PSF, angle, position + middle)
        groups.append(recorded(light, sides, exact(curve), rng, orientation=angle))
    return groups


@pytest.mark.parametrize("falling", [0, 0.5], ids=["rising", "both polarities"])
@pytest.mark.parametrize("curve", INSIDE.values(), ids=INSIDE)
@pytest.mark.parametrize("method", BLIND.values(), ids=BLIND)
def test_a_curve_of_the_family_is_found_again(method, curve, falling):
    case = ProfileCase(groups=2, profiles=7, samples=37, falling=falling)
    groups = random_profiles(exact(curve), case, seed=11)
    estimate = estimate_response(groups, method)
    assert response_error(estimate.curve, curve, estimate.covered) < FOUND


@pytest.mark.parametrize("curve", INSIDE.values(), ids=INSIDE)
@pytest.mark.parametrize(
    ("angles", "rows", "shift"), [((0.3,), 1, 0), ((0.3, 1.1, 2.5), 1, 0), ((0.3, 1.1), 4, 0.5)]
)
def test_a_known_psf_leads_back_even_from_one_edge(curve, angles, rows, shift):
    groups = shaken(curve, angles=angles, rows=rows)
    estimate = estimate_response(groups, KnownPsf(PSF, shift, ALONE))
    assert response_error(estimate.curve, curve, estimate.covered) < FOUND
    assert estimate.status is ResponseStatus.GOOD


@pytest.mark.parametrize("wrong", [PSF[::-1, ::-1], PSF.T], ids=["flipped", "transposed"])
def test_a_wrong_psf_leads_astray(wrong):
    curve = INSIDE["fifth degree"]
    estimate = estimate_response(shaken(curve), KnownPsf(wrong, 0.0, ALONE))
    assert response_error(estimate.curve, curve, estimate.covered) > 5 * FOUND


def test_shifted_edges_are_laid_on_the_known_psf():
    curve = INSIDE["fifth degree"]
    moved = [replace(g, position=g.position + 0.8) for g in shaken(curve)]
    free = estimate_response(moved, KnownPsf(PSF, 2.0, ALONE))
    fixed = estimate_response(moved, KnownPsf(PSF, 0.0, ALONE))
    assert response_error(free.curve, curve, free.covered) < FOUND
    assert response_error(fixed.curve, curve, fixed.covered) > 5 * FOUND


@pytest.mark.parametrize("method", BLIND.values(), ids=BLIND)
def test_photos_of_one_camera_are_pooled_by_adding_groups(method):
    curve = INSIDE["fifth degree"]
    first = random_profiles(exact(curve), ProfileCase(profiles=4), seed=1)
    second = random_profiles(exact(curve), ProfileCase(profiles=9, samples=25), seed=2)
    estimate = estimate_response(first + second, method)
    assert response_error(estimate.curve, curve, estimate.covered) < FOUND
    assert estimate.diagnostics["groups"] == 2
    assert estimate.diagnostics["profiles"] == 13


@pytest.mark.parametrize("method", BLIND.values(), ids=BLIND)
def test_the_order_of_groups_and_of_profiles_does_not_matter(method):
    groups = random_profiles(Camera(Gamma(1.7), noise=0.004), ProfileCase(groups=3), seed=6)
    mixed = [g.select(np.arange(len(g))[::-1]) for g in groups[::-1]]
    a, b = (estimate_response(g, method) for g in (groups, mixed))
    # The same sums in another order differ by rounding, which a search can amplify.
    np.testing.assert_allclose(
        a.curve.to_irradiance(a.intensity), b.curve.to_irradiance(b.intensity), atol=2e-3
    )


@pytest.mark.parametrize("method", BLIND.values(), ids=BLIND)
def test_the_direction_of_sampling_does_not_matter_without_noise(method):
    curve = INSIDE["fifth degree"]
    groups = random_profiles(exact(curve), ProfileCase(falling=0.5), seed=11)
    flipped = [replace(g, intensity=g.intensity[:, ::-1], sides=g.sides[:, ::-1]) for g in groups]
    estimate = estimate_response(flipped, method)
    assert response_error(estimate.curve, curve, estimate.covered) < FOUND


@pytest.mark.parametrize("method", BLIND.values(), ids=BLIND)
def test_noisy_profiles_of_several_groups_beat_the_dorf_mean(method):
    curve = Gamma(1.6)
    groups = random_profiles(Camera(curve, noise=0.003), ProfileCase(groups=4), seed=7)
    estimate = estimate_response(groups, method)
    without = response_error(dorf_mean(), curve, estimate.covered)
    assert response_error(estimate.curve, curve, estimate.covered) < without / 2


def group_of(intensity, sides):
    """A group of the given intensities, whatever they are."""
    intensity = np.asarray(intensity, dtype=float)
    rows, samples = intensity.shape
    return ProfileGroup(
        position=np.arange(samples) - (samples - 1) / 2,
        intensity=intensity,
        variance=np.full(intensity.shape, 1e-6),
        count=np.ones(intensity.shape),
        sides=sides,
        sides_variance=np.full((rows, 2), 1e-6),
        orientation=0.7,
        polarity=0,
        sources=tuple(ProfileSource(0, j, 0) for j in range(rows)),
    )


def hostile_groups():
    """Profiles that are nothing of the kind; sides are the ends unless said otherwise."""
    rng = np.random.default_rng(4)
    noise = rng.random((6, 19))
    ends = np.array([[0.1, 0.9], [0.2, 0.5], [0.6, 0.1], [0.0, 1.0], [0.3, 0.4], [0.9, 0.2]])
    return {
        "noise": (noise, ends),
        "noise with sides of noise": (noise, noise[:, [0, -1]]),
        "flat profiles": (np.full((6, 19), 0.5), ends),
        "steps": (np.where(np.arange(19) < 9, ends[:, :1], ends[:, 1:]), ends),
        "black and white": ((noise > 0.5).astype(float), ends),
        "sides swapped": (ends[:, :1] + np.diff(ends) * np.linspace(0, 1, 19), ends[:, ::-1]),
        "zeros": (np.zeros((6, 19)), ends),
    }


HOSTILE = hostile_groups()


@pytest.mark.parametrize(
    "method", [*BLIND.values(), KnownPsf(PSF, polynomial=ALONE)], ids=[*BLIND, "Eq. 4"]
)
def test_profiles_without_contrast_are_refused(method):
    rows = np.tile(np.arange(6)[:, None] / 6, 19)
    with pytest.raises(CrfDeblurError, match="add"):
        estimate_response([group_of(rows, rows[:, :2])], method)


@pytest.mark.parametrize(("intensity", "sides"), HOSTILE.values(), ids=HOSTILE)
@pytest.mark.parametrize(
    "method", [*BLIND.values(), KnownPsf(PSF, polynomial=ALONE)], ids=[*BLIND, "Eq. 4"]
)
def test_whatever_the_profiles_a_curve_increases_strictly(method, intensity, sides):
    estimate = estimate_response([group_of(intensity, sides)], method)
    grid = np.linspace(0, 1, 4001)
    assert np.all(np.diff(estimate.curve.to_irradiance(grid)) > 0)
    assert np.all(np.diff(estimate.curve.to_intensity(grid)) > 0)
    np.testing.assert_array_equal(estimate.curve.to_irradiance([0, 1]), [0, 1])
    assert np.isfinite(list(estimate.diagnostics.values())).all()


def test_a_given_response_is_handed_out_whatever_the_profiles_show():
    groups = random_profiles(exact(Gamma(2.2)), ProfileCase(), seed=0)
    curve = Gamma(1.3)
    assert estimate_response(groups, GivenResponse(curve)).curve is curve
