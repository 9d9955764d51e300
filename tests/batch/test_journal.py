"""The journal of a batch: what it remembers, and what it does with what it cannot read."""

import json
import os

import numpy as np
import pytest

from napari_crfdeblur.batch.journal import NAME, Journal, fingerprint
from napari_crfdeblur.crew.stamp import Stamp
from napari_crfdeblur.deconvolution import HyperLaplacian, Wiener
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import GivenPsf, camera_shake


@pytest.fixture
def photo(tmp_path):
    path = tmp_path / "photos" / "a.jpg"
    path.parent.mkdir()
    path.write_bytes(b"photo")
    return path


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


def finished(folder, photo, settings="s"):
    journal = Journal.of(folder)
    name = journal.claim(photo, "-x", ".jpg")
    (folder / name).write_bytes(b"result")
    journal.finish(name, Stamp.of(photo), settings)
    return name


def test_what_was_finished_is_known_to_the_next_batch(folder, photo):
    name = finished(folder, photo)
    journal = Journal.of(folder)
    assert journal.claim(photo, "-x", ".jpg") == name == "a-x.jpg"
    assert journal.is_done(name, Stamp.of(photo), "s")
    assert not journal.is_done(name, Stamp.of(photo), "other settings")


def test_a_changed_photo_or_result_is_not_done(folder, photo):
    name = finished(folder, photo)
    os.utime(photo, ns=(5, 5))
    assert not Journal.of(folder).is_done(name, Stamp.of(photo), "s")
    name = finished(folder, photo)
    (folder / name).write_bytes(b"other")
    assert not Journal.of(folder).is_done(name, Stamp.of(photo), "s")
    (folder / name).unlink()
    assert not Journal.of(folder).is_done(name, Stamp.of(photo), "s")


def test_names_that_are_taken_get_numbers(folder, photo, tmp_path):
    (folder / "b-x.jpg").write_bytes(b"not of a batch")
    journal = Journal.of(folder)
    assert journal.claim(photo, "-x", ".jpg") == "a-x.jpg"
    other = tmp_path / "more" / "a.jpg"
    assert journal.claim(other, "-x", ".jpg") == "a-x-2.jpg"
    assert journal.claim(tmp_path / "more" / "A.jpg", "-x", ".jpg") == "A-x-3.jpg"
    assert journal.claim(tmp_path / "b.jpg", "-x", ".jpg") == "b-x-2.jpg"
    again = Journal.of(folder)
    assert again.claim(other, "-x", ".jpg") == "a-x-2.jpg"
    assert again.claim(photo, "-x", ".jpg") == "a-x.jpg"
    assert again.claim(photo, "", ".jpg") == "a.jpg"


def test_a_line_that_was_cut_off_is_left_out(folder, photo):
    name = finished(folder, photo)
    path = folder / NAME
    path.write_bytes(path.read_bytes()[:-20])
    journal = Journal.of(folder)
    assert not journal.is_done(name, Stamp.of(photo), "s")
    assert journal.claim(photo, "-x", ".jpg") == name
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [json.loads(line) for line in lines]


@pytest.mark.parametrize("content", ["", "hello\n", "[1]\n", '{"format": "other"}\n'])
def test_what_is_no_journal_is_refused(folder, content):
    (folder / NAME).write_text(content)
    with pytest.raises(CrfDeblurError, match="is no journal of a batch"):
        Journal.of(folder)
    assert (folder / NAME).read_text() == content


def test_a_journal_of_a_later_version_is_refused(folder):
    (folder / NAME).write_text('{"format": "crfdeblur-batch", "version": 99}\n')
    with pytest.raises(CrfDeblurError, match="version 99"):
        Journal.of(folder)


def test_equal_settings_have_equal_fingerprints():
    psf = camera_shake(7, 2)
    settings = {"psf": GivenPsf(psf), "method": Wiener(0.01)}
    assert fingerprint(settings) == fingerprint(dict(reversed(settings.items())))
    others = [
        {**settings, "method": Wiener(0.02)},
        {**settings, "method": HyperLaplacian()},
        {**settings, "psf": GivenPsf(np.flip(psf))},
    ]
    assert len({fingerprint(each) for each in (settings, *others)}) == 4


def test_shared_things_hold_for_the_same_photos_or_fewer(folder, tmp_path):
    photos = [tmp_path / name for name in "abc"]
    Journal.of(folder).keep("response", "way", photos)
    journal = Journal.of(folder)
    assert journal.found("response", "way", photos[:2])
    assert not journal.found("response", "other way", photos)
    assert not journal.found("response", "way", [*photos, tmp_path / "d"])
    assert not journal.found("psf", "way", photos)
