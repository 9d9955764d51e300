"""What ranks PSFs: the right one is more plausible than wrong ones, whatever the light."""

import numpy as np
import pytest
from blurred_shapes import blurred
from scipy import ndimage

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.psf import camera_shake, delta, disk, line
from napari_crfdeblur.psf.base import as_psf
from napari_crfdeblur.psf.blind.blurred import Blurred
from napari_crfdeblur.psf.blind.plausibility import Plausibility
from napari_crfdeblur.psf.blind.small_photo import psf_scaled

SHAKES = [camera_shake(15, 8), camera_shake(21, 3), camera_shake(13, 5)]
PSFS = [*SHAKES, line(13, 0.6), disk(4.5)]

every_psf = pytest.mark.parametrize("truth", PSFS, ids=range(len(PSFS)))


def judge(photo: FloatArray) -> Plausibility:
    return Plausibility.of(Blurred.of(photo.astype(np.float32), None, 21), 21)


def shorter(psf: FloatArray) -> FloatArray:
    return as_psf(np.maximum(ndimage.zoom(psf, 0.6, order=1), 0))


@every_psf
def test_the_right_psf_is_more_plausible_than_none_or_a_part_of_it(truth: FloatArray) -> None:
    of = judge(blurred(truth, 170, 220))
    right = of.judge(truth)
    for wrong in (delta(), np.full((3, 3), 1 / 9), shorter(truth)):
        assert of.judge(wrong) < right - 0.02


@pytest.mark.parametrize("truth", SHAKES, ids=range(len(SHAKES)))
def test_the_right_psf_is_more_plausible_than_its_mirror_image(truth: FloatArray) -> None:
    of = judge(blurred(truth, 170, 220))
    assert of.judge(truth[::-1, ::-1]) < of.judge(truth) - 0.02


def test_where_a_psf_lies_hardly_matters() -> None:
    truth = camera_shake(15, 8)
    of = judge(blurred(truth, 170, 220))
    moved = np.pad(truth, [(0, 4), (6, 0)])
    # what comes in at the border differs
    assert of.judge(moved) == pytest.approx(of.judge(truth), abs=0.01)


def test_brightness_and_contrast_do_not_matter() -> None:
    truth = camera_shake(15, 8)
    photo = blurred(truth, 130, 160)
    bright, dim = judge(photo), judge(0.2 + 0.3 * photo)
    for psf in (truth, delta()):
        # single precision; the likelihood of a spectrum is that of its unit, which contrast sets
        assert dim.sparsity(psf) == pytest.approx(bright.sparsity(psf), rel=1e-3)


def test_what_lies_near_clipped_light_does_not_count() -> None:
    truth = camera_shake(13, 5)
    photo = blurred(truth, 170, 220)
    spoiled, clipped = photo.copy(), np.zeros(photo.shape, bool)
    clipped[60:64, 90:96] = True
    spoiled[clipped] = 30.0
    seen = Blurred.of(spoiled.astype(np.float32), clipped, 13)
    with_mask = Plausibility.of(seen, 13)
    assert not with_mask.seen[56:68, 86:100].any()
    assert with_mask.seen[120:140, 150:200].all()


@pytest.mark.parametrize("scale", [0.3, 0.5, 0.75, 1.0, 1.6, 3.0])
@every_psf
def test_a_psf_at_another_scale_keeps_its_mass_center_and_shape(
    truth: FloatArray, scale: float
) -> None:
    small = psf_scaled(truth, scale)
    assert small.sum() == pytest.approx(1, abs=1e-12)
    assert small.min() >= 0
    assert all(side % 2 == 1 for side in small.shape)
    off, before = (
        np.array(ndimage.center_of_mass(p)) - np.array(p.shape) // 2 for p in (small, truth)
    )
    # paths are a pixel wide, so that samples of them miss some of the light
    np.testing.assert_allclose(off, scale * before, atol=0.25 * max(scale, 1))
    back = psf_scaled(small, 1 / scale)
    spread = [np.sqrt(np.square(coordinates(p)).T @ p.ravel()) for p in (truth, back)]
    np.testing.assert_allclose(spread[1], spread[0], atol=max(1 / scale, 1))


def coordinates(psf: FloatArray) -> FloatArray:
    """Rows and columns from the center of mass, shape (N, 2)."""
    places = np.argwhere(np.ones(psf.shape)).astype(float)
    return np.asarray(places - np.average(places, axis=0, weights=psf.ravel()))
