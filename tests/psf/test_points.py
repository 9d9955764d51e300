"""Lamps, streaks, points and beads as PSF: known truth, and pictures that have none."""

from functools import cache

import numpy as np
import pytest
from scipy import ndimage
from scipy.signal import fftconvolve

from napari_crfdeblur._typing import BoolArray, FloatArray
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import (
    Beads,
    Evidence,
    MotionPath,
    PsfAt,
    PsfEstimate,
    PsfEstimator,
    PsfStatus,
    Streaks,
    camera_shake,
    estimate_psf,
    gaussian,
    kernel_b,
    line,
)
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.response.saturation import clipped_pixels

SHAKE = camera_shake(21, 3)
SIDES = 240, 330  # not square
# Row, column and peak of lamps between pixels; their streaks do not touch.
LAMPS = (
    (40.3, 50.8, 0.8),
    (61.0, 142.5, 0.3),
    (52.6, 238.2, 0.55),
    (148.4, 75.1, 0.2),
    (171.7, 189.9, 0.9),
    (190.2, 284.4, 0.4),
)
GAMMA = Gamma(2.2)


def scene(lamps: tuple[tuple[float, float, float], ...], psf: FloatArray) -> FloatArray:
    """Lamps on a dim ground with a house, blurred: linear light without noise."""
    light = np.full(SIDES, 0.01) + np.linspace(0, 0.004, SIDES[1])
    light[95:130, 220:300] = 0.03
    for row, column, peak in lamps:
        i, j = int(row), int(column)
        for down, right in np.ndindex(2, 2):
            share = abs(1 - down - (row - i)) * abs(1 - right - (column - j))
            light[i + down, j + right] += peak / psf.max() * share
    return fftconvolve(light, psf, mode="same")


def evidence(light: FloatArray, noise: float = 0.002, seed: int = 1) -> Evidence:
    """As a camera with a gamma of 2.2 records it, and the response undone."""
    noisy = light + np.random.default_rng(seed).normal(0, noise, light.shape)
    photo = np.rint(255 * GAMMA.to_intensity(np.clip(noisy, 0, 1))).astype(np.uint8)
    clipped: BoolArray = clipped_pixels(photo)
    return Evidence(GAMMA.to_irradiance(photo / 255), clipped)


@cache
def night(name: str = "shake") -> tuple[Evidence, FloatArray]:
    psf = {"shake": SHAKE, "bend": kernel_b(), "line": line(17, 0.5), "long": camera_shake(31, 8)}
    return evidence(scene(LAMPS, psf[name])), psf[name]


def at(lamp: tuple[float, float, float], size: int = 37) -> PsfAt:
    return PsfAt(lamp[0], lamp[1], size)


def refusal(seen: Evidence, method: PsfEstimator) -> str:
    with pytest.raises(CrfDeblurError) as caught:
        estimate_psf(seen, method)
    return str(caught.value)


# Streaks


@pytest.mark.parametrize("name", ["shake", "bend", "line", "long"])
def test_streaks_are_the_psf_and_not_its_mirror_image(name: str) -> None:
    seen, truth = night(name)
    found = estimate_psf(seen, Streaks())
    assert found.status is PsfStatus.GOOD
    assert found.diagnostics["streaks"] >= 5
    assert kernel_similarity(found.psf, truth) > 0.97
    if name != "line":  # which is its own mirror image
        assert kernel_similarity(found.psf[::-1, ::-1], truth) < 0.9


def test_the_psf_of_streaks_is_centered_and_has_sum_1() -> None:
    psf = estimate_psf(night()[0], Streaks()).psf
    assert psf.sum() == pytest.approx(1, abs=1e-12)  # rounding
    assert psf.min() >= 0
    off = np.array(ndimage.center_of_mass(psf)) - np.array(psf.shape) // 2
    assert np.abs(off).max() < 0.1  # the alignment is as good as that


def test_turned_photos_have_turned_streaks() -> None:
    seen, _ = night()
    psf = estimate_psf(seen, Streaks()).psf
    turned = estimate_psf(Evidence(np.rot90(seen.picture), np.rot90(seen.clipped)), Streaks()).psf
    assert kernel_similarity(turned, np.rot90(psf)) > 0.99  # another of the things can be first


