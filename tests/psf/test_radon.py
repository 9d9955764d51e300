from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.profiles import ProfileGroup, ProfileSource
from napari_crfdeblur.progress import Progress, drain
from napari_crfdeblur.psf import (
    Evidence,
    PsfEstimate,
    PsfStatus,
    RadonFit,
    XuJia,
    camera_shake,
    disk,
    estimate_psf,
    estimating_psf,
    gaussian,
    line,
    project,
)
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Gamma, ResponseCurve

CURVE = Gamma(2.2)
SHAKE = camera_shake(9, 3)  # asymmetric
ALL_ROUND = (0.05 + np.arange(10) * np.pi / 10).tolist()


def profiles(
    psf: FloatArray,
    angles: Sequence[float],
    *,
    curve: ResponseCurve = CURVE,
    noise: float = 0.0,
    each: int = 3,
    gain: float = 1.0,
    beside: float = 2.0,
    falling: bool | None = None,
    seed: int = 5,
) -> list[ProfileGroup]:
    """Profiles of edges of some orientations, up to `beside` pixels beside their places."""
    rng = np.random.default_rng(seed)
    position = np.arange(-2 * len(psf), 2 * len(psf) + 1) / 2
    groups = []
    for angle in angles:
        places = rng.uniform(-beside, beside) + rng.normal(0, 0.1, each)
        sides = np.sort(rng.uniform([[0.1], [0.6]], [[0.4], [0.9]], (2, each)), axis=0).T * gain
        falls = rng.random(each) < 0.5 if falling is None else np.full(each, falling)
        sides = np.where(falls[:, np.newaxis], sides[:, ::-1], sides)
        spread = np.stack([project(psf, angle, position - place) for place in places])
        light = sides[:, :1] + np.diff(sides, axis=1) * spread
        intensity = curve.to_intensity(light) + noise * rng.standard_normal(light.shape)
        groups.append(
            ProfileGroup(
                position=position,
                intensity=intensity,
                variance=np.full(light.shape, noise**2 + 1e-8),
                count=np.ones(light.shape),
                sides=curve.to_intensity(sides),
                sides_variance=np.full(sides.shape, noise**2 / 9 + 1e-8),
                orientation=angle,
                polarity=0,
                sources=tuple(ProfileSource(0, edge, 0) for edge in range(each)),
            )
        )
    return groups


def from_edges(
    groups: Sequence[ProfileGroup],
    curve: ResponseCurve | list[ResponseCurve],
    method: RadonFit | None = None,
) -> PsfEstimate:
    """The PSF that these profiles show."""
    evidence = Evidence(groups=tuple(groups), response=curve)
    return estimate_psf(evidence, method or RadonFit())


def turned(group: ProfileGroup) -> ProfileGroup:
    """The same edges seen from their other side."""
    return replace(
        group,
        intensity=group.intensity[:, ::-1],
        variance=group.variance[:, ::-1],
        sides=group.sides[:, ::-1],
        sides_variance=group.sides_variance[:, ::-1],
        orientation=group.orientation + np.pi,
    )


@pytest.mark.parametrize(
    "truth", [SHAKE, camera_shake(15, 8), line(9, 0.5), disk(4), gaussian(1.5)]
)
def test_many_orientations_determine_the_psf(truth: FloatArray) -> None:
    estimate = from_edges(profiles(truth, ALL_ROUND), CURVE)
    # what is left are pixels below a fiftieth of the peak and a part of a pixel of shift
    assert kernel_similarity(estimate.psf, truth) > 0.97
    assert estimate.status is PsfStatus.GOOD


def test_it_is_not_the_mirror_image() -> None:
    psf = from_edges(profiles(SHAKE, ALL_ROUND), CURVE).psf
    for other in (SHAKE[::-1, ::-1], SHAKE[::-1], SHAKE[:, ::-1]):
        assert kernel_similarity(psf, SHAKE) > kernel_similarity(psf, other) + 0.05


