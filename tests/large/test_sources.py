"""Photos that are opened without being read: every region is what is stored there."""

import os
import pickle

import numpy as np
import pytest
import tifffile

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import write_photo
from napari_crfdeblur.large import open_source

REGION = slice(13, 150), slice(61, 97)
KINDS = {
    "tiles": {"tile": (32, 48), "compression": "zlib"},
    "plain-tiles": {"tile": (32, 48)},
    "strips": {"rowsperstrip": 16, "compression": "zlib"},
    "one-block": {},
    "big": {"bigtiff": True, "byteorder": ">"},
    "big-tiles": {"tile": (16, 16), "byteorder": ">"},
    "predicted": {"tile": (32, 48), "compression": "zlib", "predictor": True},
}


def noise(shape, dtype=np.uint16, seed=5):
    values = np.random.default_rng(seed).random(shape)
    return (values * 60000).astype(dtype) if np.dtype(dtype).kind == "u" else values.astype(dtype)


@pytest.mark.parametrize("shape", [(170, 130), (170, 130, 3), (170, 130, 4)])
@pytest.mark.parametrize("kind", KINDS)
def test_a_region_of_a_tiff_is_what_was_written(tmp_path, kind, shape):
    photo = noise(shape, np.uint8)
    photometric = "rgb" if len(shape) == 3 else "minisblack"
    tifffile.imwrite(tmp_path / "a.tif", photo, photometric=photometric, **KINDS[kind])
    source = open_source(tmp_path / "a.tif")
    assert (source.shape, source.dtype) == (photo.shape, photo.dtype)
    assert source.color is (len(shape) == 3)
    region = (*REGION, slice(0, 3))[: len(shape)]
    np.testing.assert_array_equal(source.read(region), photo[region])


@pytest.mark.parametrize("dtype", [np.uint16, np.float32, np.float64])
def test_kinds_of_number_are_kept(tmp_path, dtype):
    photo = noise((170, 130), dtype)
    np.save(tmp_path / "a.npy", photo)
    tifffile.imwrite(tmp_path / "a.tif", photo, tile=(64, 64), byteorder=">")
    for name in ("a.npy", "a.tif"):
        part = open_source(tmp_path / name).read(REGION)
        np.testing.assert_array_equal(part, photo[REGION])
        assert part.dtype == dtype
        assert part.dtype.isnative


@pytest.mark.parametrize("options", [{}, {"compression": "zlib"}, {"tile": (32, 32)}])
def test_pages_are_slices_of_a_stack(tmp_path, options):
    stack = noise((4, 170, 130))
    tifffile.imwrite(tmp_path / "a.tif", stack, photometric="minisblack", **options)
    source = open_source(tmp_path / "a.tif")
    assert source.shape == stack.shape
    assert not source.color
    region = (slice(1, 3), *REGION)
    np.testing.assert_array_equal(source.read(region), stack[region])


def test_white_stored_as_zero_is_turned_round(tmp_path):
    photo = noise((170, 130), np.uint8)
    tifffile.imwrite(tmp_path / "a.tif", ~photo, photometric="miniswhite", tile=(64, 64))
    np.testing.assert_array_equal(open_source(tmp_path / "a.tif").read(REGION), photo[REGION])


def test_zarr_arrays_and_images_are_read(tmp_path):
    zarr = pytest.importorskip("zarr")
    photo = noise((2, 170, 130))
    array = zarr.create_array(tmp_path / "a.zarr", data=photo, chunks=(1, 50, 60))
    group = zarr.create_group(tmp_path / "b.zarr")
    group.create_array("0", data=photo, chunks=(1, 50, 60))
    group.create_array("1", data=photo[:, ::2, ::2])
    group.attrs["multiscales"] = [{"datasets": [{"path": "0"}, {"path": "1"}]}]
    assert array.shape == photo.shape
    for name in ("a.zarr", "b.zarr"):
        source = open_source(tmp_path / name)
        assert source.shape == photo.shape
        region = (slice(1, 2), *REGION)
        np.testing.assert_array_equal(source.read(region), photo[region])


def test_photos_without_regions_are_read_whole(tmp_path):
    photo = noise((170, 130, 3), np.uint8)
    write_photo(tmp_path / "a.png", photo)
    source = open_source(tmp_path / "a.png")
    region = (*REGION, slice(0, 3))
    np.testing.assert_array_equal(source.read(region), photo[region])
    source.check()


def test_a_source_can_be_sent_to_another_process(tmp_path):
    photo = noise((170, 130))
    tifffile.imwrite(tmp_path / "a.tif", photo, tile=(64, 64))
    copy = pickle.loads(pickle.dumps(open_source(tmp_path / "a.tif")))
    np.testing.assert_array_equal(copy.read(REGION), photo[REGION])


@pytest.mark.parametrize("ending", [".tif", ".npy"])
def test_a_file_that_changes_is_noticed_at_the_next_region(tmp_path, ending):
    path = tmp_path / f"a{ending}"
    photo = noise((170, 130))
    np.save(path, photo) if ending == ".npy" else tifffile.imwrite(path, photo)
    source = open_source(path)
    source.read(REGION)
    os.utime(path, ns=(1, 1))
    with pytest.raises(CrfDeblurError, match="was changed while it was read"):
        source.read(REGION)


def test_a_zarr_that_changes_is_noticed_in_the_end(tmp_path):
    zarr = pytest.importorskip("zarr")
    array = zarr.create_array(tmp_path / "a.zarr", data=noise((170, 130)), chunks=(50, 60))
    source = open_source(tmp_path / "a.zarr")
    source.check()
    array[0, 0] = 7
    with pytest.raises(CrfDeblurError, match="was changed"):
        source.check()


def test_what_cannot_be_opened_is_refused(tmp_path):
    palette = np.zeros((3, 256), np.uint16)
    tifffile.imwrite(
        tmp_path / "palette.tif", noise((99, 80), np.uint8), photometric="palette", colormap=palette
    )
    tifffile.imwrite(tmp_path / "turned.tif", noise((99, 80)), extratags=[(274, 3, 1, 6, True)])
    tifffile.imwrite(tmp_path / "signed.tif", noise((99, 80)).astype(np.int32))
    tifffile.imwrite(tmp_path / "short.tif", noise((99, 80)))
    whole = (tmp_path / "short.tif").read_bytes()
    (tmp_path / "short.tif").write_bytes(whole[:3000])
    (tmp_path / "text.tif").write_text("no picture")
    (tmp_path / "folder.zarr").mkdir()
    reasons = {
        "palette.tif": "with a palette",
        "turned.tif": "save it upright",
        "signed.tif": "pixels of kind int32",
        "short.tif": "damaged",
        "text.tif": "damaged",
        "missing.tif": "there is no such file",
        "folder.zarr": "no array of zarr",
    }
    for name, reason in reasons.items():
        with pytest.raises(CrfDeblurError, match=reason):
            open_source(tmp_path / name)


def test_tiles_that_end_early_are_reported_when_they_are_read(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, noise((300, 400)), tile=(64, 64))
    path.write_bytes(path.read_bytes()[:-5000])
    source = open_source(path)
    with pytest.raises(CrfDeblurError, match="truncated or damaged"):
        source.read((slice(200, 300), slice(300, 400)))
