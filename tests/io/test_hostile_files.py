"""Pictures and arrays that nobody vouches for: a value, or one sentence, and nothing else."""

import logging
import struct
import warnings

import numpy as np
import pytest
import tifffile
from hostile import flipped, read_or_refused, truncated
from PIL import Image as Pillow

from napari_crfdeblur.io import read_camera_key, read_photo, read_psf, write_photo
from napari_crfdeblur.io.limits import Limits
from napari_crfdeblur.io.quiet import quiet
from napari_crfdeblur.large import open_source
from napari_crfdeblur.photo import from_unit

FEW = Limits(photo=10**6, psf=10**6)
RANDOM = np.random.default_rng(3)
PHOTO = from_unit(RANDOM.random((31, 43, 3)), np.uint8)
PSF = RANDOM.random((7, 9))
TIFFS = {
    "strips": {"rowsperstrip": 8, "compression": "lzw"},
    "tiles": {"tile": (16, 32), "compression": "zlib", "predictor": True},
    "packed": {"rowsperstrip": 8, "compression": "packbits"},
    "zstd": {"rowsperstrip": 8, "compression": "zstd"},
    "jpeg": {"compression": "jpeg", "rowsperstrip": 16},
    "big": {"bigtiff": True},
    "planes": {"planarconfig": "separate"},
}


def exif():
    found = Pillow.Exif()
    found[271], found[272], found[274] = "Maker", "Model", 6
    return found


def write_picture(path, kind):
    """A small photo, stored in some way."""
    if kind in TIFFS:
        planar = kind == "planes"
        data = np.ascontiguousarray(np.moveaxis(PHOTO, 2, 0)) if planar else PHOTO
        tifffile.imwrite(path, data, photometric="rgb", **TIFFS[kind])
    elif kind == "png16":
        write_photo(path, from_unit(PHOTO / 255, np.uint16))
    elif kind == "palette":
        Pillow.fromarray(PHOTO).quantize(16).save(path)
    elif kind == "progressive.jpg":
        Pillow.fromarray(PHOTO).save(path, progressive=True, exif=exif())
    else:
        Pillow.fromarray(PHOTO).save(path, exif=exif())


KINDS = {
    **{kind: f"{kind}.tif" for kind in TIFFS},
    "png16": "16.png",
    "palette": "palette.png",
    "png": "8.png",
    "progressive.jpg": "progressive.jpg",
    "jpg": "a.jpg",
}


def is_photo(found):
    return found.ndim in (2, 3) and found.dtype.kind in "uf" and found.size > 0


@pytest.fixture
def silent(caplog, capfd):
    """Nothing is said beside the sentence."""
    caplog.set_level(logging.WARNING)
    yield
    assert not caplog.records
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("silent")
@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_photo_is_a_photo_or_one_sentence(tmp_path, kind):
    path = tmp_path / KINDS[kind]
    write_picture(path, kind)
    assert is_photo(read_photo(path))
    rng, whole = np.random.default_rng(21), path.read_bytes()
    for content in (*truncated(whole, rng, 10), *flipped(whole, rng, 50)):
        path.write_bytes(content)
        found = read_or_refused(lambda path: read_photo(path, limits=FEW), path)
        assert found is None or is_photo(found)
        key = read_or_refused(read_camera_key, path)
        assert key is None or str(key).isprintable()


def ends_of_tags(content):
    """Where a TIFF of little end keeps the values of its first directory, 12 bytes a tag."""
    start = struct.unpack_from("<I", content, 4)[0]
    count = struct.unpack_from("<H", content, start)[0]
    return [start + 2 + 12 * number for number in range(count)]


@pytest.mark.usefixtures("silent")
@pytest.mark.parametrize("kind", ["strips", "tiles", "jpeg"])
def test_every_tag_of_a_tiff_may_lie(tmp_path, kind):
    path = tmp_path / "a.tif"
    write_picture(path, kind)
    whole = path.read_bytes()
    for place in ends_of_tags(whole):
        for offset, code, value in [
            (4, "<I", 0xFFFFFFFF),  # how many values
            (8, "<I", 0),
            (8, "<I", 0x7FFFFFFF),
            (2, "<H", 12),  # their kind
        ]:
            changed = bytearray(whole)
            struct.pack_into(code, changed, place + offset, value)
            path.write_bytes(changed)
            found = read_or_refused(lambda path: read_photo(path, limits=FEW), path)
            assert found is None or is_photo(found)