def test_noise_does_little_harm() -> None:
    groups = profiles(SHAKE, ALL_ROUND, noise=0.01)
    # ten orientations of three edges each, a hundredth of full scale
    assert kernel_similarity(from_edges(groups, CURVE).psf, SHAKE) > 0.93


@pytest.mark.parametrize("size", [None, 15])
def test_the_result_is_a_psf_centered_to_a_pixel(size: int | None) -> None:
    groups = profiles(SHAKE, ALL_ROUND, noise=0.005)
    psf = from_edges(groups, CURVE, RadonFit(size=size)).psf
    assert all(side % 2 == 1 for side in psf.shape)
    assert psf.min() >= 0
    assert psf.sum() == pytest.approx(1, abs=1e-12)  # rounding
    centroid = np.array(ndimage.center_of_mass(psf)) - np.array(psf.shape) // 2
    assert np.abs(centroid).max() <= 0.5 + 1e-9


def test_transposed_edges_transpose_the_psf() -> None:
    groups = profiles(SHAKE, ALL_ROUND)
    across = [replace(g, orientation=np.pi / 2 - g.orientation) for g in groups]
    psf, other = (from_edges(g, CURVE).psf for g in (groups, across))
    # the order of the pixels decides over rounding, and thereby over when the search ends
    np.testing.assert_allclose(other, psf.T, atol=1e-4)


def test_a_quarter_turn_of_the_edges_turns_the_psf() -> None:
    groups = profiles(SHAKE, ALL_ROUND)
    on = [replace(g, orientation=g.orientation + np.pi / 2) for g in groups]
    psf, other = (from_edges(g, CURVE).psf for g in (groups, on))
    # (row, column) = (sin, cos): a normal along columns comes to lie along rows
    np.testing.assert_allclose(other, np.rot90(psf, -1), atol=1e-4)


def test_it_does_not_matter_from_which_side_an_edge_is_seen() -> None:
    groups = profiles(SHAKE, ALL_ROUND)
    other = [turned(g) if n % 2 else g for n, g in enumerate(groups)]
    psf, seen = (from_edges(g, CURVE).psf for g in (groups, other))
    np.testing.assert_allclose(seen, psf, atol=1e-4)  # as above


def test_polarity_does_not_matter() -> None:
    rising, falling = (
        from_edges(profiles(SHAKE, ALL_ROUND, falling=falling), CURVE).psf
        for falling in (False, True)
    )
    assert kernel_similarity(rising, falling) > 0.99  # variances are those of other intensities


def test_where_the_edges_lie_does_not_matter() -> None:
    here, there = (
        from_edges(profiles(SHAKE, ALL_ROUND, beside=beside), CURVE).psf for beside in (0.0, 3.0)
    )
    assert kernel_similarity(here, there) > 0.98  # a part of a pixel of shift


def test_the_amount_of_light_does_not_matter() -> None:
    bright, dim = (
        from_edges(profiles(SHAKE, ALL_ROUND, gain=gain), CURVE).psf for gain in (1.0, 0.5)
    )
    # the floor of the noise is a share of full scale
    assert kernel_similarity(bright, dim) > 0.99


def test_the_estimate_repeats_exactly() -> None:
    groups = profiles(SHAKE, ALL_ROUND, noise=0.01)
    first, second = (from_edges(groups, CURVE) for _ in range(2))
    np.testing.assert_array_equal(first.psf, second.psf)
    assert first.diagnostics == second.diagnostics


def test_the_response_is_undone_channel_by_channel() -> None:
    curves = [Gamma(1.2), Gamma(1.8), Gamma(2.4)]
    groups = []
    for channel, curve in enumerate(curves):
        for group in profiles(SHAKE, ALL_ROUND, curve=curve, each=1, seed=channel):
            groups.append(replace(group, sources=(ProfileSource(0, 0, channel),)))
    right = from_edges(groups, curves)
    wrong = from_edges(groups, curves[0])
    assert kernel_similarity(right.psf, SHAKE) > 0.97
    assert right.diagnostics["misfit"] < wrong.diagnostics["misfit"] / 4


