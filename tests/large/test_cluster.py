"""A cluster gives what threads give, whatever happens to its workers."""

import os
import signal
import socket

import numpy as np
import pytest
import tifffile

from napari_crfdeblur.batch import Batch, deblur_files
from napari_crfdeblur.crew import workers
from napari_crfdeblur.deconvolution import RichardsonLucy, Tiled
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.io import read_photo, write_photo
from napari_crfdeblur.large import restore_large, store, storing
from napari_crfdeblur.pipeline import DeblurOptions
from napari_crfdeblur.psf import GivenPsf, camera_shake
from napari_crfdeblur.response import SRGB

distributed = pytest.importorskip("distributed")
da = pytest.importorskip("dask.array")

PSF = camera_shake(9, 3)
METHOD = Tiled(RichardsonLucy(5), side=150)


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as running:
        yield running


@pytest.fixture
def photo(tmp_path):
    values = np.random.default_rng(8).random((340, 430)).astype(np.float32)
    tifffile.imwrite(tmp_path / "in.tif", values, tile=(64, 64), photometric="minisblack")
    return values


def test_a_cluster_gives_the_same_bits_as_threads(cluster, photo, tmp_path):
    array = restore_large(tmp_path / "in.tif", SRGB(), PSF, METHOD)
    lazy = restore_large(da.from_array(photo, chunks=111), SRGB(), PSF, METHOD)
    store(array, tmp_path / "threads.tif")
    store(array, tmp_path / "cluster.tif", scheduler=cluster.scheduler_address)
    store(lazy, tmp_path / "dask.tif", scheduler=cluster.scheduler_address)
    expected = tifffile.imread(tmp_path / "threads.tif")
    for name in ("cluster.tif", "dask.tif"):
        np.testing.assert_array_equal(tifffile.imread(tmp_path / name), expected)


@pytest.mark.usefixtures("photo")
def test_a_worker_that_dies_loses_nothing(cluster, tmp_path):
    array = restore_large(tmp_path / "in.tif", SRGB(), PSF, METHOD)
    job = storing(array, tmp_path / "out.tif", scheduler=cluster.scheduler_address)
    while next(job).done < 2:
        pass
    os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
    list(job)
    np.testing.assert_array_equal(tifffile.imread(tmp_path / "out.tif"), array.compute())


@pytest.mark.usefixtures("photo")
def test_an_error_on_a_worker_is_told_as_it_is(cluster, tmp_path):
    array = restore_large(tmp_path / "in.tif", SRGB(), PSF, METHOD)
    os.utime(tmp_path / "in.tif", ns=(1, 1))
    with pytest.raises(CrfDeblurError, match="was changed while it was read"):
        store(array, tmp_path / "out.tif", scheduler=cluster.scheduler_address)
    assert not (tmp_path / "out.tif").exists()


def test_a_batch_on_a_cluster_gives_the_same_photos(cluster, tmp_path):
    for seed in range(3):
        pixels = np.random.default_rng(seed).integers(0, 255, (90, 120, 3)).astype(np.uint8)
        write_photo(tmp_path / f"{seed}.png", pixels)
    (tmp_path / "bad.png").write_bytes(b"no picture")
    names = ["0.png", "bad.png", "1.png", "2.png"]
    options = DeblurOptions(GivenResponse(SRGB()), psf=GivenPsf(PSF), method=RichardsonLucy(2))
    paths = [tmp_path / name for name in names]
    here = deblur_files(Batch(paths, tmp_path / "here", options))
    there = deblur_files(
        Batch(paths, tmp_path / "there", options), scheduler=cluster.scheduler_address
    )
    assert [each.fate for each in there.outcomes] == [each.fate for each in here.outcomes]
    for one, other in zip(here.outcomes, there.outcomes, strict=True):
        if one.result:
            np.testing.assert_array_equal(read_photo(one.result), read_photo(other.result))


def test_a_scheduler_that_does_not_answer_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "ANSWER", 0.5)
    array = da.zeros((50, 60), dtype=np.uint8)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        addresses = [
            f"tcp://127.0.0.1:{silent.getsockname()[1]}",  # takes the call, says nothing
            "tcp://127.0.0.1:9",  # takes no calls
            "nonsense",
        ]
        for address in addresses:
            with pytest.raises(CrfDeblurError, match="did not answer within"):
                store(array, tmp_path / "out.tif", scheduler=address)
    assert list(tmp_path.iterdir()) == []
