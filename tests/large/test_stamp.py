"""Whether a file or a folder has changed is known without a look beyond it."""

import os

import pytest

from napari_crfdeblur.crew import stamp
from napari_crfdeblur.crew.stamp import Stamp
from napari_crfdeblur.errors import CrfDeblurError


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "data.zarr"
    (folder / "c" / "0").mkdir(parents=True)
    for name in ("zarr.json", "c/0/0", "c/0/1"):
        (folder / name).write_text(name)
    return folder


@pytest.mark.parametrize("name", ["/", "folder"])
def test_a_folder_that_is_no_zarr_is_refused_without_a_walk(tmp_path, monkeypatch, name):
    (tmp_path / "folder").mkdir()
    monkeypatch.setattr(os, "walk", lambda *_, **__: pytest.fail("walks"))
    with pytest.raises(CrfDeblurError, match="no array of zarr"):
        Stamp.of(tmp_path / name)


def test_a_folder_of_too_many_files_is_refused(folder, monkeypatch):
    monkeypatch.setattr(stamp, "MOST_FILES", 5)
    Stamp.of(folder)
    monkeypatch.setattr(stamp, "MOST_FILES", 4)
    with pytest.raises(CrfDeblurError, match="more than 4 files"):
        Stamp.of(folder)


def test_links_to_other_folders_are_not_followed(folder, tmp_path, monkeypatch):
    (tmp_path / "other").mkdir()
    for number in range(9):
        (tmp_path / "other" / str(number)).touch()
    (folder / "link").symlink_to(tmp_path / "other")
    monkeypatch.setattr(stamp, "MOST_FILES", 6)
    Stamp.of(folder)


@pytest.mark.parametrize("name", ["zarr.json", "c/0/1"])
def test_a_file_that_changes_anywhere_in_a_zarr_is_noticed(folder, name):
    before = Stamp.of(folder)
    before.check()
    (folder / name).write_text("another text")
    with pytest.raises(CrfDeblurError, match="was changed"):
        before.check()
