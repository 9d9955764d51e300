"""What the verb and the methods refuse, and in which words."""

import numpy as np
import pytest

from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    RichardsonLucy,
    SparseIrls,
    Wiener,
    deconvolve,
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
        (np.ones((3, 3, 3)), "grayscale"),
        (np.ones(3), "grayscale"),
        (np.ones((0, 3)), "empty"),
    ],
)
def test_a_psf_that_is_none_is_refused(psf, complaint):
    with pytest.raises(CrfDeblurError, match=complaint):
        deconvolve(PLANE, psf, Wiener())


@pytest.mark.parametrize("value", [np.nan, np.inf])
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
    with pytest.raises(ValueError, match="expected at least 1"):
        method(**{field: 0})
