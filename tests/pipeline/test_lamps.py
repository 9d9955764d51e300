"""Lamps are brighter than white; the white ground of a text is not."""

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur.deconvolution import LocalShrinkage, deconvolve
from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.pipeline import DeblurOptions, Intermediates, deblur
from napari_crfdeblur.psf import GivenPsf, as_psf, kernel_a
from napari_crfdeblur.response import SRGB, clipped_light

PSF = as_psf(kernel_a())


def text():
    """Black strokes on paper that is just white, in linear light."""
    rng, light = np.random.default_rng(3), np.ones((150, 200))
    for _ in range(60):
        row, column = int(rng.integers(0, 140)), int(rng.integers(0, 180))
        height, width = (3, 18) if rng.random() < 0.5 else (14, 3)
        light[row : row + height, column : column + width] = 0.02
    return light


def photographed(light, seed=1):
    seen = ndimage.convolve(light, PSF, mode="reflect")
    noise = np.random.default_rng(seed).normal(0, 0.004, light.shape)
    return np.rint(255 * (SRGB().to_intensity(seen.clip(0, 1)) + noise).clip(0, 1)).astype(np.uint8)


def test_what_is_white_in_most_of_a_channel_is_no_lamp():
    paper = photographed(text())
    night = np.full((150, 200), 40, np.uint8)
    night[60:70, 80:100] = 255
    colors = np.stack([paper, night, paper], axis=-1)
    lamps = Intermediates(colors).lamps
    assert clipped_light(paper).mean() > 0.4
    assert not lamps[..., [0, 2]].any()
    np.testing.assert_array_equal(lamps[..., 1], clipped_light(night))


def test_text_on_white_is_restored_as_what_it_is():
    light = text()
    photo = photographed(light)
    options = DeblurOptions(GivenResponse(SRGB()), psf=GivenPsf(PSF), method=LocalShrinkage())
    found = deblur(photo, options)
    taken_for_lamps = deconvolve(found.linear, PSF, LocalShrinkage(), clipped=clipped_light(photo))
    error, other = (
        np.sqrt(np.mean((each.clip(0, 1) - light)[10:-10, 10:-10] ** 2))
        for each in (found.sharp_linear, taken_for_lamps)
    )
    assert error < 0.7 * other
    assert found.trust.kept.mean() == pytest.approx(1, abs=0.02)
