"""Files that claim, or decode to, more than memory: refused before the memory is taken."""

import json
import struct
import subprocess
import sys
import zlib

import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image as Pillow

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import read_photo, read_psf, write_photo
from napari_crfdeblur.io.limits import Limits

SMALL = np.random.default_rng(5).integers(0, 255, (30, 40, 3), dtype=np.uint8)
MUCH = 1 << 28  # bytes that a small file decodes to
ALLOWED = 150  # MB that refusing all of them may take together; a process has as much already

# Reads files in a process of its own, which cannot take the machine down, and says what came of
# each, and by how many MB its memory grew.
CHILD = """
import json, resource, sys
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import read_photo, read_psf, read_responses, read_edges
readers = [read_photo, read_psf, read_responses, read_edges]
names = {each.__name__: each for each in readers}
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
first, *rest = json.loads(sys.argv[1])
names[first[0]](Path(first[1]))
before, said = peak(), []
for name, path in rest:
    try:
        said.append(f"read {names[name](Path(path)).shape}")
    except CrfDeblurError as error:
        said.append(str(error))
print(json.dumps([said, peak() - before]))
"""


def png(rows, columns, bits=8, color=0, data=b""):
    """A PNG of any size, whose pixels may not be there."""

    def chunk(name, content):
        check = zlib.crc32(name + content)
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", columns, rows, bits, color, 0, 0, 0)
    parts = [chunk(b"IHDR", header), chunk(b"IDAT", data), chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def claiming(jpeg, rows, columns):
    """A JPEG whose frame header says another size."""
    changed = bytearray(jpeg)
    place = changed.index(b"\xff\xc0")
    struct.pack_into(">HH", changed, place + 5, rows, columns)
    return bytes(changed)


def tiff_with(path, content, **options):
    """A small TIFF whose only part is replaced by other content."""
    tifffile.imwrite(path, SMALL, photometric="rgb", **options)
    with tifffile.TiffFile(path) as tiff:
        offset, count = (tiff.pages[0].tags[name] for name in (273, 279))
        places = offset.valueoffset, count.valueoffset
        kinds = offset.dtype, count.dtype
    changed = bytearray(path.read_bytes())
    for place, kind, value in zip(places, kinds, (len(changed), len(content)), strict=True):
        assert kind == 4 or value < 1 << 16
        struct.pack_into("<I" if kind == 4 else "<H", changed, place, value)
    path.write_bytes(bytes(changed) + content)


def with_tag(path, values, **options):
    """A small TIFF of which a few tags say something else."""
    tifffile.imwrite(path, SMALL, photometric="rgb", **options)
    with tifffile.TiffFile(path, mode="r+") as tiff:
        for name, value in values.items():
            tiff.pages[0].tags[name].overwrite(value, dtype="I")


def sparse_npy(path, shape):
    """An NPY file that really has as many bytes as it says, none of them on the disk."""
    with path.open("wb") as file:
        header = {"descr": "<f8", "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, header)
        file.truncate(file.tell() + 8 * int(np.prod(shape)))


def bombs(folder):
    """How each is read, and a word of what is said of it."""
    squeezed = zlib.compress(bytes(MUCH))
    jpeg = imagecodecs.jpeg_encode(SMALL, level=90)
    jpeg_2000 = bytearray(imagecodecs.jpeg2k_encode(SMALL, codecformat="j2k"))
    struct.pack_into(">II", jpeg_2000, jpeg_2000.index(b"\xff\x4f\xff\x51") + 8, 30000, 30000)
    one_bit = zlib.compress(bytes(30000 * (1 + 30000 // 8)))
    (folder / "claim.png").write_bytes(png(60000, 60000))
    (folder / "claim16.png").write_bytes(png(60000, 60000, 16, 2))
    (folder / "lie.png").write_bytes(png(20000, 20000, 8, 2, zlib.compress(b"\0" * 99)))
    (folder / "bits.png").write_bytes(png(30000, 30000, 1, 0, one_bit))
    (folder / "claim.jpg").write_bytes(claiming(jpeg, 65500, 65500))
    (folder / "lie.jpg").write_bytes(claiming(jpeg, 20000, 20000))
    tiff_with(folder / "strip.tif", squeezed, compression="zlib", rowsperstrip=30)
    tiff_with(folder / "lzw.tif", imagecodecs.lzw_encode(bytes(MUCH >> 6)), compression="lzw")
    tiff_with(folder / "jpeg.tif", claiming(jpeg, 30000, 30000), compression="jpeg")
    tiff_with(folder / "jpeg2000.tif", bytes(jpeg_2000), compression=34712)
    side = {"ImageWidth": 100_000, "ImageLength": 100_000}
    with_tag(folder / "claim.tif", side, compression="zlib")
    with_tag(folder / "plain.tif", side)
    huge = {"TileWidth": 59984, "TileLength": 59984}
    with_tag(folder / "tile.tif", huge, tile=(16, 16), compression="zlib")
    sparse_npy(folder / "k.npy", (30000, 30000))
    (folder / "k.png").write_bytes(png(30000, 30000, 1, 0, one_bit))
    for name in ("r.json", "e.json"):
        with (folder / name).open("wb") as file:
            file.truncate(1 << 36)
    return {
        "claim.png": ("read_photo", "too large"),
        "claim16.png": ("read_photo", "too large"),
        "lie.png": ("read_photo", "cannot hold"),
        "bits.png": ("read_photo", "too large"),
        "claim.jpg": ("read_photo", "too large"),
        "lie.jpg": ("read_photo", "cannot hold"),
        "strip.tif": ("read_photo", "strip.tif"),
        "lzw.tif": ("read_photo", "read (30, 40, 3)"),  # as much as there is place for
        "jpeg.tif": ("read_photo", "claims to have 30000 x 30000 pixels"),
        "jpeg2000.tif": ("read_photo", "claims to have 30000 x 30000 pixels"),
        "claim.tif": ("read_photo", "too large"),
        "plain.tif": ("read_photo", "too large"),
        "tile.tif": ("read_photo", "too large"),
        "k.npy": ("read_psf", "the PSF is too large: 30000 x 30000"),
        "k.png": ("read_psf", "the PSF is too large: 30000 x 30000"),
        "r.json": ("read_responses", "too large"),
        "e.json": ("read_edges", "too large"),
    }


@pytest.mark.skipif(sys.platform != "linux", reason="memory is measured as Linux counts it")
def test_bombs_are_refused_without_taking_the_memory(tmp_path):
    expected = bombs(tmp_path)
    write_photo(tmp_path / "whole.png", SMALL)
    jobs = [("read_photo", str(tmp_path / "whole.png"))]
    jobs += [(reader, str(tmp_path / name)) for name, (reader, _) in expected.items()]
    child = [sys.executable, "-W", "error", "-c", CHILD, json.dumps(jobs)]
    done = subprocess.run(child, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    said, grown = json.loads(done.stdout)
    for (name, (_, word)), sentence in zip(expected.items(), said, strict=True):
        assert word in sentence, f"{name}: {sentence}"
        assert sentence.isprintable()
    assert grown < ALLOWED


@pytest.mark.parametrize("name", ["a.png", "a.tif", "16.png"])
def test_a_photo_that_compresses_very_well_is_read(tmp_path, name):
    kind = np.uint16 if name == "16.png" else np.uint8
    photo = np.full((2000, 3000, 3), 9, kind)
    photo[1200, 77] = 200
    write_photo(tmp_path / name, photo)
    assert photo.nbytes > 500 * (tmp_path / name).stat().st_size
    np.testing.assert_array_equal(read_photo(tmp_path / name), photo)


def test_larger_photos_can_be_allowed(tmp_path):
    write_photo(tmp_path / "a.png", SMALL)
    for megapixels in (0.0011, 0.0012):
        limits = Limits().with_photos_of(megapixels)
        if megapixels < 0.0012:
            with pytest.raises(CrfDeblurError, match="--largest-photo"):
                read_photo(tmp_path / "a.png", limits=limits)
        else:
            assert read_photo(tmp_path / "a.png", limits=limits).shape == SMALL.shape


@pytest.mark.parametrize("megapixels", [0, -1, float("nan"), float("inf")])
def test_a_number_of_megapixels_that_is_none_is_refused(megapixels):
    with pytest.raises(ValueError, match="expected a number of megapixels"):
        Limits().with_photos_of(megapixels)
    with pytest.raises(ValueError, match="expected photo"):
        Limits(photo=0)


def test_photos_beyond_the_limit_of_pillow_are_read_within_ours(tmp_path, monkeypatch):
    monkeypatch.setattr(Pillow, "MAX_IMAGE_PIXELS", 100)
    write_photo(tmp_path / "a.png", SMALL)
    write_photo(tmp_path / "a.jpg", SMALL)
    for name in ("a.png", "a.jpg"):
        assert read_photo(tmp_path / name).shape == SMALL.shape


def test_a_psf_of_three_dimensions_is_limited_in_all_of_it(tmp_path):
    np.save(tmp_path / "k.npy", np.ones((3, 5, 7)))
    assert read_psf(tmp_path / "k.npy", limits=Limits(psf=105, psf_side=7)).shape == (3, 5, 7)
    for limits in (Limits(psf=104), Limits(psf_side=6)):
        with pytest.raises(CrfDeblurError, match="3 x 5 x 7"):
            read_psf(tmp_path / "k.npy", limits=limits)
