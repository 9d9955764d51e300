"""Outputs are whole or not there, and what cannot be written is refused before the work."""

import os
import stat
from pathlib import Path

import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import (
    check_folder,
    check_output,
    make_folder,
    write_photo,
    write_psf,
    write_text,
)
from napari_crfdeblur.io.files import check_input, replacing

KEPT = b"what was there before"


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "out.png"
    path.write_bytes(KEPT)
    return path


def test_the_new_file_takes_the_place_of_the_old_one(path):
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")
        assert path.read_bytes() == KEPT
    assert path.read_bytes() == b"new"
    assert list(path.parent.iterdir()) == [path]


def write_half(path, failure):
    with replacing(path) as temporary:
        temporary.write_bytes(b"half of the n")
        raise failure


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt, GeneratorExit])
def test_a_run_that_fails_or_is_stopped_leaves_the_old_file(path, failure):
    with pytest.raises(failure):
        write_half(path, failure)
    assert path.read_bytes() == KEPT
    assert list(path.parent.iterdir()) == [path]


def test_a_full_disk_is_reported_in_words_and_leaves_the_old_file(path):
    with pytest.raises(CrfDeblurError, match=r"out\.png: cannot be written \(No space left"):
        write_half(path, OSError(28, "No space left on device"))
    assert path.read_bytes() == KEPT
    assert list(path.parent.iterdir()) == [path]


def test_an_encoder_without_words_from_the_system_is_quoted(path):
    with pytest.raises(CrfDeblurError, match=r"cannot be written \(encoder error -2\)"):
        write_half(path, OSError("encoder error -2"))


def test_a_folder_that_was_removed_during_the_work_is_reported(tmp_path):
    with pytest.raises(CrfDeblurError, match="cannot be written"):
        write_text(tmp_path / "gone" / "a.txt", "new")


def test_a_link_stays_a_link(path):
    link = path.with_name("link.png")
    try:
        link.symlink_to(path)
    except OSError:
        pytest.skip("no links may be made on this system")
    write_text(link, "new")
    assert link.is_symlink()
    assert path.read_bytes() == b"new"


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_writer_that_fails_midway_leaves_the_old_photo(tmp_path, monkeypatch, suffix, dtype):
    path = tmp_path / f"out{suffix}"
    path.write_bytes(KEPT)

    def fail(self, *_):
        with self.open("wb") as file:
            file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(CrfDeblurError, match="No space left"):
        write_photo(path, np.full((8, 9), 7, dtype=dtype))
    assert path.read_bytes() == KEPT
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_no_psf_leaves_the_old_one(path):
    with pytest.raises(CrfDeblurError, match="a stack of them"):
        write_psf(path, np.ones((3, 5, 7, 2)))
    assert path.read_bytes() == KEPT
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such permission bits")
def test_permissions_are_those_of_the_old_file_or_of_any_new_one(path):
    path.chmod(0o640)
    write_text(path, "new")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    usual = path.with_name("usual")
    usual.touch()
    write_text(path.with_name("fresh"), "new")
    assert path.with_name("fresh").stat().st_mode == usual.stat().st_mode


def test_text_is_written_in_utf8(path):
    write_text(path, "Straße µ\n")
    assert path.read_text(encoding="utf-8") == "Straße µ\n"


def test_other_suffix_is_refused_with_those_that_can_be_written(path):
    with pytest.raises(CrfDeblurError, match=r"ends in \.png, \.tif"):
        check_output(path.with_suffix(".gif"), (".png", ".tif"))


def test_suffix_can_be_in_capitals(path):
    check_output(path.with_suffix(".PNG"), (".png",))


def test_folders_in_place_of_files_are_refused(tmp_path):
    (tmp_path / "a.png").mkdir()
    with pytest.raises(CrfDeblurError, match="is a folder; give the name of a file"):
        check_output(tmp_path / "a.png", (".png",))
    with pytest.raises(CrfDeblurError, match="a folder; give a file in it"):
        check_input(tmp_path / "a.png")


def test_output_in_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(CrfDeblurError, match="no such folder; make it first"):
        check_output(tmp_path / "none" / "a.png", (".png",))


def test_paths_below_a_file_are_refused(path):
    with pytest.raises(CrfDeblurError, match="no such folder"):
        check_output(path / "a.png", (".png",))
    with pytest.raises(CrfDeblurError, match="no such file"):
        check_input(path / "a.png")
    with pytest.raises(CrfDeblurError, match="cannot make this folder"):
        make_folder(path / "folder")


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="only Linux has such a folder")
def test_folder_in_which_nothing_can_be_written_is_refused():
    # Even root, for whom permission bits do not bind, cannot write there.
    with pytest.raises(CrfDeblurError, match="nothing can be written in this folder"):
        check_folder(Path("/proc/self"))
    with pytest.raises(CrfDeblurError, match="nothing can be written in this folder"):
        check_output(Path("/proc/self/a.png"), (".png",))


def test_a_name_that_is_too_long_is_refused(tmp_path):
    long = tmp_path / ("a" * 300 + ".png")
    for check in (check_input, lambda p: check_output(p, (".png",)), make_folder):
        with pytest.raises(CrfDeblurError):
            check(long)


def test_folders_are_made_with_their_parents_and_may_exist(tmp_path):
    for _ in range(2):
        make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names on this system")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    with pytest.raises(CrfDeblurError, match="not a file"):
        check_input(tmp_path / "pipe.png")
