"""Transfer functions that are kept: the same as those computed anew, whatever came before."""

import numpy as np
import pytest

from napari_crfdeblur import fourier
from napari_crfdeblur.fourier import kept_otf, otf


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize(
    ("psf_shape", "shape"), [((5, 3), (20, 30)), ((3, 5), (20, 30)), ((3, 3, 5), (8, 9, 10))]
)
def test_a_kept_transfer_function_is_that_of_its_own_psf(psf_shape, shape, precision):
    plane = np.zeros(shape, precision)
    for seed in (0, 1, 0):
        psf = np.random.default_rng(seed).random(psf_shape)
        # of another order in memory, too
        for each in (psf, np.asfortranarray(psf)):
            found = kept_otf(each, shape, plane)
            expected = otf(each, shape, plane)
            assert found.dtype == expected.dtype
            np.testing.assert_array_equal(found, expected)


def test_tiles_of_one_shape_share_it_and_cannot_change_it():
    plane, psf = np.zeros((40, 50), np.float32), np.ones((3, 5))
    first = kept_otf(psf, plane.shape, plane)
    assert kept_otf(psf.copy(), plane.shape, plane) is first
    with pytest.raises(ValueError, match="read-only"):
        first *= 2


def test_that_of_a_large_picture_is_not_kept(monkeypatch):
    monkeypatch.setattr(fourier, "LARGEST_KEPT", 100)
    plane, psf = np.zeros((40, 50), np.float32), np.ones((3, 5))
    first = kept_otf(psf, plane.shape, plane)
    assert kept_otf(psf, plane.shape, plane) is not first
