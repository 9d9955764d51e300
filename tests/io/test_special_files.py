"""Names and files that are none: pipes, devices, loops, folders, names that no file can have."""

import os
import socket
import sys

import numpy as np
import pytest
from hostile import read_or_refused
from test_cameras import KEY, RECORD
from test_edges import FOUND

from napari_crfdeblur.batch.journal import NAME, Journal
from napari_crfdeblur.errors import CrfDeblurError, in_words
from napari_crfdeblur.io import (
    CameraKey,
    camera_file,
    inputs,
    read_camera,
    read_camera_key,
    read_edges,
    read_photo,
    read_psf,
    read_responses,
    write_camera,
    write_edges,
    write_photo,
)
from napari_crfdeblur.io.inputs import open_input, read_bytes
from napari_crfdeblur.large import open_source
from napari_crfdeblur.texts import LONGEST, brief, printable

READERS = [read_photo, read_psf, read_responses, read_edges, read_camera_key, open_source]
PHOTO = np.random.default_rng(6).integers(0, 255, (9, 14, 3), dtype=np.uint8)
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")
ESCAPE, TURN, BYTE = "\x1b[31m", "\u202e", "\udcff"


def special(folder, ending):
    """Paths that are no files, though some of them exist."""
    os.mkfifo(folder / f"pipe{ending}")
    (folder / f"loop{ending}").symlink_to(folder / f"loop{ending}")
    (folder / f"one{ending}").symlink_to(folder / f"two{ending}")
    (folder / f"two{ending}").symlink_to(folder / f"one{ending}")
    (folder / f"lost{ending}").symlink_to(folder / f"nowhere{ending}")
    (folder / f"device{ending}").symlink_to("/dev/zero")
    (folder / f"folder{ending}").mkdir()
    found = sorted(folder.iterdir())
    (folder / f"file{ending}").write_bytes(b"text")
    names = [f"file{ending}/inside", "missing", "x" * 300, "nul\0", f"{ESCAPE}{TURN}{BYTE}"]
    names += ["\ud800", "line\nbreak", "x/" * 3000]
    return [*found, *(folder / f"{name}{ending}" for name in names)]


@POSIX
@pytest.mark.parametrize("ending", [".png", ".npy", ".json", ".tif"])
def test_what_is_no_file_is_refused_at_once_by_every_reader(tmp_path, ending):
    for path in special(tmp_path, ending):
        for read in READERS:
            with pytest.raises(CrfDeblurError) as refused:
                read(path)
            assert str(refused.value).isprintable()


@POSIX
def test_a_socket_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("a.png")
        with pytest.raises(CrfDeblurError, match="not a file"):
            read_photo(tmp_path / "a.png")