@pytest.mark.usefixtures("silent")
@pytest.mark.parametrize("name", ["k.npy", "k.tif", "k.png", "stack.tif"])
def test_a_damaged_psf_is_a_psf_or_one_sentence(tmp_path, name):
    path = tmp_path / name
    if name == "k.npy":
        np.save(path, PSF)
    elif name == "k.png":
        write_photo(path, from_unit(PSF, np.uint16))
    else:
        stack = PSF if name == "k.tif" else np.stack([PSF, PSF[::-1], PSF])
        tifffile.imwrite(path, stack.astype(np.float32), photometric="minisblack")
    rng, whole = np.random.default_rng(22), path.read_bytes()
    for content in (*truncated(whole, rng, 10), *flipped(whole, rng, 50)):
        path.write_bytes(content)
        found = read_or_refused(lambda path: read_psf(path, limits=FEW), path)
        assert found is None or (np.isfinite(found).all() and np.isclose(found.sum(), 1))


def npy(header, data=b"\0" * 64, version=1, length=None):
    """An NPY file with any header."""
    text = header.encode("latin1")
    size = len(text) if length is None else length
    sized = struct.pack("<H" if version == 1 else "<I", size)
    return b"\x93NUMPY" + bytes([version, 0]) + sized + text + data


def described(shape, kind="'<f8'", order="False"):
    return f"{{'descr': {kind}, 'fortran_order': {order}, 'shape': {shape}, }}"


LYING = [
    npy(described((10**9, 10**9))),
    npy(described((10**30,))),
    npy(described((-1, 8))),
    npy(described((-2, -4))),
    npy(described("(2.0, 4)")),
    npy(described("[2, 4]")),
    npy(described("None")),
    npy(described((1,) * 100)),
    npy(described((1,) * 33)),
    npy(described((3, 3))),
    npy(described((2, 4), "'|O'"), b"cos\nsystem\n(S'true'\ntR."),
    npy(described((2, 4), "'<c16'"), bytes(128)),
    npy(described((2, 4), "'<U1000000000'")),
    npy(described((2, 4), "'<V8'")),
    npy(described((2, 4), "[('a', '<f4'), ('b', '<f4')]")),
    npy(described((2, 4), "'(1000000000,)<f8'")),
    npy(described((2, 4), "'<M8[s]'")),
    npy(described((2, 4), "'nothing'")),
    npy(described((2, 4), "3")),
    npy(described((2, 4), order="7")),
    npy("{'descr': '<f8'}"),
    npy("["),
    npy("(" * 5000),
    npy("1" * 5000),
    npy("'\\ud800'"),
    npy("9**9**9"),
    npy("", length=60000),
    npy("", length=0),
    npy("", length=0xFFFFFFFF, version=2),
    npy("", length=0x7FFFFFFF, version=3),
    npy(described((2, 4)), version=9),
    npy("\0" * 100),
    npy(described("(2L, 4L)"), version=2),
]


@pytest.mark.usefixtures("silent")
def test_headers_of_npy_that_lie_are_refused(tmp_path):
    path = tmp_path / "a.npy"
    for number, content in enumerate(LYING):
        path.write_bytes(content)
        for read in (read_psf, open_source):
            found = read_or_refused(read, path)
            # What an old numpy wrote is read: "2L" was a whole number of Python 2.
            assert found is None or b"2L" in content, f"{number}: {content[:100]!r}"


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["<f8", ">f4", "u2", "?"])
def test_arrays_of_every_order_come_back(tmp_path, order, dtype):
    values = (PSF * 9).astype(dtype)
    np.save(tmp_path / "a.npy", np.asarray(values, order=order))
    np.save(tmp_path / "plain.npy", values.astype(np.float64))
    np.testing.assert_array_equal(read_psf(tmp_path / "a.npy"), read_psf(tmp_path / "plain.npy"))


def test_what_libraries_say_is_kept_back_only_while_files_are_read(caplog):
    caplog.set_level(logging.DEBUG)
    log = logging.getLogger("tifffile.part")
    with quiet(), quiet():
        warnings.warn("beside the point", UserWarning, stacklevel=1)
        log.error("beside the point")
    assert not caplog.records
    log.error("to the point")
    assert [each.message for each in caplog.records] == ["to the point"]
    with pytest.warns(UserWarning, match="to the point"):
        warnings.warn("to the point", UserWarning, stacklevel=1)
    assert logging.getLogger("tifffile").propagate
