"""A cluster that is lost in mid-run: refused in words, soon, and with nothing half written."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest
import tifffile

from napari_crfdeblur.batch import Batch, Fate, base, deblur_files, deblurring_files
from napari_crfdeblur.crew import workers
from napari_crfdeblur.deconvolution import Wiener
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.io import write_photo
from napari_crfdeblur.large import store, storing
from napari_crfdeblur.pipeline import DeblurOptions
from napari_crfdeblur.psf import GivenPsf, camera_shake
from napari_crfdeblur.response import SRGB

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")
da = pytest.importorskip("dask.array")

OPTIONS = DeblurOptions(
    GivenResponse(SRGB()), psf=GivenPsf(camera_shake(9, 3)), method=Wiener(0.01)
)
ELSEWHERE = """
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster:
        print(cluster.scheduler_address, flush=True)
        input()
"""


@contextmanager
def local_cluster(count, deaths):
    """A cluster that gives up a task when more workers than so many have died at it."""
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": deaths}),
        distributed.LocalCluster(
            n_workers=count, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as running,
    ):
        yield running


@pytest.fixture
def elsewhere(tmp_path_factory):
    """A cluster of another process: that process, and its address."""
    script = tmp_path_factory.mktemp("cluster") / "cluster.py"
    script.write_text(ELSEWHERE)
    with subprocess.Popen(
        [sys.executable, script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as running:
        yield running, running.stdout.readline().strip()
        running.kill()


def deadly(values):
    """Kills the process that has to do with the value 7."""
    if (values == 7).any():
        os.kill(os.getpid(), signal.SIGKILL)
    return values


def sharpened(pixels, _options):
    return deadly(pixels)


@pytest.fixture
def numbered():
    """Tiles of 0, 1, 2, ... 11."""
    values = np.repeat(np.arange(12, dtype=np.uint8), 20)[:, None] * np.ones(30, np.uint8)
    return da.from_array(values, chunks=(20, 30))


@pytest.mark.parametrize(
    ("what", "reason"),
    [(signal.SIGKILL, "scheduler of the cluster is gone"), (signal.SIGSTOP, "no answer from its")],
    ids=["dead", "frozen"],
)
def test_a_scheduler_lost_in_mid_run_ends_the_job(
    elsewhere, numbered, tmp_path, monkeypatch, what, reason
):
    process, address = elsewhere
    job = storing(numbered, tmp_path / "out.tif", scheduler=address)
    while next(job).done < 3:
        pass
    process.send_signal(what)
    # From here on nothing answers, however long it is waited for.
    if what == signal.SIGSTOP:
        monkeypatch.setattr(workers, "PATIENCE", 1.0)
        monkeypatch.setattr(workers, "ANSWER", 1.0)
    with pytest.raises(CrfDeblurError, match=reason):
        list(job)
    assert list(tmp_path.iterdir()) == []


def test_workers_may_come_late_and_all_be_lost(numbered, tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "LOOK", 0.1)
    with local_cluster(0, deaths=3) as cluster:
        job = storing(numbered, tmp_path / "out.tif", scheduler=cluster.scheduler_address)
        for _ in range(3):
            assert next(job).done == 0
        cluster.scale(1)
        while next(job).done < 3:
            pass
        monkeypatch.setattr(workers, "PATIENCE", 1.0)
        cluster.sync(next(iter(cluster.workers.values())).close)
        with pytest.raises(CrfDeblurError, match="had for 1 s no workers; start some"):
            list(job)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def fragile():
    with local_cluster(2, deaths=0) as running:
        yield running


def test_a_tile_that_kills_its_workers_is_given_up(fragile, numbered, tmp_path):
    (tmp_path / "out.tif").write_bytes(b"what was there")
    array = numbered.map_blocks(deadly, dtype=np.uint8, meta=np.empty((0, 0), np.uint8))
    with pytest.raises(CrfDeblurError, match="workers of the cluster died again and again"):
        store(array, tmp_path / "out.tif", scheduler=fragile.scheduler_address)
    assert (tmp_path / "out.tif").read_bytes() == b"what was there"
    assert [path.name for path in tmp_path.iterdir()] == ["out.tif"]
    store(numbered, tmp_path / "out.tif", scheduler=fragile.scheduler_address)
    np.testing.assert_array_equal(tifffile.imread(tmp_path / "out.tif"), numbered.compute())


@pytest.fixture
def photos(tmp_path):
    """Photos of which the third has the value 7, and no other."""
    paths = [tmp_path / f"{number}.png" for number in range(6)]
    for number, path in enumerate(paths):
        values = np.random.default_rng(number).integers(8, 255, (60, 70)).astype(np.uint8)
        values[20, 30] = 7 if number == 2 else 8
        write_photo(path, values)
    return paths


def test_a_photo_that_kills_its_workers_is_the_only_one_lost(
    fragile, photos, tmp_path, monkeypatch
):
    monkeypatch.setattr(base, "sharpened", sharpened)
    batch = Batch(photos, tmp_path / "out", OPTIONS)
    result = deblur_files(batch, scheduler=fragile.scheduler_address)
    assert [each.photo for each in result.of(Fate.FAILED)] == [photos[2]]
    assert "workers of the cluster died" in result.outcomes[2].reason
    assert len(result.of(Fate.DONE)) == 5
    assert [each.photo for each in result.outcomes] == photos


def test_a_batch_whose_scheduler_dies_goes_on_where_it_stopped(elsewhere, photos, tmp_path):
    process, address = elsewhere
    batch = Batch(photos, tmp_path / "out", OPTIONS)
    job = deblurring_files(batch, scheduler=address)
    while (report := next(job)).stage != "photos" or report.done < 2:
        pass
    process.kill()
    with pytest.raises(CrfDeblurError, match="scheduler of the cluster is gone"):
        list(job)
    found = {path.name for path in (tmp_path / "out").iterdir()}
    assert 2 <= len(found) - 1 < len(photos)
    assert all(name.endswith(("-deblurred.png", ".jsonl")) for name in found)
    again = deblur_files(batch)
    assert len(again.of(Fate.KEPT)) == len(found) - 1
    assert not again.of(Fate.FAILED)
