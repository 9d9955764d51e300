from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from blurred_shapes import blurred, scene
from scipy.signal import fftconvolve

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.profiles import ProfileGroup, ProfileSource
from napari_crfdeblur.psf import (
    Evidence,
    PsfEstimate,
    PsfStatus,
    RadonFit,
    RadonMap,
    XuJia,
    camera_shake,
    estimate_psf,
    project,
)
from napari_crfdeblur.psf.blind.kernel_fit import KernelFit
from napari_crfdeblur.psf.radon import edge_term
from napari_crfdeblur.psf.radon.edge_spreads import clear_spreads
from napari_crfdeblur.psf.radon.edge_term import JointFit, affordable, as_explained, as_measured
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Gamma

CURVE = Gamma(2.2)
SHAKE = camera_shake(9, 3)  # asymmetric
FEW_PIXELS = (80, 100)
ALL_ROUND = (0.05 + np.arange(8) * np.pi / 8).tolist()


def profiles(
    psf: FloatArray, angles: Sequence[float], *, noise: float = 0.003, each: int = 3, seed: int = 5
) -> tuple[ProfileGroup, ...]:
    """Profiles of edges of some orientations, not quite at their places."""
    rng = np.random.default_rng(seed)
    position = np.arange(-2 * len(psf), 2 * len(psf) + 1) / 2
    groups = []
    for angle in angles:
        places = rng.uniform(-2, 2) + rng.normal(0, 0.1, each)
        sides = np.sort(rng.uniform([[0.1], [0.6]], [[0.4], [0.9]], (2, each)), axis=0).T
        spread = np.stack([project(psf, angle, position - place) for place in places])
        light = sides[:, :1] + np.diff(sides, axis=1) * spread
        group = ProfileGroup(
            position=position,
            intensity=CURVE.to_intensity(light) + noise * rng.standard_normal(light.shape),
            variance=np.full(light.shape, noise**2 + 1e-8),
            count=np.ones(light.shape),
            sides=CURVE.to_intensity(sides),
            sides_variance=np.full(sides.shape, noise**2 / 9 + 1e-8),
            orientation=angle,
            polarity=0,
            sources=tuple(ProfileSource(0, edge, 0) for edge in range(each)),
        )
        groups.append(group)
    return tuple(groups)


def found(picture: FloatArray, groups: tuple[ProfileGroup, ...], method: RadonMap) -> PsfEstimate:
    return estimate_psf(Evidence(picture, groups=groups, response=CURVE), method)


@cache
def of_small_picture() -> tuple[FloatArray, FloatArray]:
    """A picture so small and noisy that it alone does not quite tell its PSF."""
    psf = camera_shake(13, 8)
    return psf, blurred(psf, 80, 100, noise=0.02)


@cache
def of_small_picture_alone() -> FloatArray:
    return estimate_psf(of_small_picture()[1], XuJia(size=13)).psf


def test_edges_tell_what_the_picture_does_not() -> None:
    psf, picture = of_small_picture()
    alone = of_small_picture_alone()
    both = found(picture, profiles(psf, ALL_ROUND), RadonMap(size=13)).psf
    assert kernel_similarity(both, psf) > kernel_similarity(alone, psf) + 0.02
    for other in (psf[::-1, ::-1], psf[::-1], psf[:, ::-1]):
        assert kernel_similarity(both, psf) > kernel_similarity(both, other) + 0.05


def test_the_picture_tells_what_edges_do_not() -> None:
    picture = blurred(SHAKE, 130, 170)
    groups = profiles(SHAKE, [0.3, 0.5])
    edges = estimate_psf(Evidence(groups=groups, response=CURVE), RadonFit(size=9)).psf
    both = found(picture, groups, RadonMap(size=9))
    assert kernel_similarity(both.psf, SHAKE) > 0.98
    assert kernel_similarity(edges, SHAKE) < 0.8
    assert both.status is PsfStatus.GOOD
    assert both.diagnostics["profiles"] == 6
    assert both.diagnostics["orientations"] == 2


@pytest.mark.parametrize("groups", [(), profiles(SHAKE, [0.3])], ids=["no edges", "no weight"])
def test_without_edges_it_is_the_method_of_the_picture_alone(
    groups: tuple[ProfileGroup, ...],
) -> None:
    picture = blurred(SHAKE, 90, 120)
    both = found(picture, groups, RadonMap(size=9, weight=0.0))
    np.testing.assert_array_equal(both.psf, estimate_psf(picture, XuJia(size=9)).psf)
    assert both.diagnostics["profiles"] == 3 * len(groups)


def test_profiles_without_contrast_are_no_edges() -> None:
    picture = blurred(SHAKE, 90, 120)
    flat = tuple(
        replace(g, intensity=0 * g.intensity + 0.5, sides=0 * g.sides + 0.5)
        for g in profiles(SHAKE, [0.3, 1.2])
    )
    both = found(picture, flat, RadonMap(size=9))
    assert both.diagnostics["profiles"] == 0
    np.testing.assert_array_equal(both.psf, estimate_psf(picture, XuJia(size=9)).psf)


