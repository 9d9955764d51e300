"""Edges that are steeper than a PSF permits: never after a blur by it, always in a drawing."""

import numpy as np
import pytest
from leaves import leaves, recorded

from napari_crfdeblur.deconvolution import LocalShrinkage, deconvolve, judge
from napari_crfdeblur.deconvolution.steepness import contradicts
from napari_crfdeblur.psf import as_psf, camera_shake, delta, disk, gaussian, line

PSFS = [camera_shake(15, seed=2), disk(4), line(11, 0.4), gaussian(2.0), delta()]


def drawing():
    """Black strokes on white, a pixel wide and more."""
    rng, light = np.random.default_rng(3), np.ones((140, 180))
    for _ in range(120):
        row, column = int(rng.integers(0, 130)), int(rng.integers(0, 165))
        light[row : row + int(rng.integers(1, 9)), column : column + int(rng.integers(1, 15))] = 0
    return light


@pytest.mark.parametrize("psf", PSFS)
@pytest.mark.parametrize(
    "scene", [drawing(), leaves((140, 180), count=400, smallest=2, lights=(0, 1))]
)
def test_what_was_blurred_by_a_psf_does_not_contradict_it(psf, scene):
    psf = as_psf(psf)
    assert not contradicts(recorded(scene, psf, 0.01, seed=1), psf)


@pytest.mark.parametrize("factor", [0.01, 1.0, 300.0])
@pytest.mark.parametrize("psf", [camera_shake(15, seed=2), disk(4), gaussian(2.0)])
def test_a_sharp_drawing_contradicts_any_blur(psf, factor):
    colors = np.stack([np.full((140, 180), 0.4), drawing()], axis=-1)
    assert contradicts(factor * colors, as_psf(psf))
    assert not contradicts(factor * colors, as_psf(delta()))


def test_a_drawing_comes_back_as_it_was():
    light, psf = drawing().astype(np.float32), as_psf(camera_shake(15, seed=2))
    found = judge(light, deconvolve(light, psf, LocalShrinkage()), psf)
    np.testing.assert_allclose(found.sharp, light, atol=1e-5)
    assert found.trust.kept.max() == 0


def test_nothing_is_said_of_points_on_dark_ground():
    points = np.where(np.random.default_rng(2).random((140, 180)) < 0.1, 1.0, 0.05)
    assert not contradicts(points, as_psf(disk(4)))
    assert contradicts(1 - points, as_psf(disk(4)))


def test_nothing_is_said_of_volumes():
    volume = np.repeat(drawing()[:40, :44][None], 6, axis=0)
    assert contradicts(volume[0], as_psf(np.ones((5, 5))))
    assert not contradicts(volume, as_psf(np.ones((1, 5, 5))))
