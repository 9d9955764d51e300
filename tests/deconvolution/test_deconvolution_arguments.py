"""What the verb and the methods refuse, and in which words."""

import numpy as np
import pytest

from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    PlaneStatistics,
    RichardsonLucy,
    SparseIrls,
    Wiener,
    deconvolve,
    measure,
)
from napari_crfdeblur.errors import CrfDeblurError

PLANE = np.random.default_rng(0).random((20, 30))
PSF = np.ones((3, 5))


@pytest.mark.parametrize(
    ("psf", "complaint"),
    [
        (np.ones((21, 3)), "larger than the image"),
        (np.ones((3, 31)), "larger than the image"),
        (np.array([[0.5, -0.1, 0.6]]), "negative"),
        (np.zeros((3, 3)), "zero everywhere"),
        (np.array([[1.0, np.nan]]), "not finite"),
        (np.array([[1.0, np.inf]]), "not finite"),
        (np.ones((9, 8, 3)), "grayscale"),
        (np.ones((9, 10, 4)), "grayscale"),
        (np.ones(3), "grayscale"),
        (np.ones((0, 3)), "empty"),
    ],
)
def test_a_psf_that_is_none_is_refused(psf, complaint):
    with pytest.raises(CrfDeblurError, match=complaint):
        deconvolve(PLANE, psf, Wiener())


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_image_that_is_not_finite_is_refused(value):
    plane = PLANE.copy()
    plane[3, 4] = value
    with pytest.raises(CrfDeblurError, match="not finite"):
        deconvolve(plane, PSF, Wiener())


@pytest.mark.parametrize(
    "image",
    [
        (255 * PLANE).astype(np.uint8),
        PLANE.astype(np.float16),
        PLANE + 0j,
        PLANE[0],
        PLANE[None, None],
        PLANE[:0],
    ],
)
def test_what_is_no_linear_image_is_refused(image):
    with pytest.raises(ValueError, match="expected"):
        deconvolve(image, PSF, Wiener())


@pytest.mark.parametrize("method", [Wiener, SparseIrls, HyperLaplacian])
@pytest.mark.parametrize("weight", [0, -1e-3, np.nan, np.inf])
def test_a_weight_must_be_positive_and_finite(method, weight):
    with pytest.raises(ValueError, match="expected a weight"):
        method(weight=weight)


@pytest.mark.parametrize(
    ("method", "exponent"),
    [(SparseIrls, 0), (SparseIrls, 2), (HyperLaplacian, 0), (HyperLaplacian, 1)],
)
def test_an_exponent_must_be_in_its_range(method, exponent):
    with pytest.raises(ValueError, match="expected an exponent"):
        method(exponent=exponent)


@pytest.mark.parametrize(
    ("method", "field"),
    [
        (RichardsonLucy, "iterations"),
        (SparseIrls, "iterations"),
        (SparseIrls, "steps"),
        (HyperLaplacian, "stages"),
        (HyperLaplacian, "steps"),
    ],
)
def test_there_must_be_work_to_do(method, field):
    with pytest.raises(ValueError, match="at least 1"):
        method(**{field: 0})


@pytest.mark.parametrize("values", [(-1e-3, 1), (np.nan, 1), (np.inf, 1), (0.1, 0), (0.1, np.inf)])
def test_statistics_must_be_possible(values):
    with pytest.raises(ValueError, match="expected a finite"):
        PlaneStatistics(*values)


@pytest.mark.parametrize(
    "method", [Wiener(model_error=0), SparseIrls(model_error=0), HyperLaplacian(model_error=0)]
)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_without_any_noise_the_rounding_counts_as_noise(method, dtype):
    # columns of a staircase: no detail that could be taken for noise
    plane = np.tile(np.linspace(0, 1, 40, dtype=dtype), (30, 1))
    assert measure(plane).noise < 1e-6
    assert np.isfinite(deconvolve(plane, PSF, method)).all()
    assert np.isfinite(deconvolve(np.zeros_like(plane), PSF, method)).all()


@pytest.mark.parametrize("method", [Wiener(), RichardsonLucy(), SparseIrls(), HyperLaplacian()])
@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (1, 1), (2, 2)])
def test_pictures_of_a_row_a_column_or_a_pixel_are_restored(method, shape):
    plane = np.random.default_rng(1).random(shape)
    psf = np.ones(tuple(min(side, 3) for side in shape)) if max(shape) > 2 else np.ones((1, 1))
    restored = deconvolve(plane, psf, method)
    assert restored.shape == shape
    assert np.isfinite(restored).all()


@pytest.mark.parametrize("method", [Wiener(), RichardsonLucy(), SparseIrls(), HyperLaplacian()])
def test_a_psf_off_its_center_shifts_the_picture_back(method):
    rows, columns = np.mgrid[:60, :70]
    scene = 0.5 + 0.3 * np.sin(rows / 5) * np.cos(columns / 6)
    psf = np.zeros((9, 7))
    psf[1, 5] = 1  # three rows up, two columns to the right
    restored = deconvolve(np.roll(scene, (-3, 2), (0, 1)), psf, method)
    np.testing.assert_allclose(restored[12:-12, 12:-12], scene[12:-12, 12:-12], atol=0.02)


@pytest.mark.parametrize("method", [Wiener(), RichardsonLucy(), SparseIrls(), HyperLaplacian()])
def test_a_psf_with_all_its_light_in_a_corner_blows_nothing_up(method):
    psf = np.zeros((9, 7))
    psf[0, 0] = 1
    restored = deconvolve(PLANE, psf, method)
    assert np.isfinite(restored).all()
    assert np.abs(restored).max() < 10
