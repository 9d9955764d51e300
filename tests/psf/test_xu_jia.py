import numpy as np
import pytest
from scipy import ndimage
from scipy.signal import fftconvolve

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.progress import Progress, drain
from napari_crfdeblur.psf import PsfStatus, XuJia, camera_shake, estimate_psf, estimating_psf
from napari_crfdeblur.psf.blind.region import informative_region
from napari_crfdeblur.quality import kernel_similarity


def scene(rows: int, columns: int, seed: int = 4) -> FloatArray:
    """Tilted ellipses and squares of any size and gray, one before the other."""
    random = np.random.default_rng(seed)
    down, right = np.indices((rows, columns), dtype=np.float64)
    picture = np.full((rows, columns), 0.5)
    for number in range(rows * columns // 600):
        y, x, angle = random.uniform([0, 0, 0], [rows, columns, np.pi])
        radii, power = random.uniform(6, 30, 2), (2, 12)[number % 2]
        along = (down - y) * np.sin(angle) + (right - x) * np.cos(angle)
        across = (down - y) * np.cos(angle) - (right - x) * np.sin(angle)
        inside = (along / radii[0]) ** power + (across / radii[1]) ** power < 1
        picture[inside] = random.uniform(0.05, 0.95)
    return picture


def blurred(psf: FloatArray, rows: int, columns: int, noise: float = 0.003) -> FloatArray:
    sharp = scene(rows + psf.shape[0] - 1, columns + psf.shape[1] - 1)
    clean = fftconvolve(sharp, psf, mode="valid")
    return np.asarray(clean + np.random.default_rng(1).normal(0, noise, clean.shape))


@pytest.mark.parametrize(("size", "seed"), [(5, 4), (9, 3), (15, 8), (21, 3)])
def test_it_finds_an_asymmetric_psf_and_not_its_mirror_image(size: int, seed: int) -> None:
    truth = camera_shake(size, seed)
    estimate = estimate_psf(blurred(truth, 200, 260), XuJia(size=size))
    similarity = kernel_similarity(estimate.psf, truth)
    # A shift of half a pixel alone costs .1: estimates are centered to whole pixels.
    assert similarity > 0.85
    assert similarity > kernel_similarity(estimate.psf, truth[::-1, ::-1]) + 0.02


def test_the_result_is_a_psf_centered_to_a_pixel() -> None:
    estimate = estimate_psf(blurred(camera_shake(15, 8), 170, 210), XuJia(size=15))
    psf = estimate.psf
    assert all(side % 2 == 1 for side in psf.shape)
    assert psf.min() >= 0
    assert psf.sum() == pytest.approx(1, abs=1e-12)  # rounding
    centroid = np.array(ndimage.center_of_mass(psf)) - np.array(psf.shape) // 2
    assert np.abs(centroid).max() <= 0.5 + 1e-9


def test_a_clear_case_is_good_and_says_why() -> None:
    estimate = estimate_psf(blurred(camera_shake(9, 3), 200, 260), XuJia(size=9))
    assert estimate.status is PsfStatus.GOOD
    assert estimate.diagnostics["halves"] > 0.95
    assert estimate.diagnostics["residual"] < 0.3


def test_one_edge_leaves_the_other_direction_in_doubt() -> None:
    stripes = np.where(np.arange(160) // 40 % 2, 0.8, 0.2) * np.ones((130, 1))
    photo = ndimage.uniform_filter1d(stripes, 7, axis=1)
    photo += np.random.default_rng(2).normal(0, 0.002, photo.shape)
    assert estimate_psf(photo, XuJia(size=11)).status is PsfStatus.DOUBTFUL


def test_the_size_may_be_larger_than_the_blur() -> None:
    truth = camera_shake(9, 3)
    estimate = estimate_psf(blurred(truth, 200, 260), XuJia(size=17))
    assert kernel_similarity(estimate.psf, truth) > 0.85


def test_brightness_and_contrast_do_not_matter() -> None:
    photo = blurred(camera_shake(9, 3), 130, 150)
    first = estimate_psf(photo, XuJia(size=9)).psf
    dim = estimate_psf(0.2 + 0.3 * photo, XuJia(size=9)).psf
    assert kernel_similarity(first, dim) > 0.99  # single precision decides which steps count


def test_the_estimate_repeats_exactly() -> None:
    photo = blurred(camera_shake(9, 3), 120, 140)
    first, second = (estimate_psf(photo, XuJia(size=9)) for _ in range(2))
    np.testing.assert_array_equal(first.psf, second.psf)
    assert first.diagnostics == second.diagnostics


def test_only_the_region_decides() -> None:
    photo = blurred(camera_shake(9, 3), 300, 340)
    chosen = photo[informative_region(photo, 130, 9)]
    assert chosen.shape == (130, 130)
    whole = estimate_psf(photo, XuJia(size=9, region=130)).psf
    np.testing.assert_array_equal(whole, estimate_psf(chosen, XuJia(size=9)).psf)


def test_the_region_lies_on_the_edges_and_off_the_saturated_light() -> None:
    picture = np.full((200, 300), 0.4)
    picture[20:80, 20:80] = 0.8
    picture[110:190, 200:290] = 1.0
    chosen = picture[informative_region(picture, 100, 5)]
    assert chosen.max() == 0.8
    assert (chosen == 0.8).sum() == 60 * 60


def test_a_large_picture_is_searched_coarsely() -> None:
    picture = np.full((2050, 2304), 0.4)
    picture[1500:1600, 700:800] = 0.8
    assert (picture[informative_region(picture, 201, 21)] == 0.8).sum() == 100 * 100


@pytest.mark.parametrize(
    "photo",
    [
        np.full((90, 110), 0.4),
        0.4 + np.random.default_rng(3).normal(0, 0.02, (90, 110)),
        0.4 + 1e-4 * scene(90, 110),
    ],
    ids=["flat", "noise", "hardly any contrast"],
)
def test_a_featureless_picture_is_refused_with_advice(photo: FloatArray) -> None:
    with pytest.raises(CrfDeblurError, match="choose a region"):
        estimate_psf(photo, XuJia(size=9))


def test_a_psf_that_does_not_fit_is_refused_with_advice() -> None:
    with pytest.raises(CrfDeblurError, match="choose a smaller PSF size"):
        estimate_psf(scene(60, 200), XuJia(size=21))


@pytest.mark.parametrize(("size", "region"), [(4, 512), (1, 512), (31, 0)])
def test_impossible_sizes_are_refused(size: int, region: int) -> None:
    with pytest.raises(ValueError, match="expected"):
        XuJia(size=size, region=region)


def test_progress_rises_to_the_total() -> None:
    reports: list[Progress] = []
    job = estimating_psf(blurred(camera_shake(5, 4), 80, 100), XuJia(size=5))
    drain(job, reports.append)
    done = [report.done for report in reports if report.stage == "blind PSF"]
    assert done == sorted(done)
    assert set(done) == set(range(reports[-1].total + 1))
    assert {report.stage for report in reports} == {"PSF", "blind PSF"}


def test_closing_stops_the_job() -> None:
    job = estimating_psf(blurred(camera_shake(9, 3), 120, 140), XuJia(size=9))
    next(job)
    job.close()
    with pytest.raises(StopIteration):
        next(job)


def test_three_equal_channels_are_one() -> None:
    photo = blurred(camera_shake(5, 4), 80, 100).astype(np.float32)
    color = np.stack([photo, photo, photo], axis=2)
    gray_psf = estimate_psf(photo, XuJia(size=5)).psf
    # a third of each of three equal numbers is off by rounding
    assert kernel_similarity(estimate_psf(color, XuJia(size=5)).psf, gray_psf) > 0.999


def test_a_psf_much_smaller_than_asked_for_is_doubted() -> None:
    sharp = scene(200, 260) + np.random.default_rng(1).normal(0, 0.003, (200, 260))
    estimate = estimate_psf(ndimage.gaussian_filter(sharp, 0.5), XuJia(size=25))
    assert estimate.diagnostics["extent"] < 0.25
    assert estimate.status is PsfStatus.DOUBTFUL
