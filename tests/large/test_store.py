"""Results are stored whole or not at all, whatever happens meanwhile."""

import errno
import os

import numpy as np
import pytest
import tifffile

from napari_crfdeblur.deconvolution import RichardsonLucy, Tiled
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.large import open_source, restore_large, store, storing
from napari_crfdeblur.large.tiff_writer import TiffWriter
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.response import SRGB

da = pytest.importorskip("dask.array")
zarr = pytest.importorskip("zarr")

PSF = camera_shake(9, 3)
METHOD = Tiled(RichardsonLucy(2), side=120)


def lazy(shape=(700, 530), chunks=(190, 210), dtype=np.uint16):
    values = np.random.default_rng(3).integers(0, 60000, shape).astype(dtype)
    return values, da.from_array(values, chunks=chunks)


def stored(path):
    return zarr.open(path, mode="r")[:] if path.suffix == ".zarr" else tifffile.imread(path)


@pytest.mark.parametrize("ending", [".tif", ".zarr"])
@pytest.mark.parametrize(
    ("shape", "chunks"),
    [
        ((700, 530), (190, 210)),
        ((300, 530, 3), (100, 170, 3)),
        ((260, 170, 4), (100, 170, 4)),
        ((3, 300, 530), (1, 300, 110)),
        ((2, 2, 60, 70, 3), (1, 1, 33, 70, 3)),
    ],
)
def test_what_is_stored_is_what_was_computed(tmp_path, ending, shape, chunks):
    values, array = lazy(shape, chunks)
    path = tmp_path / f"out{ending}"
    store(array, path)
    np.testing.assert_array_equal(stored(path), values)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    source = open_source(path)
    assert source.shape == shape
    assert source.color is (shape[-1] in (3, 4))


def test_a_tiff_is_big_and_tiled(tmp_path):
    _, array = lazy()
    store(array, tmp_path / "out.tif")
    with tifffile.TiffFile(tmp_path / "out.tif") as tiff:
        assert tiff.is_bigtiff
        assert tiff.pages.first.is_tiled


@pytest.mark.parametrize("ending", [".tif", ".zarr"])
def test_an_earlier_result_is_replaced_in_the_end(tmp_path, ending):
    path = tmp_path / f"out{ending}"
    first, array = lazy()
    store(array, path)
    job = storing((array + 1), path)
    for progress in job:
        if progress.done < progress.total:
            np.testing.assert_array_equal(stored(path), first)
    np.testing.assert_array_equal(stored(path), first + 1)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("ending", [".tif", ".zarr"])
def test_a_stopped_job_leaves_nothing(tmp_path, ending):
    _, array = lazy()
    job = storing(array, tmp_path / f"out{ending}")
    while next(job).done < 2:
        pass
    job.close()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", [".tif", ".zarr"])
def test_an_error_in_a_tile_leaves_what_was_there(tmp_path, ending):
    path = tmp_path / f"out{ending}"
    first, array = lazy()
    store(array, path)

    def fail(block, block_id=()):
        if block_id == (2, 1):
            raise CrfDeblurError("this tile is bad; mend it")
        return block

    with pytest.raises(CrfDeblurError, match="this tile is bad"):
        store(array.map_blocks(fail, dtype=array.dtype), path)
    np.testing.assert_array_equal(stored(path), first)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def full_disk(*_arguments):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_disk_that_fills_up_leaves_nothing(tmp_path, monkeypatch):
    _, array = lazy()
    writes = []

    def put(*arguments):
        writes.append(arguments)
        if len(writes) > 3:
            full_disk()

    monkeypatch.setattr(TiffWriter, "_put", put)
    with pytest.raises(CrfDeblurError, match=r"out\.tif: cannot be written \(No space left"):
        store(array, tmp_path / "out.tif")
    assert list(tmp_path.iterdir()) == []


def test_a_zarr_on_a_full_disk_leaves_nothing(tmp_path, monkeypatch):
    _, array = lazy()
    monkeypatch.setattr(zarr.Array, "__setitem__", full_disk)
    with pytest.raises(CrfDeblurError, match=r"out\.zarr: cannot be written \(No space left"):
        store(array, tmp_path / "out.zarr")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="cannot ask for room here")
def test_room_on_the_disk_is_asked_for_before_the_work(tmp_path, monkeypatch):
    computed = []
    _, array = lazy()
    monkeypatch.setattr(os, "posix_fallocate", full_disk)
    counted = array.map_blocks(lambda block: computed.append(1) or block, dtype=array.dtype)
    computed.clear()
    with pytest.raises(CrfDeblurError, match="No space left"):
        store(counted, tmp_path / "out.tif")
    assert computed == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", [".tif", ".zarr"])
def test_a_photo_that_changes_meanwhile_gives_no_result(tmp_path, ending):
    photo = np.random.default_rng(2).random((300, 400)).astype(np.float32)
    path = tmp_path / f"in{ending}"
    if ending == ".tif":
        tifffile.imwrite(path, photo, tile=(64, 64))
    else:
        written = zarr.create_array(path, data=photo, chunks=(64, 64))
    source = open_source(path)
    array = restore_large(source, SRGB(), PSF, METHOD)
    job = storing(array, tmp_path / "out.tif", source=source)
    while next(job).done < 1:
        pass
    if ending == ".tif":
        os.utime(path, ns=(1, 1))
    else:
        written[5, 5] = 0.5
    with pytest.raises(CrfDeblurError, match="was changed while it was read"):
        list(job)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def test_places_that_cannot_be_written_are_refused_before_the_work(tmp_path):
    _, array = lazy()
    (tmp_path / "full.zarr").mkdir()
    (tmp_path / "full.zarr" / "letter.txt").write_text("mine")
    (tmp_path / "file.zarr").write_text("mine")
    reasons = {
        "out.png": "ends in .tif",
        "no/out.tif": "there is no such folder",
        "no/out.zarr": "there is no such folder",
        "full.zarr": "holds no array of zarr",
        "file.zarr": "not a PNG, JPEG or TIFF",
    }
    for name, reason in reasons.items():
        with pytest.raises(CrfDeblurError, match=reason):
            store(array, tmp_path / name)
    assert (tmp_path / "full.zarr" / "letter.txt").read_text() == "mine"


def test_progress_counts_the_tiles(tmp_path):
    _, array = lazy()
    reports = list(storing(array, tmp_path / "out.tif"))
    assert reports[-1].done == reports[-1].total == array.npartitions
    done = [each.done for each in reports]
    assert done == sorted(done)
