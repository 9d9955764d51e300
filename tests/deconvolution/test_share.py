"""The share of light that is recorded: what the mirrored PSF makes of the frame."""

import numpy as np
import pytest

from napari_crfdeblur.boundary import frame, periodic_shape
from napari_crfdeblur.deconvolution.share import LEAST_SEEN, share_inside, share_of
from napari_crfdeblur.fourier import correlate, otf
from napari_crfdeblur.progress import Progress, drain
from napari_crfdeblur.psf import as_psf

CASES = [
    ((40, 55), (7, 5)),
    ((20, 31), (19, 31)),
    ((9, 30), (9, 1)),
    ((1, 30), (1, 5)),
    ((12, 13, 14), (3, 5, 7)),
]


def one_over(seen):
    return np.where(seen < LEAST_SEEN, 0, 1 / np.maximum(seen, LEAST_SEEN))


@pytest.mark.parametrize(("shape", "sides"), CASES)
def test_it_is_the_frame_seen_through_the_mirrored_psf(shape, sides):
    psf = as_psf(np.random.default_rng(0).random(sides))
    period = periodic_shape(shape, psf.shape)
    recorded = np.zeros(period)
    recorded[frame(shape)] = 1
    expected = one_over(correlate(recorded, otf(psf, period, np.float64)))
    found = share_inside(psf, np.zeros(shape))
    # rounding of transforms, over the least share
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert share_inside(psf, np.zeros(shape, np.float32)).dtype == np.float32


@pytest.mark.parametrize(("shape", "sides"), CASES)
def test_without_pixels_less_is_seen(shape, sides):
    rng = np.random.default_rng(1)
    psf, free = as_psf(rng.random(sides)), rng.random(shape) < 0.2
    period = periodic_shape(shape, psf.shape)
    transfer = otf(psf, period, np.float64)

    def without(pixels):
        at = Progress("share", 0, 1)
        return drain(share_of(1.0 * ~pixels, transfer, period, at))

    some, none = without(free), without(np.zeros_like(free))
    np.testing.assert_allclose(none, share_inside(psf, np.zeros(shape)), atol=1e-9)
    seen = (some > 0) & (none > 0)
    assert (some[seen] > (1 - 1e-9) * none[seen]).all()
    assert some[seen].mean() > 1.1 * none[seen].mean()
