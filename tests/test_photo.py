"""Photos of every kind: to unit intensity and back, and what is refused."""

import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.photo import (
    check_image,
    check_photo,
    color,
    from_unit,
    full_scale,
    luminance,
    planes,
    to_unit,
)

KINDS = [np.uint8, np.uint16, np.float16, np.float32, np.float64]


def a_photo(dtype, shape=(11, 17, 3)):
    unit = np.random.default_rng(3).random(shape)
    return from_unit(unit, dtype)


@pytest.mark.parametrize("dtype", KINDS)
def test_unit_intensity_comes_back_as_the_same_photo(dtype):
    photo = a_photo(dtype)
    np.testing.assert_array_equal(from_unit(to_unit(photo), dtype), photo)
    assert from_unit(to_unit(photo), dtype).dtype == dtype


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_every_code_comes_back(dtype):
    codes = np.arange(np.iinfo(dtype).max + 1, dtype=dtype).reshape(-1, 64)
    np.testing.assert_array_equal(from_unit(to_unit(codes), dtype), codes)


@pytest.mark.parametrize("dtype", KINDS)
def test_full_scale_is_intensity_one(dtype):
    white = np.full((9, 8), full_scale(np.zeros(1, dtype)), dtype=dtype)
    np.testing.assert_array_equal(to_unit(white), 1)


@pytest.mark.parametrize(("dtype", "unit"), [(np.uint8, np.float32), (np.float64, np.float64)])
def test_only_float64_is_worked_on_in_float64(dtype, unit):
    assert to_unit(a_photo(dtype)).dtype == unit


def test_intensity_outside_the_range_is_clipped():
    wild = np.array([[-0.2, 0.5, 1.7]])
    np.testing.assert_array_equal(from_unit(wild, np.uint8), [[0, 128, 255]])
    np.testing.assert_array_equal(wild, [[-0.2, 0.5, 1.7]])


def test_alpha_is_no_color():
    photo = a_photo(np.uint8, (11, 17, 4))
    assert color(photo).shape == (11, 17, 3)
    assert len(planes(photo)) == 3
    np.testing.assert_allclose(luminance(photo), photo[..., :3].mean(axis=2) / 255, atol=1e-6)


def test_gray_photo_has_one_plane_and_is_its_luminance():
    photo = a_photo(np.uint16, (11, 17))
    assert len(planes(photo)) == 1
    np.testing.assert_array_equal(luminance(photo), to_unit(photo))


@pytest.mark.parametrize("dtype", KINDS)
@pytest.mark.parametrize("shape", [(11, 17), (8, 9, 3), (11, 8, 4)])
def test_photos_are_accepted(dtype, shape):
    check_photo(a_photo(dtype, shape))


@pytest.mark.parametrize(
    "image",
    [
        np.zeros(9),
        np.zeros((9, 9, 2)),
        np.zeros((9, 9, 3, 1)),
        np.zeros((9, 9), dtype=int),
        np.zeros((9, 9), dtype=bool),
        np.zeros((9, 9), dtype=complex),
    ],
)
def test_what_is_no_image_is_a_value_error(image):
    with pytest.raises(ValueError, match=r"expected .* got"):
        check_image(image)


@pytest.mark.parametrize(
    ("photo", "advice"),
    [
        (a_photo(np.uint8, (7, 30)), "at least 8 x 8"),
        (np.full((9, 9), np.nan), "replace them"),
        (np.full((9, 9, 3), np.inf), "replace them"),
        (np.full((9, 9), 255, dtype=np.uint8), "shorter exposure"),
        (np.full((9, 9), 7, dtype=np.uint16), "shows something"),
        (a_photo(np.float32) * 200, "full scale"),
        (a_photo(np.float32) - 0.5, "full scale"),
    ],
)
def test_a_photo_without_content_is_refused_with_advice(photo, advice):
    with pytest.raises(CrfDeblurError, match=advice):
        check_photo(photo)


def test_alpha_does_not_make_a_constant_photo_pass():
    photo = np.full((9, 9, 4), 7, dtype=np.uint8)
    photo[0, 0, 3] = 255
    with pytest.raises(CrfDeblurError, match="constant"):
        check_photo(photo)