def test_the_size_can_be_given_and_a_smaller_one_leaves_streaks_out() -> None:
    seen, truth = night()
    assert kernel_similarity(estimate_psf(seen, Streaks(size=41)).psf, truth) > 0.97
    assert "no light streaks" in refusal(seen, Streaks(size=9))


def test_colored_lamps_agree_with_white_ones() -> None:
    colors = np.array([[1, 0.1, 0.05], [0.2, 1, 0.4], [0.1, 0.3, 1], [1, 1, 1], [1, 0.8, 0.2]])
    light = np.stack(
        [
            scene(
                tuple((r, c, p * own) for (r, c, p), own in zip(LAMPS, channel, strict=False)),
                SHAKE,
            )
            for channel in colors.T
        ],
        axis=2,
    )
    assert kernel_similarity(estimate_psf(evidence(light), Streaks()).psf, SHAKE) > 0.97


def test_clipped_lamps_are_left_out() -> None:
    lamps = (*LAMPS[1:], (*LAMPS[0][:2], 9.0))
    found = estimate_psf(evidence(scene(lamps, SHAKE)), Streaks())
    assert found.diagnostics["streaks"] == len(LAMPS) - 1
    assert kernel_similarity(found.psf, SHAKE) > 0.97


def test_lamps_that_all_clip_are_refused() -> None:
    lamps = tuple((row, column, 9.0) for row, column, _ in LAMPS)
    assert "draw a box" in refusal(evidence(scene(lamps, SHAKE)), Streaks())


def test_two_streaks_are_too_few() -> None:
    assert "no light streaks" in refusal(evidence(scene(LAMPS[:2], SHAKE)), Streaks())


def test_windows_in_rows_are_no_streaks() -> None:
    light = np.full(SIDES, 0.01)
    for row in (50, 110, 170):
        for column in (40, 100, 160, 220, 280):
            light[row : row + 10, column : column + 7] = 0.1 + 0.003 * column
    seen = evidence(fftconvolve(light, camera_shake(9, 2), mode="same"))
    assert "no light streaks" in refusal(seen, Streaks())


def test_the_same_letter_at_several_places_is_no_streak() -> None:
    light = np.full(SIDES, 0.01)
    for row, column in ((30, 45), (71, 260), (118, 121), (183, 203)):
        light[row : row + 15, column : column + 3] = 0.6
        light[row + 12 : row + 15, column : column + 9] = 0.6
    assert "no light streaks" in refusal(evidence(light), Streaks())


def test_stars_of_a_sharp_photo_are_refused() -> None:
    rng = np.random.default_rng(4)
    light = np.full(SIDES, 0.01)
    light[rng.integers(5, 235, 40), rng.integers(5, 325, 40)] = rng.uniform(0.5, 3, 40)
    refusal(evidence(fftconvolve(light, gaussian(0.6), mode="same")), Streaks())


def test_few_stars_of_a_sharp_photo_are_told_to_be_points() -> None:
    seen = evidence(scene(LAMPS, gaussian(0.6)))
    assert "points" in refusal(seen, Streaks())


def test_round_lamps_are_doubted_as_they_may_be_sharp() -> None:
    found = estimate_psf(evidence(scene(LAMPS, gaussian(2.0))), Streaks())
    assert found.status is PsfStatus.DOUBTFUL
    assert found.diagnostics["roundness"] > 0.4


def test_strokes_of_ink_on_white_are_no_streaks() -> None:
    rng = np.random.default_rng(5)
    page = np.full(SIDES, 0.9)
    for row in range(20, 220, 22):
        for column in range(15, 310, 11):
            if rng.random() < 0.8:
                height, width = rng.integers(2, 12), rng.integers(2, 7)
                page[row : row + height, column : column + width] = 0.05
    for psf in (np.ones((1, 1)), SHAKE):
        refusal(evidence(fftconvolve(page, psf, mode="same")), Streaks())