@POSIX
def test_a_pipe_that_takes_the_place_of_a_file_keeps_nobody_waiting(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    os.mkfifo(path)
    monkeypatch.setattr(inputs, "check_input", lambda _: None)  # as it was a moment ago
    with pytest.raises(CrfDeblurError, match="a pipe or a device"), open_input(path):
        pass


def test_a_file_that_vanishes_or_is_locked_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(inputs, "check_input", lambda _: None)
    assert read_or_refused(lambda path: read_bytes(path, 9), tmp_path / "a.json") is None


def test_a_file_that_grows_while_it_is_read_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    path.write_bytes(b"1" * 100)
    monkeypatch.setattr(inputs, "size_of", lambda _: 10)
    assert read_bytes(path, 100) == b"1" * 100
    with pytest.raises(CrfDeblurError, match="larger than"):
        read_bytes(path, 99)


@POSIX
def test_a_camera_or_a_journal_that_is_no_file_is_refused(tmp_path):
    os.mkfifo(camera_file(tmp_path, KEY))
    with pytest.raises(CrfDeblurError, match="not a file"):
        read_camera(tmp_path, KEY)
    (tmp_path / NAME).symlink_to("/dev/zero")
    with pytest.raises(CrfDeblurError, match="not a file"):
        Journal.of(tmp_path)


def test_names_with_marks_of_control_are_printed_as_codes(tmp_path):
    said = str(CrfDeblurError(f"{tmp_path}/{ESCAPE}{TURN}{BYTE}\n.png: there is no such file"))
    assert said.endswith(r"/\x1b[31m\u202e\udcff\n.png: there is no such file")
    assert in_words(ValueError("a\r\tb")) == r"a\r\tb"
    assert (
        in_words(OSError(2, "No\nfile", "a\x7f")) == r"a\x7f: No\nfile; check the file and the disk"
    )


@pytest.mark.parametrize(
    "text", ["", "plain", "Größe 5 µm", "写真.png", "a\u202fb\u00a0c", "\\x1b"]
)
def test_texts_that_can_be_printed_stay_as_they_are(text):
    assert printable(text) == text
    assert printable(printable(f"{text}\x00")) == printable(f"{text}\x00")


def test_what_libraries_say_is_cut_to_a_line():
    assert brief(ValueError("x" * 10**6)) == "x" * LONGEST + "..."
    assert brief("a\nb") == r"a\nb"
    assert brief(None) == "None"


HOSTILE_TEXTS = [
    "../../../etc/passwd",
    "..\\..\\evil",
    "/absolute",
    "C:\\con",
    "con",
    "NUL",
    "COM1.",
    "a\x1b[2Jb",
    "\u202eexe",
    "name\nwith\rlines",
    "\x00\x01\x02",
    "x" * 5000,
    "写真機",
    "\ud800",
    "😀" * 300,
    ".",
    "-rf",
    "~",
    "a:stream",
]


@pytest.mark.parametrize("text", HOSTILE_TEXTS, ids=ascii)
def test_a_file_of_a_camera_stays_in_its_folder_whatever_its_name(tmp_path, text):
    for key in (CameraKey("", f"m{text}"), CameraKey(text, text or "m", text, text)):
        path = camera_file(tmp_path, key)
        assert path.resolve().parent == tmp_path.resolve()
        assert path.name.isascii()
        assert path.name.isprintable()
        assert len(path.name) < 100
        assert path.name.split(".")[0].lower() not in ("con", "nul", "aux", "prn", "com1", "lpt1")
        assert not path.name.startswith((".", "-"))
        assert str(key).isprintable() or "\u202f" in str(key)
    if text.strip():
        write_camera(tmp_path, type(RECORD)(key, RECORD.posterior, RECORD.photos))
        assert read_camera(tmp_path, key).key == key


def test_files_of_cameras_keep_their_names():
    known = CameraKey("NIKON CORPORATION", "NIKON D40", "contrast hard, software Ver.1.11", "")
    assert known.file_name == "nikon-d40-5f87071ba2.json"
    assert CameraKey("", "Größe 7").file_name == "groe-7-6f90b29f5d.json"


@pytest.mark.parametrize("text", HOSTILE_TEXTS, ids=ascii)
def test_texts_of_a_photo_are_fit_for_a_sentence(tmp_path, text):
    from PIL import Image as Pillow

    exif = Pillow.Exif()
    raw = text.encode("utf-8", "surrogatepass").decode("latin1")
    exif[271], exif[272], exif[305] = raw[:3000], f"model {raw[:3000]}", raw[:3000]
    Pillow.fromarray(PHOTO).save(tmp_path / "a.jpg", exif=exif)
    key = read_camera_key(tmp_path / "a.jpg")
    assert key is None or str(key).isprintable()
    assert key is None or len(str(key)) < 3000


def test_damaged_camera_data_of_a_photo_are_left_out_of_the_result(tmp_path):
    from PIL import Image as Pillow

    exif = Pillow.Exif()
    exif[271], exif[272] = "Maker", "x" * 3000
    Pillow.fromarray(PHOTO).save(tmp_path / "a.jpg", exif=exif)
    whole, rng = (tmp_path / "a.jpg").read_bytes(), np.random.default_rng(8)
    for _ in range(40):
        changed = bytearray(whole)
        for place in rng.integers(2, 120, 4):
            changed[place] = rng.integers(0, 256)
        (tmp_path / "a.jpg").write_bytes(changed)
        write_photo(tmp_path / "out.png", PHOTO, like=tmp_path / "a.jpg")
        np.testing.assert_array_equal(read_photo(tmp_path / "out.png").shape, PHOTO.shape)


def test_camera_data_too_long_for_a_jpeg_are_left_out(tmp_path):
    from PIL import Image as Pillow

    exif = Pillow.Exif()
    exif[272] = "x" * 80_000
    Pillow.fromarray(PHOTO).save(tmp_path / "a.png", exif=exif)
    write_photo(tmp_path / "out.jpg", PHOTO, like=tmp_path / "a.png")
    assert read_photo(tmp_path / "out.jpg").shape == PHOTO.shape


def test_edges_are_still_read_by_a_name_of_any_kind(tmp_path):
    path = tmp_path / "Größe \u202f写真.json"
    write_edges(path, FOUND)
    assert read_edges(path)
