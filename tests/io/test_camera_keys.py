"""Which camera took a photo: what its EXIF data say, and what they do not."""

import re
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import CameraKey, read_camera_key, write_photo

PIXELS = np.arange(15, dtype=np.uint8).reshape(3, 5)
OWN = {
    "Make": "NIKON CORPORATION ",
    "Model": "NIKON D40\0",
    "Software": "Ver.1.11",
    "DateTime": "2020:01:02 03:04:07",
}
DETAIL = {
    "DateTimeOriginal": "2020:01:02 03:04:05",
    "Contrast": 2,
    "Saturation": 0,
    "Sharpness": 1,
    "CustomRendered": 0,
    "ColorSpace": 1,
    "SceneCaptureType": 3,
}
STYLE = (
    "contrast hard, saturation normal, sharpness soft, normal process, sRGB colors, night scene, "
    "software Ver.1.11"
)
NUMBERS = {
    name: number
    for number, name in (
        *((0x000B, "ProcessingSoftware"), (0x010F, "Make"), (0x0110, "Model")),
        *((0x0131, "Software"), (0x0132, "DateTime"), (0x9003, "DateTimeOriginal")),
        *((0xA408, "Contrast"), (0xA409, "Saturation"), (0xA40A, "Sharpness")),
        *((0xA401, "CustomRendered"), (0xA001, "ColorSpace"), (0xA406, "SceneCaptureType")),
    )
}


def exif_of(tags, details=()):
    exif = Image.Exif()
    exif.update({NUMBERS[name]: value for name, value in tags.items() if value is not None})
    for name, value in dict(details).items():
        exif.get_ifd(0x8769)[NUMBERS[name]] = value
    return exif


def key_of(path, tags, details=()):
    Image.fromarray(PIXELS).save(path, exif=exif_of(tags, details))
    return read_camera_key(path)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.JPEG"])
def test_a_photo_says_which_camera_and_how_it_rendered(tmp_path, name):
    key = key_of(tmp_path / name, OWN, DETAIL)
    assert key == CameraKey("NIKON CORPORATION", "NIKON D40", STYLE)
    assert str(key) == f"NIKON D40 ({STYLE})"


def test_a_tiff_says_it_whatever_its_pixels(tmp_path):
    # The block that other files carry is itself a TIFF, here without a picture.
    block = tmp_path / "block.tif"
    block.write_bytes(exif_of(OWN, DETAIL).tobytes()[6:])
    assert read_camera_key(block) == CameraKey("NIKON CORPORATION", "NIKON D40", STYLE)
    floats = np.zeros((4, 3, 3), dtype=np.float32)
    path, tags = tmp_path / "floats.tif", [(271, "s", 0, "Canon", True), (272, "s", 0, "5D", True)]
    tifffile.imwrite(path, floats, photometric="rgb", extratags=tags, software="raw 1")
    assert read_camera_key(path) == CameraKey("Canon", "5D", "software raw 1")


@pytest.mark.parametrize(
    "change",
    [
        {"Contrast": 1},
        {"Saturation": 2},
        {"Sharpness": 0},
        {"CustomRendered": 1},
        {"ColorSpace": 0xFFFF},
        {"SceneCaptureType": 0},
        {"Contrast": 17},
    ],
    ids=str,
)
def test_another_setting_is_another_key(tmp_path, change):
    before, after = (key_of(tmp_path / "a.png", OWN, d) for d in (DETAIL, DETAIL | change))
    assert after != before
    assert (after.maker, after.model) == (before.maker, before.model)
    assert after.file_name != before.file_name


@pytest.mark.parametrize("change", [{"Make": None}, {"Software": "Ver.2.00"}, {"Software": None}])
def test_another_maker_or_firmware_is_another_key(tmp_path, change):
    assert key_of(tmp_path / "a.png", OWN | change) != key_of(tmp_path / "b.png", OWN)