def test_transposed_pictures_and_edges_transpose_the_psf() -> None:
    picture, groups = blurred(SHAKE, 90, 120), profiles(SHAKE, ALL_ROUND)
    across = tuple(replace(g, orientation=np.pi / 2 - g.orientation) for g in groups)
    psf = found(picture, groups, RadonMap(size=9)).psf
    other = found(picture.T, across, RadonMap(size=9)).psf
    # the first guess is a short blur along the rows, so that it is only nearly so
    assert kernel_similarity(other, psf.T) > 0.995


@pytest.mark.parametrize("what", ["double", "half as wide"])
def test_an_edge_that_contradicts_the_others_costs_less_than_all_edges_gain(what: str) -> None:
    psf, picture = of_small_picture()
    groups = profiles(psf, ALL_ROUND)
    bad = {
        "double": lambda p: (np.roll(p, 8, axis=1) + np.roll(p, -8, axis=1)) / 2,
        "half as wide": lambda p: p,
    }
    group = groups[2]
    position = group.position * (0.5 if what == "half as wide" else 1.0)
    worse = replace(group, position=position, intensity=bad[what](group.intensity))
    alone = of_small_picture_alone()
    spoilt = found(picture, (*groups[:2], worse, *groups[3:]), RadonMap(size=13)).psf
    assert kernel_similarity(spoilt, psf) > kernel_similarity(alone, psf)


def test_few_wrong_edges_do_not_lead_a_good_picture_astray() -> None:
    picture = blurred(SHAKE, 110, 140)
    wrong = profiles(camera_shake(9, 12), [0.2, 1.4, 2.2])
    both = found(picture, wrong, RadonMap(size=9))
    assert kernel_similarity(both.psf, SHAKE) > 0.97
    assert both.diagnostics["misfit"] > 3  # in variances: they are contradicted


def test_profiles_need_their_response() -> None:
    with pytest.raises(ValueError, match="expected the response"):
        estimate_psf(Evidence(blurred(SHAKE, 60, 70), groups=profiles(SHAKE, [0.3])), RadonMap())


def test_a_picture_is_needed() -> None:
    with pytest.raises(ValueError, match="expected a linear picture"):
        estimate_psf(Evidence(groups=profiles(SHAKE, [0.3]), response=CURVE), RadonMap())


def test_the_size_is_found() -> None:
    both = found(blurred(SHAKE, 90, 110), profiles(SHAKE, ALL_ROUND[::2]), RadonMap())
    assert kernel_similarity(both.psf, SHAKE) > 0.95


def joint_fit(psf: FloatArray, weight: float = 0.7) -> JointFit:
    sharp = np.stack(np.gradient(scene(60, 80)))
    measured = np.stack([fftconvolve(plane, psf, mode="same") for plane in sharp])
    picture = KernelFit.of(sharp, measured, len(psf))
    spreads = clear_spreads(profiles(psf, [0.3, 1.2, 2.5], noise=0), CURVE)
    return JointFit.of_both(picture, as_explained(spreads, psf), weight)


def test_the_joint_term_is_symmetric() -> None:
    fit, rng = joint_fit(SHAKE), np.random.default_rng(0)
    x, y = rng.standard_normal((2, *SHAKE.shape))
    assert np.vdot(fit.blurred_twice(x), y) == pytest.approx(np.vdot(x, fit.blurred_twice(y)))


def test_clean_edges_leave_the_true_psf_where_it_is() -> None:
    spreads = clear_spreads(profiles(SHAKE, [0.3, 1.2, 2.5], noise=0), CURVE)
    nothing = KernelFit.of(np.zeros((2, 20, 30)), np.zeros((2, 20, 30)), len(SHAKE))
    for placing in (as_measured, as_explained):
        fit = JointFit.of_both(nothing, placing(spreads, SHAKE), 1.0)
        slope = fit.blurred_twice(SHAKE) - fit.correlation
        scale = np.abs(fit.blurred_twice(SHAKE)).max()
        # profiles lie a tenth of a pixel beside each other, which their mean smears
        assert np.abs(slope).max() < 0.01 * scale


def test_very_wide_psfs_take_the_clearest_edges_that_memory_permits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(edge_term, "MOST_NUMBERS", 2**23)
    groups = profiles(camera_shake(41, 3), np.linspace(0, 3, 40).tolist(), each=2)
    spreads = clear_spreads(groups, CURVE)
    assert len(affordable(spreads, 21)) == 40
    kept = affordable(spreads, 121)
    assert 3 <= len(kept) < 40
    assert sum(s.position.size for s in kept) * 121**2 <= 2**23
    assert kept[0].step == pytest.approx(3)  # the largest multiple of half a pixel below 121 / 40
