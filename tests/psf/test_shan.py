import numpy as np
import pytest
from blurred_shapes import blurred, scene
from scipy import ndimage

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.progress import Progress, drain
from napari_crfdeblur.psf import Shan, camera_shake, estimate_psf, estimating_psf
from napari_crfdeblur.psf.blind.blurred import Blurred
from napari_crfdeblur.psf.blind.shan.kernel import sparse_kernel
from napari_crfdeblur.psf.blind.shan.latent import Latent, differences, gradient_of
from napari_crfdeblur.psf.blind.shan.prior import KNEE, most_likely, penalty
from napari_crfdeblur.quality import kernel_similarity


def test_the_penalty_is_continuous_and_rises() -> None:
    values = penalty(np.linspace(0, 1, 4001))
    assert (np.diff(values) > 0).all()
    near, far = penalty(np.array([KNEE - 1e-9, KNEE + 1e-9]))
    assert far == pytest.approx(near, abs=1e-5)  # of 5, and by construction
    np.testing.assert_array_equal(penalty(np.array([-0.3])), penalty(np.array([0.3])))


def test_the_substitute_is_the_global_minimum() -> None:
    random = np.random.default_rng(5)
    rough, measured = random.normal(0, 0.1, (2, 2, 4, 5))
    local, coupling, weight = random.uniform(0, 20, (4, 5)), 16.0, 0.05
    found = most_likely(rough, coupling, measured, local, weight)

    def cost(value: FloatArray) -> FloatArray:
        pulled = local * (value - measured) ** 2 + coupling * (value - rough) ** 2
        return np.asarray(weight * penalty(value) + pulled)

    trials = np.linspace(-0.6, 0.6, 24001)[:, None, None, None] * np.ones_like(rough)
    # trials lie 5e-5 apart: between two of them the cost changes by some 1e-4
    assert (cost(found) <= cost(trials).min(axis=0) + 1e-4).all()


def test_differences_are_forward() -> None:
    plane = np.random.default_rng(0).normal(size=(12, 15))
    steps = differences((12, 15))
    down, across = gradient_of(np.fft.rfft2(plane), steps, (12, 15))
    # transforms of single precision
    np.testing.assert_allclose(down, np.roll(plane, -1, axis=0) - plane, atol=1e-5)
    np.testing.assert_allclose(across, np.roll(plane, -1, axis=1) - plane, atol=1e-5)


def test_the_latent_picture_is_nearer_to_the_sharp_one() -> None:
    psf = camera_shake(9, 3)
    photo = Blurred(blurred(psf, 90, 120).astype(np.float32))
    sharp = scene(98, 128)[4:-4, 4:-4]
    found = Latent.of(photo, 9).predict(psf, 0.01, 5.0)
    inside = (slice(10, -10), slice(10, -10))
    before = np.square(photo.plane - sharp)[inside].mean()
    assert np.square(found - sharp)[inside].mean() < before / 3


def test_the_true_picture_gives_the_true_kernel() -> None:
    psf = camera_shake(9, 3)
    photo = Blurred(blurred(psf, 90, 120, noise=0).astype(np.float32))
    sharp = scene(98, 128)[4:-4, 4:-4]
    found = sparse_kernel(sharp, photo, np.full((9, 9), 1 / 81), 0.0)
    assert found.min() >= 0
    # beyond the border the picture is not known
    assert kernel_similarity(found / found.sum(), psf) > 0.97


def test_a_sparser_kernel_has_less_mass() -> None:
    photo = Blurred(blurred(camera_shake(9, 3), 90, 120).astype(np.float32))
    start = np.full((9, 9), 1 / 81)
    free, sparse = (sparse_kernel(photo.plane, photo, start, g) for g in (0.0, 0.1))
    assert sparse.sum() < free.sum()
    assert np.count_nonzero(sparse) <= np.count_nonzero(free)


@pytest.mark.parametrize(("size", "seed"), [(7, 4), (11, 3)])
def test_it_finds_an_asymmetric_psf_and_not_its_mirror_image(size: int, seed: int) -> None:
    truth = camera_shake(size, seed)
    estimate = estimate_psf(blurred(truth, 150, 190), Shan(size=size))
    similarity = kernel_similarity(estimate.psf, truth)
    # A shift of half a pixel alone costs .1: estimates are centered to whole pixels.
    assert similarity > 0.8
    assert similarity > kernel_similarity(estimate.psf, truth[::-1, ::-1]) + 0.02


def test_the_result_is_a_psf_centered_to_a_pixel() -> None:
    psf = estimate_psf(blurred(camera_shake(7, 8), 80, 100), Shan(size=7)).psf
    assert all(side % 2 == 1 for side in psf.shape)
    assert psf.min() >= 0
    assert psf.sum() == pytest.approx(1, abs=1e-12)  # rounding
    centroid = np.array(ndimage.center_of_mass(psf)) - np.array(psf.shape) // 2
    assert np.abs(centroid).max() <= 0.5 + 1e-9


def test_brightness_and_contrast_do_not_matter() -> None:
    photo = blurred(camera_shake(5, 3), 80, 100)
    first, dim = (estimate_psf(p, Shan(size=5)).psf for p in (photo, 0.2 + 0.3 * photo))
    assert kernel_similarity(first, dim) > 0.99  # single precision


def test_clipped_light_is_left_out() -> None:
    truth = camera_shake(7, 4)
    photo = blurred(truth, 120, 150)
    clipped = photo > 0.8
    spoiled = np.where(clipped, 0.8, photo)
    estimate = estimate_psf(spoiled, Shan(size=7), clipped=clipped)
    assert kernel_similarity(estimate.psf, truth) > 0.8


@pytest.mark.parametrize(
    "photo",
    [np.full((90, 110), 0.4), 0.4 + np.random.default_rng(3).normal(0, 0.02, (90, 110))],
    ids=["flat", "noise"],
)
def test_a_featureless_picture_is_refused_with_advice(photo: FloatArray) -> None:
    with pytest.raises(CrfDeblurError, match="choose a region"):
        estimate_psf(photo, Shan(size=9))


def test_a_psf_that_does_not_fit_is_refused_with_advice() -> None:
    with pytest.raises(CrfDeblurError, match="choose a smaller PSF size"):
        estimate_psf(scene(60, 200), Shan(size=21))


@pytest.mark.parametrize(("size", "region"), [(4, 512), (1, 512), (31, 0)])
def test_impossible_sizes_are_refused(size: int, region: int) -> None:
    with pytest.raises(ValueError, match="expected"):
        Shan(size=size, region=region)


def test_progress_rises_to_the_total_and_closing_stops() -> None:
    photo = blurred(camera_shake(5, 4), 60, 70)
    reports: list[Progress] = []
    drain(estimating_psf(photo, Shan(size=5)), reports.append)
    # the steps around the search report, too
    done = [report.done for report in reports if report.total == reports[-1].total]
    assert done == sorted(done)
    assert done[-1] == reports[-1].total
    job = estimating_psf(photo, Shan(size=5))
    next(job)
    job.close()
    with pytest.raises(StopIteration):
        next(job)
