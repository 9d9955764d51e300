"""What holds for every method that finds the PSF in the picture."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from blurred_shapes import blurred, scene
from scipy import ndimage

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.progress import Progress, drain
from napari_crfdeblur.psf import (
    Evidence,
    Fergus,
    L0Gradient,
    MinimalPixels,
    Portfolio,
    PsfEstimate,
    PsfEstimator,
    Shan,
    Variational,
    XuJia,
    camera_shake,
    estimate_psf,
    estimating_psf,
)
from napari_crfdeblur.quality import kernel_similarity

METHODS = [Fergus, L0Gradient, MinimalPixels, Portfolio, Shan, Variational, XuJia]
Method = Callable[..., PsfEstimator]

SMALL = blurred(camera_shake(5, 3), 70, 90)

every_method = pytest.mark.parametrize("method", METHODS)


every_shake = pytest.mark.parametrize(
    ("method", "size", "seed", "rows", "columns"),
    [
        (Fergus, 7, 4, 100, 130),
        (Fergus, 11, 3, 100, 130),
        (L0Gradient, 15, 8, 150, 190),
        (L0Gradient, 21, 3, 160, 200),
        (MinimalPixels, 9, 3, 150, 190),
        (MinimalPixels, 21, 3, 160, 200),
        (Portfolio, 9, 3, 100, 130),
        (Portfolio, 21, 3, 160, 200),
        (Shan, 7, 4, 120, 150),
        (Shan, 11, 3, 120, 150),
        (Variational, 9, 3, 100, 130),
        (Variational, 15, 8, 110, 140),
        (XuJia, 5, 4, 150, 190),
        (XuJia, 9, 3, 150, 190),
        (XuJia, 15, 8, 150, 190),
        (XuJia, 21, 3, 160, 200),
    ],
)


@cache
def of_shake(method: Method, size: int, seed: int, rows: int, columns: int) -> FloatArray:
    return estimate_psf(blurred(camera_shake(size, seed), rows, columns), method(size=size)).psf


@every_shake
def test_it_finds_an_asymmetric_psf_and_not_its_mirror_image(
    method: Method, size: int, seed: int, rows: int, columns: int
) -> None:
    truth = camera_shake(size, seed)
    found = of_shake(method, size, seed, rows, columns)
    similarity = kernel_similarity(found, truth)
    # A shift of half a pixel alone costs .1: estimates are centered to whole pixels, and where
    # the sharp picture lies is not known.
    assert similarity > (0.85 if method is XuJia else 0.8)
    assert similarity > kernel_similarity(found, truth[::-1, ::-1]) + 0.02


@every_shake
def test_the_result_is_a_psf_centered_to_a_pixel(
    method: Method, size: int, seed: int, rows: int, columns: int
) -> None:
    psf = of_shake(method, size, seed, rows, columns)
    assert all(side % 2 == 1 for side in psf.shape)
    assert psf.min() >= 0
    assert psf.sum() == pytest.approx(1, abs=1e-12)  # rounding
    centroid = np.array(ndimage.center_of_mass(psf)) - np.array(psf.shape) // 2
    assert np.abs(centroid).max() <= 0.5 + 1e-9


@cache
def of_small(method: Method) -> PsfEstimate:
    return estimate_psf(SMALL, method(size=5))


@every_method
def test_brightness_and_contrast_do_not_matter(method: Method) -> None:
    dim = estimate_psf(0.2 + 0.3 * SMALL, method(size=5)).psf
    # single precision decides which steps count
    assert kernel_similarity(of_small(method).psf, dim) > 0.99


@every_method
def test_the_estimate_repeats_exactly(method: Method) -> None:
    first, second = of_small(method), estimate_psf(SMALL, method(size=5))
    np.testing.assert_array_equal(first.psf, second.psf)
    assert first.diagnostics == second.diagnostics


@every_method
def test_three_equal_channels_are_one(method: Method) -> None:
    color = estimate_psf(np.stack([SMALL] * 3, axis=2), method(size=5)).psf
    # a third of each of three equal numbers is off by rounding
    assert kernel_similarity(color, of_small(method).psf) > 0.999


@every_method
def test_clipped_light_is_left_out(method: Method) -> None:
    truth = camera_shake(7, 4)
    photo = blurred(truth, 100, 130)
    clipped = photo > 0.8
    spoiled = np.where(clipped, 0.8, photo)
    estimate = estimate_psf(Evidence(spoiled, clipped), method(size=7))
    assert kernel_similarity(estimate.psf, truth) > 0.8


@every_method
@pytest.mark.parametrize(
    "photo",
    [
        np.full((90, 110), 0.4),
        0.4 + np.random.default_rng(3).normal(0, 0.02, (90, 110)),
        0.4 + 1e-4 * scene(90, 110),
    ],
    ids=["flat", "noise", "hardly any contrast"],
)
def test_a_featureless_picture_is_refused_with_advice(method: Method, photo: FloatArray) -> None:
    with pytest.raises(CrfDeblurError, match="choose a region"):
        estimate_psf(photo, method(size=9))


@every_method
@pytest.mark.parametrize("shape", [(60, 200), (200, 50)])
def test_a_psf_that_does_not_fit_is_refused_with_advice(
    method: Method, shape: tuple[int, int]
) -> None:
    with pytest.raises(CrfDeblurError, match="choose a smaller PSF size"):
        estimate_psf(scene(*shape), method(size=21))


@every_method
@pytest.mark.parametrize(("size", "region"), [(4, 512), (1, 512), (31, 0)])
def test_impossible_sizes_are_refused(method: Method, size: int, region: int) -> None:
    with pytest.raises(ValueError, match="expected"):
        method(size=size, region=region)


@every_method
def test_progress_rises_to_the_total_and_closing_stops(method: Method) -> None:
    photo = blurred(camera_shake(5, 4), 60, 70)
    reports: list[Progress] = []
    drain(estimating_psf(photo, method(size=5)), reports.append)
    # the steps around the search report, too
    done = [report.done for report in reports if report.total == reports[-1].total]
    assert done == sorted(done)
    assert done[-1] == reports[-1].total
    job = estimating_psf(photo, method(size=5))
    for _ in range(len(reports) // 2):
        next(job)
    job.close()
    with pytest.raises(StopIteration):
        next(job)