def test_bad_edges_hardly_count() -> None:
    groups = profiles(SHAKE, ALL_ROUND, each=4)
    spoiled = []
    for group in groups:
        intensity = group.intensity.copy()
        intensity[0] = np.linspace(*group.sides[0], intensity.shape[1])
        spoiled.append(replace(group, intensity=intensity))
    psf = from_edges(spoiled, CURVE, RadonFit(size=13)).psf
    assert kernel_similarity(psf, SHAKE) > 0.95


@pytest.mark.parametrize(
    ("angles", "gap"), [([0.4], 180), ([0.1, 0.1 + np.pi / 2], 90), ([0.1, 0.5, 0.9, 1.3], 111)]
)
def test_few_orientations_are_doubted(angles: list[float], gap: float) -> None:
    estimate = from_edges(profiles(SHAKE, angles), CURVE)
    assert estimate.status is PsfStatus.INCOMPLETE
    assert estimate.diagnostics["gap"] == pytest.approx(gap, abs=1)  # rounded above
    assert estimate.diagnostics["orientations"] == len(angles)


def test_one_orientation_is_still_explained() -> None:
    groups = profiles(SHAKE, [0.4], beside=0)
    psf = from_edges(groups, CURVE).psf
    positions = np.linspace(-8, 8, 33)
    found, truth = (project(k, 0.4, positions[:, np.newaxis]).ravel() for k in (psf, SHAKE))
    shift = (truth - found).sum() * 0.5
    # smoothness, and pixels below a fiftieth of the peak
    assert np.abs(project(psf, 0.4, positions + shift) - truth).max() < 0.05


def test_no_profiles_are_refused_with_advice() -> None:
    with pytest.raises(CrfDeblurError, match="find or draw more edges"):
        from_edges([], CURVE)


def test_profiles_without_contrast_are_refused_with_advice() -> None:
    groups = [
        replace(g, sides=np.full_like(g.sides, 0.5), intensity=np.full_like(g.intensity, 0.5))
        for g in profiles(SHAKE, ALL_ROUND)
    ]
    with pytest.raises(CrfDeblurError, match="contrast"):
        from_edges(groups, CURVE)


def test_a_channel_without_a_response_is_refused() -> None:
    groups = profiles(SHAKE, ALL_ROUND)
    groups[0] = replace(groups[0], sources=tuple(ProfileSource(0, e, 2) for e in range(3)))
    with pytest.raises(ValueError, match="channel 2"):
        from_edges(groups, [CURVE, CURVE])


@pytest.mark.parametrize(
    "options",
    [{"size": 4}, {"size": 1}, {"smoothness": -1.0}, {"sparsity": np.nan}],
)
def test_impossible_options_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="expected"):
        RadonFit(**options)  # type: ignore[arg-type]


def all_round() -> Evidence:
    return Evidence(groups=tuple(profiles(SHAKE, ALL_ROUND)), response=CURVE)


def test_profiles_without_a_response_are_refused() -> None:
    with pytest.raises(ValueError, match="response"):
        estimate_psf(replace(all_round(), response=None), RadonFit())


def test_a_method_that_looks_at_the_picture_needs_one() -> None:
    with pytest.raises(ValueError, match="picture"):
        estimate_psf(all_round(), XuJia())


def test_progress_rises_to_the_total() -> None:
    reports: list[Progress] = []
    drain(estimating_psf(all_round(), RadonFit()), reports.append)
    done = [report.done for report in reports]
    assert done == sorted(done)
    assert done[-1] == reports[-1].total
    assert {report.stage for report in reports} == {"PSF from edges"}


def test_closing_stops_the_job() -> None:
    job = estimating_psf(all_round(), RadonFit())
    next(job)
    next(job)
    job.close()
    with pytest.raises(StopIteration):
        next(job)
