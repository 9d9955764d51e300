"""Pictures continued beyond their frame."""

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur.boundary import extend, periodic_shape

PSF = np.outer(np.arange(1, 8), np.arange(9, 4, -1)) / 28 / 35


def picture(shape: tuple[int, int], seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=shape)
    sharp = (ndimage.gaussian_filter(noise, 4, mode="wrap") > 0).astype(float)
    return ndimage.convolve(sharp, PSF, mode="wrap")


@pytest.mark.parametrize("shape", [(40, 51), (200, 170), (30, 300), (7, 5), (1, 9)])
def test_the_plane_itself_is_kept_and_the_gap_holds_a_psf(shape):
    plane = picture(shape).astype(np.float32)
    extended = extend(plane, PSF)
    assert extended.shape == periodic_shape(shape, PSF.shape)
    assert extended.shape[0] >= shape[0] + 6
    assert extended.shape[1] >= shape[1] + 4
    assert extended.dtype == plane.dtype
    np.testing.assert_array_equal(extended[: shape[0], : shape[1]], plane)
    assert np.isfinite(extended).all()


def test_a_psf_of_one_pixel_on_a_fast_size_leaves_nothing_to_fill():
    plane = picture((48, 60))
    np.testing.assert_array_equal(extend(plane, np.ones((1, 1))), plane)


@pytest.mark.parametrize("value", [0.0, 0.4])
def test_a_constant_is_continued_as_itself(value):
    extended = extend(np.full((100, 90), value, dtype=np.float32), PSF)
    np.testing.assert_allclose(extended, value, atol=1e-6)


@pytest.mark.parametrize("shape", [(54, 68), (234, 196)])
def test_a_periodic_blurred_picture_is_nearly_recovered(shape):
    # the gap is one PSF side, and is known from both sides: blurred, it has no fine detail
    rows, columns = periodic_shape(shape, PSF.shape)
    whole = picture((rows, columns), seed=1)
    extended = extend(whole[: shape[0], : shape[1]], PSF)
    error = np.sqrt(np.mean((extended - whole)[shape[0] :, :] ** 2))
    reflected = np.pad(whole[: shape[0]], [(0, rows - shape[0]), (0, 0)], mode="reflect")
    assert error < 0.5 * np.sqrt(np.mean((reflected - whole)[shape[0] :] ** 2))


def test_bands_give_what_the_whole_picture_gives(monkeypatch):
    plane = picture((160, 171), seed=2)[:150, :160]
    bands = extend(plane, PSF)
    monkeypatch.setattr("napari_crfdeblur.boundary.REACH", 1000)
    # what is cut off is REACH PSF sides away; the corners of the gap belong to two bands
    assert np.sqrt(np.mean((bands - extend(plane, PSF)) ** 2)) < 0.01


def test_units_do_not_matter():
    plane = picture((80, 70), seed=3)
    np.testing.assert_allclose(
        extend(1000 * plane + 50, PSF), 1000 * extend(plane, PSF) + 50, atol=2
    )
