"""Stored cameras: one file for each, whole or not at all, and what is refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import (
    CameraKey,
    CameraRecord,
    CountedPhoto,
    camera_file,
    read_camera,
    read_photo,
    to_record,
    write_camera,
    write_photo,
)
from napari_crfdeblur.response import Gamma, Polynomial, around

KEY = CameraKey("FUJIFILM", "X100", "contrast hard")
PHOTOS = (CountedPhoto("one.jpg", "ab" * 32), CountedPhoto("two.jpg", "cd" * 32))
RECORD = CameraRecord(KEY, around(Polynomial((0.2, 0.1, 0.7)), 0.05), PHOTOS)
PIXELS = np.random.default_rng(4).integers(0, 255, (6, 9, 3), dtype=np.uint8)


@pytest.fixture
def path(tmp_path):
    """The file of a stored camera."""
    write_camera(tmp_path, RECORD)
    return camera_file(tmp_path, KEY)


def test_a_camera_comes_back_as_it_was(path):
    back = read_camera(path.parent, KEY)
    assert (back.key, back.photos) == (KEY, PHOTOS)
    np.testing.assert_array_equal(back.posterior.mean, RECORD.posterior.mean)
    np.testing.assert_array_equal(back.posterior.directions, RECORD.posterior.directions)


def test_the_file_says_in_words_what_it_is(path):
    content = json.loads(path.read_text(encoding="utf-8"))
    assert (content["format"], content["version"]) == ("crfdeblur-camera", 1)
    assert content["camera"]["model"] == "X100"
    assert [photo["name"] for photo in content["photos"]] == ["one.jpg", "two.jpg"]


def test_a_camera_of_which_nothing_is_known_is_none(path):
    assert read_camera(path.parent, CameraKey("FUJIFILM", "X100", "contrast soft")) is None


def test_cameras_are_kept_apart_and_each_is_replaced(path):
    other = replace(RECORD, key=replace(KEY, model="X200"), photos=PHOTOS[:1])
    write_camera(path.parent, other)
    write_camera(path.parent, replace(RECORD, posterior=around(Gamma(2.0))))
    assert len(list(path.parent.iterdir())) == 2
    assert read_camera(path.parent, other.key).photos == PHOTOS[:1]
    changed = read_camera(path.parent, KEY).posterior
    np.testing.assert_array_equal(changed.mean, around(Gamma(2.0)).mean)


def test_a_camera_that_cannot_be_written_leaves_what_was_there(path, monkeypatch):
    before = path.read_bytes()

    def full(*_args, **_options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(CrfDeblurError, match="No space left"):
        write_camera(path.parent, replace(RECORD, photos=PHOTOS[:1]))
    assert [p.name for p in path.parent.iterdir()] == [path.name]
    assert path.read_bytes() == before


def test_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(CrfDeblurError, match="no such folder"):
        read_camera(tmp_path / "missing", KEY)
    with pytest.raises(CrfDeblurError, match="no such folder"):
        write_camera(tmp_path / "missing", RECORD)


@pytest.mark.parametrize("photos", [(), (PHOTOS[0], PHOTOS[0])], ids=["none", "twice"])
def test_photos_count_once_and_there_is_one(photos):
    with pytest.raises(ValueError, match="at least one photo, none twice"):
        replace(RECORD, photos=photos)


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_the_same_pixels_are_the_same_photo(tmp_path, suffix):
    write_photo(tmp_path / f"a{suffix}", PIXELS)
    first = CountedPhoto.of("one", PIXELS)
    again = CountedPhoto.of("two", read_photo(tmp_path / f"a{suffix}"))
    assert first.digest == again.digest
    record = replace(RECORD, photos=(first,))
    assert record.counts(again)


@pytest.mark.parametrize(
    "other",
    [
        PIXELS[::-1],
        PIXELS[:-1],
        PIXELS.reshape(9, 6, 3),
        PIXELS.astype(np.uint16),
        np.where(np.arange(3) == 1, PIXELS ^ 1, PIXELS),
    ],
    ids=["turned", "cut", "reshaped", "16 bits", "changed"],
)
def test_other_pixels_are_another_photo(other):
    record = replace(RECORD, photos=(CountedPhoto.of("one", PIXELS),))
    assert not record.counts(CountedPhoto.of("one", other))


def test_the_digest_does_not_depend_on_how_pixels_lie_in_memory():
    swapped = PIXELS.astype(">u2")
    assert CountedPhoto.of("a", swapped) == CountedPhoto.of("a", PIXELS.astype("<u2"))
    assert CountedPhoto.of("a", np.asfortranarray(PIXELS)) == CountedPhoto.of("a", PIXELS)


def edit(*keys, to):
    """Change one entry of a nested content."""

    def change(content):
        for key in keys[:-1]:
            content = content[key]
        if to is None:
            del content[keys[-1]]
        else:
            content[keys[-1]] = to

    return change


@pytest.mark.parametrize(
    "change",
    [
        edit("format", to="crfdeblur-edges"),
        edit("format", to=None),
        edit("version", to=None),
        edit("version", to="1"),
        edit("version", to=0),
        edit("camera", to=None),
        edit("camera", to="X100"),
        edit("camera", "model", to=""),
        edit("camera", "model", to=None),
        edit("camera", "model", to=5),
        edit("camera", "color", to="red"),
        edit("photos", to=None),
        edit("photos", to=[]),
        edit("photos", to=2),
        edit("photos", 1, to="two.jpg"),
        edit("photos", 1, "digest", to=None),
        edit("photos", 1, "digest", to="ab" * 32),
        edit("photos", 1, "name", to=7),
        edit("posterior", to=None),
        edit("posterior", to=[0.0, 1.0]),
        edit("posterior", to=to_record(Gamma(2.0))),
        edit("posterior", "type", to="Magic"),
        edit("posterior", "mean", to=None),
        edit("posterior", "mean", "data", 7, to=2.0),
        edit("posterior", "mean", "data", 7, to="nan"),
        edit("posterior", "directions", "data", 0, to=[0.0]),
    ],
)
def test_a_damaged_camera_is_refused_with_advice(path, change):
    content = json.loads(path.read_text(encoding="utf-8"))
    change(content)
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(CrfDeblurError, match=r"x100.*\.json: .*damaged \(.*delete it") as refusal:
        read_camera(path.parent, KEY)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "raw", [b"", b"X100", b'{"format": ', b"\xff\xfe\x00", b"[]", b"[" * 99_999]
)
def test_what_is_no_json_object_is_refused(path, raw):
    path.write_bytes(raw)
    with pytest.raises(CrfDeblurError, match="damaged"):
        read_camera(path.parent, KEY)


def test_a_camera_of_a_newer_version_is_refused_and_not_to_be_deleted(path):
    content = {"format": "crfdeblur-camera", "version": 2, "curves": []}
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(CrfDeblurError, match="version 2 are not known; update") as refusal:
        read_camera(path.parent, KEY)
    assert "delete" not in str(refusal.value)


def test_a_file_under_the_name_of_another_camera_is_refused(path):
    other = replace(KEY, model="X200")
    path.rename(camera_file(path.parent, other))
    with pytest.raises(CrfDeblurError, match=r"of another camera, FUJIFILM X100 \(contrast hard\)"):
        read_camera(path.parent, other)


def test_a_folder_in_the_place_of_the_file_is_refused(tmp_path):
    camera_file(tmp_path, KEY).mkdir()
    with pytest.raises(CrfDeblurError, match="folder"):
        read_camera(tmp_path, KEY)