@pytest.mark.parametrize("level", [0.0, 0.02, 0.8])
def test_an_empty_sky_has_no_streaks(level: float) -> None:
    sky = np.full(SIDES, level)
    sky[200:] = 0.02 + 0.3 * np.random.default_rng(6).random((40, SIDES[1]))
    assert "no light streaks" in refusal(evidence(sky, 0.005), Streaks())


# A box


@pytest.mark.parametrize("name", ["shake", "bend", "line", "long"])
@pytest.mark.parametrize("lamp", [0, 2, 4])
def test_a_box_around_a_streak_is_the_psf(name: str, lamp: int) -> None:
    seen, truth = night(name)
    found = estimate_psf(seen, at(LAMPS[lamp], 47))
    assert found.status is PsfStatus.GOOD
    # its place between pixels is its own, which costs up to .15 for thin lines
    assert kernel_similarity(found.psf, truth) > 0.8
    exact = scene(((LAMPS[lamp][0], LAMPS[lamp][1], 1.0),), truth) - scene((), truth)
    assert kernel_similarity(found.psf, exact) > 0.99


def test_a_faint_lamp_in_the_box_is_left_out() -> None:
    row, column, _ = LAMPS[4]
    lamps = (LAMPS[4], (row - 17.0, column + 17.0, 0.08))
    seen = evidence(scene(lamps, SHAKE))
    alone = evidence(scene(lamps[:1], SHAKE))
    psf, own = (estimate_psf(each, PsfAt(row, column, 51)).psf for each in (seen, alone))
    assert kernel_similarity(psf, own) > 0.999


def test_a_box_beyond_the_picture_is_refused_with_advice() -> None:
    assert "smaller box" in refusal(night()[0], PsfAt(5, 40, 37))
    assert "smaller box" in refusal(night()[0], PsfAt(400, 40, 37))


def test_a_box_without_a_streak_is_refused_with_advice() -> None:
    assert "stands out" in refusal(night()[0], PsfAt(200, 120, 37))


def test_two_streaks_in_a_box_are_refused_with_advice() -> None:
    seen = evidence(scene(((60.0, 60.0, 0.5), (60.4, 92.3, 0.6)), SHAKE))
    assert "several streaks" in refusal(seen, PsfAt(60, 76, 71))


def test_a_streak_that_the_box_cuts_is_refused_with_advice() -> None:
    row, column, _ = LAMPS[0]
    assert "larger box" in refusal(night()[0], PsfAt(row, column, 15))


def test_a_clipped_streak_is_doubtful_and_one_that_is_lost_is_refused() -> None:
    row, column, _ = LAMPS[0]
    mild = estimate_psf(evidence(scene(((row, column, 1.7),), SHAKE)), at(LAMPS[0]))
    assert mild.status.doubted
    assert mild.diagnostics["clipped"] > 0.01
    lost = evidence(scene(((row, column, 20.0),), SHAKE))
    assert "choose a fainter streak" in refusal(lost, at(LAMPS[0], 47))


def test_color_is_taken_from_the_channels_that_do_not_clip() -> None:
    row, column, _ = LAMPS[0]
    light = np.stack([scene(((row, column, p),), SHAKE) for p in (0.5, 4.0, 0.2)], axis=2)
    found = estimate_psf(evidence(light), at(LAMPS[0], 47))
    assert found.status is PsfStatus.GOOD
    assert found.diagnostics["clipped"] == 0


# Beads


PLACES = tuple((row, column) for row, column, _ in LAMPS)


def test_beads_are_the_psf_of_all_of_them() -> None:
    psf = gaussian(2.5)
    found = estimate_psf(evidence(scene(LAMPS, psf), 0.01), Beads(PLACES, 31))
    assert found.status is PsfStatus.GOOD
    assert found.diagnostics["beads"] == len(LAMPS)
    assert kernel_similarity(found.psf, psf) > 0.98


def test_more_beads_tell_more_in_noise() -> None:
    seen, truth = evidence(scene(LAMPS, SHAKE), 0.02), SHAKE
    one = estimate_psf(seen, Beads(PLACES[5:], 37)).psf
    assert kernel_similarity(estimate_psf(seen, Beads(PLACES, 37)).psf, truth) > kernel_similarity(
        one, truth
    )