@pytest.mark.parametrize(
    ("tags", "details", "why"),
    [
        ({"Software": "Adobe Photoshop CS4"}, {}, "edited with Adobe Photoshop CS4"),
        ({"Software": "GIMP 2.10.8"}, {}, "edited with GIMP 2.10.8"),
        ({"ProcessingSoftware": "Sharp & Co 3"}, {}, "edited with Sharp & Co 3"),
        ({"DateTime": "2020:02:02 03:04:05"}, {}, "saved again after it was taken"),
        ({"DateTime": "2020:01:02 03:40:05"}, {}, ""),
        ({"DateTime": "2019:01:02 03:04:05"}, {}, ""),
        ({"DateTime": "    :  :     :  :  "}, {}, ""),
        ({"DateTime": None}, {}, ""),
    ],
)
def test_an_edited_picture_is_not_that_of_the_camera(tmp_path, tags, details, why):
    key = key_of(tmp_path / "a.jpg", OWN | tags, DETAIL | details)
    assert key.edited == why
    assert why in str(key)
    assert key.model == "NIKON D40"


@pytest.mark.parametrize("name", ["b.png", "b.jpg"])
def test_a_photo_that_was_written_again_is_not_that_of_the_camera(tmp_path, name):
    before = key_of(tmp_path / "a.jpg", OWN, DETAIL)
    write_photo(tmp_path / name, PIXELS, like=tmp_path / "a.jpg")
    after = read_camera_key(tmp_path / name)
    assert after.edited.startswith("edited with napari-crfdeblur")
    assert (after.name, after.style) == (before.name, before.style)


@pytest.mark.parametrize("tags", [{}, {"Make": "Canon"}, {"Make": "Canon", "Model": " \0 "}])
def test_a_photo_that_does_not_name_its_camera_has_no_key(tmp_path, tags):
    assert key_of(tmp_path / "a.jpg", tags) is None


@pytest.mark.parametrize("cut", [0, 3, 9, 20, 60, 110, 150])
@pytest.mark.parametrize("name", ["a.jpg", "a.tif"])
def test_damaged_data_are_none_or_what_is_left_of_them(tmp_path, name, cut):
    path = tmp_path / name
    key_of(path, OWN, DETAIL)
    path.write_bytes(path.read_bytes()[:cut])
    key = read_camera_key(path)
    assert key is None or key.model == "NIKON D40"[: len(key.model)]


def test_numbers_where_texts_belong_are_passed_over(tmp_path):
    path = tmp_path / "a.tif"
    tags = [(271, "H", 1, 7, True), (272, "s", 0, "5D", True)]
    tifffile.imwrite(path, PIXELS, extratags=tags, software=False)
    assert read_camera_key(path) == CameraKey("", "5D")


def test_what_is_no_file_is_refused(tmp_path):
    with pytest.raises(CrfDeblurError, match="no such file"):
        read_camera_key(tmp_path / "missing.jpg")
    with pytest.raises(CrfDeblurError, match="folder"):
        read_camera_key(tmp_path)
    (tmp_path / "note.txt").write_text("Model: Canon")
    assert read_camera_key(tmp_path / "note.txt") is None


@pytest.mark.parametrize(
    ("key", "name"),
    [
        (CameraKey("Canon", "Canon EOS 5D"), "Canon EOS 5D"),
        (CameraKey("FUJIFILM", "X100"), "FUJIFILM X100"),
        (CameraKey("", "My scanner"), "My scanner"),
    ],
)
def test_a_camera_is_named_as_people_do(key, name):
    assert key.name == str(key) == name


@pytest.mark.parametrize(
    "key",
    [
        CameraKey("Canon", "EOS 5D", STYLE),
        CameraKey("", "../../etc/passwd"),
        CameraKey("", "カメラ"),
        CameraKey("", "a" * 500),
        CameraKey("", "Kodák 12/7: *?"),
    ],
    ids=lambda key: key.model[:20],
)
def test_the_name_of_its_file_is_plain(key):
    assert re.fullmatch(r"[a-z0-9]([a-z0-9-]{0,50})\.json", key.file_name)
    assert Path(key.file_name).name == key.file_name
    assert key.file_name == CameraKey(key.maker, key.model, key.style).file_name


def test_keys_that_read_alike_have_files_of_their_own():
    keys = [
        CameraKey("", "X 100"),
        CameraKey("", "X-100"),
        CameraKey("X", "100"),
        CameraKey("", "X 100", "sRGB colors"),
        CameraKey("", "X 100", "", "sRGB colors"),
    ]
    assert len({key.file_name for key in keys}) == len(keys)


@pytest.mark.parametrize("model", ["", "  "])
def test_a_key_without_a_camera_is_refused(model):
    with pytest.raises(ValueError, match="name of a camera"):
        CameraKey("Canon", model)
