"""Saturated pixels: found by their values, and by the shape of the lights."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image as Pillow
from scipy import ndimage

from napari_crfdeblur.response import clipped_light, clipped_pixels


def lamps(shape=(120, 160), seed=3):
    """Light of a blurred night scene, its lamps up to thirty times as bright as white."""
    rng = np.random.default_rng(seed)
    scene = rng.uniform(0.05, 0.4, shape)
    for _ in range(12):
        row, column = (int(rng.integers(12, side - 12)) for side in shape)
        scene[row - 2 : row + 2, column - 3 : column + 3] = 30
    return ndimage.gaussian_filter(scene, 2.0)


def recorded(light):
    return np.rint(255 * light.clip(0, 1) ** (1 / 2.2)).astype(np.uint8)


def resized(light):
    """Clipped by the camera, and then made half as large, and compressed."""
    large = recorded(ndimage.zoom(light, 2, order=1, grid_mode=True, mode="nearest"))
    rows, columns = light.shape
    small = large.reshape(rows, 2, columns, 2).mean(axis=(1, 3))
    file = BytesIO()
    Pillow.fromarray(np.rint(small).astype(np.uint8)).save(file, "JPEG", quality=90)
    return np.asarray(Pillow.open(BytesIO(file.getvalue())))


def test_without_anything_after_the_camera_only_the_top_is_clipped():
    photo = recorded(lamps())
    np.testing.assert_array_equal(clipped_light(photo), clipped_pixels(photo))
    assert clipped_light(photo).any()


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_after_a_resize_the_rims_of_the_lights_are_found(seed):
    light = lamps(seed=seed)
    photo, saturated = resized(light), light >= 1
    found, by_value = clipped_light(photo), clipped_pixels(photo)
    assert (saturated & by_value).sum() < 0.95 * saturated.sum()
    assert (saturated & found).sum() > 0.99 * saturated.sum()
    # nothing but their rims
    assert not (found & ~ndimage.binary_dilation(saturated, iterations=2)).any()


def test_each_channel_by_its_own_shape():
    light = lamps()
    photo = np.stack([recorded(light), resized(light), recorded(0.01 * light)], axis=-1)
    found = clipped_light(photo)
    for channel in range(3):
        np.testing.assert_array_equal(found[..., channel], clipped_light(photo[..., channel]))
    assert found[..., 1].sum() > found[..., 0].sum()
    assert not found[..., 2].any()


def test_the_rims_of_a_slice_stay_in_it():
    light = lamps()
    volume = np.stack([recorded(0.01 * light), resized(light), recorded(0.01 * light)])
    found = clipped_light(volume, axes=3)
    assert not found[[0, 2]].any()
    np.testing.assert_array_equal(found[1], clipped_light(volume[1]))


@pytest.mark.parametrize("dtype", [np.uint16, np.float32, np.float64])
def test_the_kind_of_number_does_not_matter(dtype):
    photo = resized(lamps())
    whole = photo.astype(dtype) * dtype(257) if dtype == np.uint16 else photo.astype(dtype) / 255
    np.testing.assert_array_equal(clipped_light(whole), clipped_light(photo))


def test_what_is_no_photo_is_refused():
    with pytest.raises(ValueError, match="axes"):
        clipped_light(np.zeros((4, 4)), axes=1)
    with pytest.raises(ValueError, match="photo or volume"):
        clipped_light(np.zeros(4))