def test_places_need_not_be_exact() -> None:
    seen, truth = night()
    rough = tuple((round(row) + 2.0, round(column) - 3.0) for row, column in PLACES)
    assert kernel_similarity(estimate_psf(seen, Beads(rough, 41)).psf, truth) > 0.97


def test_a_bead_that_overlaps_another_is_left_out() -> None:
    lamps = (*LAMPS, (LAMPS[2][0] + 14, LAMPS[2][1] + 11, 0.5))
    found = estimate_psf(evidence(scene(lamps, SHAKE)), Beads(PLACES, 37))
    assert found.diagnostics["left_out"] >= 1
    assert found.status is PsfStatus.GOOD
    assert kernel_similarity(found.psf, SHAKE) > 0.97


def test_one_bead_is_doubtful_and_none_is_refused() -> None:
    seen, _ = night()
    assert estimate_psf(seen, Beads(PLACES[:1], 37)).status.doubted
    assert "stands out" in refusal(seen, Beads(((200, 120), (120, 130)), 31))


# A path


def test_a_path_is_the_line_along_it() -> None:
    path = MotionPath(((10, 20), (10, 36)), width=0)
    assert kernel_similarity(path.psf, line(16, 0)) > 0.99
    assert (
        kernel_similarity(MotionPath(((3, 2), (11, 15)), width=0).psf, line(15.26, 0.5517)) > 0.99
    )


def test_a_bent_path_goes_from_corner_to_corner_and_keeps_its_direction() -> None:
    psf = MotionPath(((0, 0), (12, 0), (12, 5)), width=1).psf
    assert psf.sum() == pytest.approx(1, abs=1e-12)  # rounding
    rows, columns = psf.sum(axis=1), psf.sum(axis=0)
    assert np.flatnonzero(rows > 1e-3)[-1] - np.flatnonzero(rows > 1e-3)[0] in (12, 13, 14)
    assert rows.argmax() > len(rows) // 2  # the foot of the L lies below
    assert columns.argmax() < len(columns) // 2


def test_a_wider_path_covers_more() -> None:
    thin, wide = (MotionPath(((0, 0), (9, 4)), width=width).psf for width in (1, 5))
    assert np.square(wide).sum() < 0.5 * np.square(thin).sum()


@pytest.mark.parametrize("points", [(), ((3, 4),), ((3, 4), (3, 4))])
def test_a_path_of_one_point_is_refused_with_advice(
    points: tuple[tuple[float, float], ...],
) -> None:
    with pytest.raises(CrfDeblurError, match="needs two points"):
        MotionPath(points)


def test_a_path_is_given_and_refused_if_the_picture_is_smaller() -> None:
    path = MotionPath(((0, 0), (0, 40)))
    found: PsfEstimate = estimate_psf(np.zeros((50, 60)), path)
    assert found.status is PsfStatus.GIVEN
    with pytest.raises(CrfDeblurError, match="larger than"):
        estimate_psf(np.zeros((30, 30)), path)


@pytest.mark.parametrize(
    ("method", "values"),
    [
        (PsfAt, {"row": -1, "column": 3, "size": 9}),
        (PsfAt, {"row": 4, "column": np.nan, "size": 9}),
        (PsfAt, {"row": 4, "column": 3, "size": 8}),
        (PsfAt, {"row": 4, "column": 3, "size": 5}),
        (Beads, {"places": (), "size": 9}),
        (Beads, {"places": ((1, 2, 3),), "size": 9}),
        (Beads, {"places": ((-1, 2),), "size": 9}),
        (Beads, {"places": 3, "size": 9}),
        (Streaks, {"size": 4}),
        (MotionPath, {"points": ((0, 0), (1, 1)), "width": -1}),
        (MotionPath, {"points": "ab"}),
    ],
)
def test_wrong_arguments_are_refused(method: type[PsfEstimator], values: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="expected"):
        method(**values)
