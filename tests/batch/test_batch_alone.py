"""Two batches in one folder: never at the same time, and never one at the other's cost."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from napari_crfdeblur.batch import Batch, Fate, deblur_files
from napari_crfdeblur.batch.base import UNFINISHED
from napari_crfdeblur.batch.journal import NAME as JOURNAL
from napari_crfdeblur.cli import main
from napari_crfdeblur.crew.alone import NAME, alone
from napari_crfdeblur.deconvolution import Wiener
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.io import write_photo, write_psf
from napari_crfdeblur.pipeline import DeblurOptions
from napari_crfdeblur.psf import GivenPsf, camera_shake
from napari_crfdeblur.response import SRGB

PSF = camera_shake(9, 3)
OPTIONS = DeblurOptions(GivenResponse(SRGB()), psf=GivenPsf(PSF), method=Wiener())
HALFWAY = """
import sys
from pathlib import Path
from napari_crfdeblur.batch import Batch, deblurring_files
from napari_crfdeblur.deconvolution import Wiener
from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.io import read_psf
from napari_crfdeblur.pipeline import DeblurOptions
from napari_crfdeblur.psf import GivenPsf
from napari_crfdeblur.response import SRGB

psf = GivenPsf(read_psf(Path("psf.npy")))
options = DeblurOptions(GivenResponse(SRGB()), psf=psf, method=Wiener())
for report in deblurring_files(Batch([Path("a.png"), Path("b.png")], Path("out"), options)):
    if report.stage == "b.png":
        print("halfway", flush=True)
        input()
"""


@pytest.fixture
def photos(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for seed, name in enumerate("ab"):
        values = np.random.default_rng(seed).integers(0, 255, (60, 70, 3))
        write_photo(Path(f"{name}.png"), values.astype(np.uint8))
    write_psf(Path("psf.npy"), PSF)
    return [Path("a.png"), Path("b.png")]


@pytest.fixture
def halfway(photos):
    """A batch of another process that has done one of the two photos."""
    assert len(photos) == 2
    with subprocess.Popen(
        [sys.executable, "-c", HALFWAY], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as running:
        assert running.stdout.readline() == "halfway\n"
        yield running
        running.kill()


def contents(folder):
    return {path.name: path.stat().st_mtime_ns for path in folder.iterdir() if path.name != NAME}


def test_a_batch_of_another_process_is_left_alone(halfway, photos, capsys):
    before = contents(Path("out"))
    batch = Batch(photos, Path("out"), OPTIONS)
    with pytest.raises(CrfDeblurError, match=r"out: another batch is at work in this folder; wait"):
        deblur_files(batch)
    arguments = ["batch", "a.png", "-o", "out", "--response", "srgb", "--psf", "psf.npy"]
    assert main(arguments) == 2
    assert "another batch is at work" in capsys.readouterr().err
    assert contents(Path("out")) == before
    halfway.communicate("\n")
    assert halfway.returncode == 0
    assert [each.fate for each in deblur_files(batch).outcomes] == [Fate.KEPT, Fate.KEPT]
    assert set(contents(Path("out"))) == {"a-deblurred.png", "b-deblurred.png", JOURNAL}


def test_a_killed_batch_keeps_nobody_out(halfway, photos):
    halfway.kill()
    halfway.wait()
    assert UNFINISHED in contents(Path("out"))
    result = deblur_files(Batch(photos, Path("out"), OPTIONS))
    assert [each.fate for each in result.outcomes] == [Fate.KEPT, Fate.DONE]
    assert {path.name for path in Path("out").iterdir()} == {
        "a-deblurred.png",
        "b-deblurred.png",
        JOURNAL,
    }


def test_the_folder_is_free_again_after_a_failure(tmp_path):
    def failing():
        with alone(tmp_path):
            raise KeyError

    with pytest.raises(KeyError):
        failing()
    assert list(tmp_path.iterdir()) == []
    with alone(tmp_path), pytest.raises(CrfDeblurError), alone(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="other locks there")
def test_where_locks_are_unknown_a_batch_works_without(tmp_path, monkeypatch):
    import fcntl

    def unknown(*_arguments):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", unknown)
    with alone(tmp_path):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_journal_that_cannot_be_written_stops_the_batch(photos, monkeypatch):
    opened = Path.open

    def full(path, mode="r", **options):
        if path.name == JOURNAL and mode == "a" and Path("out/a-deblurred.png").exists():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return opened(path, mode, **options)

    batch = Batch(photos, Path("out"), OPTIONS)
    with monkeypatch.context() as patched:
        patched.setattr(Path, "open", full)
        with pytest.raises(CrfDeblurError, match=r"No space left.*make room, and start the batch"):
            deblur_files(batch)
    assert set(contents(Path("out"))) == {"a-deblurred.png", JOURNAL}
    assert [each.fate for each in deblur_files(batch).outcomes] == [Fate.DONE, Fate.DONE]
