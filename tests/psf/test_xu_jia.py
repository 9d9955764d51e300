import numpy as np
from blurred_shapes import blurred, scene
from scipy import ndimage

from napari_crfdeblur.progress import Progress, drain
from napari_crfdeblur.psf import PsfStatus, XuJia, camera_shake, estimate_psf, estimating_psf
from napari_crfdeblur.psf.blind.overview import Overview
from napari_crfdeblur.quality import kernel_similarity


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


def test_only_the_region_decides() -> None:
    photo = blurred(camera_shake(9, 3), 300, 340)
    chosen = photo[Overview.of(photo).informative_region(130, 9)]
    assert chosen.shape == (130, 130)
    whole = estimate_psf(photo, XuJia(size=9, region=130)).psf
    np.testing.assert_array_equal(whole, estimate_psf(chosen, XuJia(size=9)).psf)


def test_the_region_lies_on_the_edges_and_off_the_saturated_light() -> None:
    picture = np.full((200, 300), 0.4)
    picture[20:80, 20:80] = 0.8
    picture[110:190, 200:290] = 1.0
    chosen = picture[Overview.of(picture).informative_region(100, 5)]
    assert chosen.max() == 0.8
    assert (chosen == 0.8).sum() == 60 * 60


def test_a_large_picture_is_searched_coarsely() -> None:
    picture = np.full((2050, 2304), 0.4)
    picture[1500:1600, 700:800] = 0.8
    assert (picture[Overview.of(picture).informative_region(201, 21)] == 0.8).sum() == 100 * 100


def test_progress_rises_to_the_total() -> None:
    reports: list[Progress] = []
    job = estimating_psf(blurred(camera_shake(5, 4), 80, 100), XuJia(size=5))
    drain(job, reports.append)
    done = [report.done for report in reports if report.stage == "blind PSF"]
    assert done == sorted(done)
    assert set(done) == set(range(reports[-1].total + 1))
    assert {report.stage for report in reports} == {"PSF", "blind PSF"}


def test_a_psf_much_smaller_than_asked_for_is_doubted() -> None:
    sharp = scene(200, 260) + np.random.default_rng(1).normal(0, 0.003, (200, 260))
    estimate = estimate_psf(ndimage.gaussian_filter(sharp, 0.5), XuJia(size=25))
    assert estimate.diagnostics["extent"] < 0.25
    assert estimate.status is PsfStatus.DOUBTFUL
