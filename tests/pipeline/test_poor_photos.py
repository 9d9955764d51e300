"""Photos that cannot be deblurred: they come back nearly as they were, or a sentence says why."""

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.pipeline import DeblurOptions, deblur
from napari_crfdeblur.psf import GivenPsf, XuJia
from napari_crfdeblur.response import SRGB

SHAPE = (200, 260)
SRGB_KNOWN = GivenResponse(SRGB())


def coded(intensity):
    return np.rint(255 * np.clip(intensity, 0, 1)).astype(np.uint8)


def rng():
    return np.random.default_rng(4)


def sky():
    rows = np.linspace(0.45, 0.75, SHAPE[0])[:, None]
    return coded(rows + rng().normal(0, 0.006, SHAPE))


def drawing():
    """Even areas with black outlines, without any noise."""
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    picture = np.full(SHAPE, 0.7)
    for light in rng().uniform(0.1, 0.95, 14):
        row, column = rng().uniform(0, 1, 2) * SHAPE * light
        distance = np.hypot(rows - row, columns - column) - 60 * light
        picture[distance < 0] = light
        picture[np.abs(distance) < 1.5] = 0
    return coded(picture)


def moire():
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return coded(0.5 + 0.4 * np.sin(((rows - 90) ** 2 + (columns - 140) ** 2) / 250))


def sharpened():
    """With halos, as cameras and programs make them."""
    grain = ndimage.gaussian_filter(rng().random(SHAPE), 3)
    steps = np.where(grain > np.median(grain), 0.75, 0.25)
    soft = ndimage.gaussian_filter(steps, 1.5)
    return coded(soft + 2 * (soft - ndimage.gaussian_filter(soft, 2)))


@pytest.mark.parametrize("photo", [sky(), drawing(), moire()], ids=["sky", "drawing", "moire"])
def test_what_is_not_blurred_comes_back_nearly_as_it_was(photo):
    found = deblur(photo, DeblurOptions(SRGB_KNOWN, psf=XuJia(size=15)))
    change = found.photo.astype(float) - photo
    assert np.sqrt(np.mean(change**2)) < 0.03 * 255


@pytest.mark.parametrize("psf", [ndimage.gaussian_filter(np.eye(15), 1), np.ones((1, 21))])
def test_a_picture_that_was_sharpened_or_blurred_otherwise_is_hardly_made_worse(psf):
    photo = sharpened()
    found = deblur(photo, DeblurOptions(SRGB_KNOWN, psf=GivenPsf(psf)))
    assert np.sqrt(np.mean((found.photo.astype(float) - photo) ** 2)) < 0.05 * 255
    assert found.trust.kept.mean() < 0.3


def test_nothing_but_noise_is_refused():
    with pytest.raises(CrfDeblurError, match="too little structure"):
        deblur(coded(rng().normal(0.5, 0.12, SHAPE)), DeblurOptions(SRGB_KNOWN))


def test_a_photo_that_is_nearly_all_saturated_is_refused():
    photo = np.full(SHAPE, 255, np.uint8)
    photo[90:110, 100:130] = drawing()[90:110, 100:130]
    with pytest.raises(CrfDeblurError, match="shorter exposure"):
        deblur(photo)


def test_a_photo_without_blur_is_told_so():
    found = deblur(drawing(), DeblurOptions(SRGB_KNOWN, psf=GivenPsf(np.ones((1, 1)))))
    assert found.psf.sentence.endswith("the photo is hardly blurred")
    np.testing.assert_allclose(found.photo.astype(int), drawing(), atol=8)
