"""Every region of every kind of TIFF is what the whole page has there, and no more is read."""

import struct
import zlib
from io import BytesIO

import numpy as np
import pytest
import tifffile
from PIL import Image as Pillow

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.large import open_source, tiff

ROWS, COLUMNS = 150, 131
REGIONS = [
    (slice(0, ROWS), slice(0, COLUMNS)),
    (slice(13, 97), slice(61, 130)),
    (slice(149, 150), slice(0, 1)),
    (slice(32, 64), slice(48, 96)),
]
PARTS = {"tiles": {"tile": (32, 48)}, "strips": {"rowsperstrip": 17}}
SCHEMES = {
    "plain": {},
    "deflate": {"compression": "zlib"},
    "predicted": {"compression": "zlib", "predictor": True},
    "lzw": {"compression": "lzw"},
    "packbits": {"compression": "packbits"},
    "big-endian": {"compression": "zlib", "byteorder": ">"},
    "plain-big-endian": {"byteorder": ">"},
}
COLORS = {"gray": (), "rgb": (3,), "rgba": (4,)}


def pixels(shape, dtype=np.uint8, seed=3):
    """Noise over flat areas, so that every scheme has something to compress."""
    rng = np.random.default_rng(seed)
    values = np.floor(4 * rng.random(shape)) / 4 * (rng.random(shape) < 0.3)
    return (values * 250).astype(dtype) if np.dtype(dtype).kind == "u" else values.astype(dtype)


def agrees(path, colors=0):
    """Compare all regions with the page as tifffile gives it, its channels last."""
    whole = tifffile.imread(path)
    if colors and whole.shape[-1] != colors:
        whole = np.moveaxis(whole, -3, -1)
    source = open_source(path)
    assert (source.shape, source.dtype) == (whole.shape, whole.dtype)
    for region in REGIONS:
        region = (*region, slice(0, colors)) if colors else region
        region = (slice(0, None), *region)[-whole.ndim :]
        region = tuple(slice(*s.indices(n)) for s, n in zip(region, whole.shape, strict=True))
        np.testing.assert_array_equal(source.read(region), whole[region])
    if colors:
        one = (*REGIONS[1], slice(1, 2))
        if whole.ndim == len(one):
            np.testing.assert_array_equal(source.read(one), whole[one])


@pytest.mark.parametrize("color", COLORS)
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("parts", PARTS)
def test_every_region_is_that_of_the_whole_page(tmp_path, parts, scheme, color):
    path, channels = tmp_path / "a.tif", COLORS[color]
    kind = "rgb" if channels else "minisblack"
    for dtype in (np.uint8, np.uint16, np.float32):
        photo = pixels((ROWS, COLUMNS, *channels), dtype)
        tifffile.imwrite(path, photo, photometric=kind, **PARTS[parts], **SCHEMES[scheme])
        agrees(path, sum(channels))


@pytest.mark.parametrize("stack", [(), (3,)])
@pytest.mark.parametrize("scheme", ["plain", "deflate", "predicted"])
@pytest.mark.parametrize("parts", [{}, *PARTS.values()])
def test_colors_may_lie_in_planes_of_their_own(tmp_path, parts, scheme, stack):
    photo = pixels((*stack, 3, ROWS, COLUMNS), np.uint16)
    options = {"photometric": "rgb", "planarconfig": "separate", **parts, **SCHEMES[scheme]}
    tifffile.imwrite(tmp_path / "a.tif", photo, **options)
    agrees(tmp_path / "a.tif", 3)


@pytest.mark.parametrize("parts", PARTS)
@pytest.mark.parametrize("color", ["gray", "rgb"])
def test_jpeg_parts_are_decoded(tmp_path, parts, color):
    photo = pixels((ROWS, COLUMNS, *COLORS[color]))
    options = {"tile": (32, 48)} if parts == "tiles" else {"rowsperstrip": 16}
    if color == "rgb":
        options |= {"photometric": "rgb", "subsampling": (2, 2)}
    tifffile.imwrite(tmp_path / "a.tif", photo, compression="jpeg", **options)
    agrees(tmp_path / "a.tif", sum(COLORS[color]))


def jpeg(part, stream):
    """Stream 1: tables of quantization and code alone; 2: the picture without them."""
    file = BytesIO()
    Pillow.fromarray(part).save(file, "jpeg", quality=90, subsampling=2, streamtype=stream)
    return file.getvalue()


def with_shared_tables(path, photo, parts):
    """Write JPEG as libtiff does: YCbCr, color at half the resolution, one set of tables."""
    height, width = (32, 48) if parts == "tiles" else (16, COLUMNS)
    padded = np.pad(photo, ((0, -ROWS % height), (0, -COLUMNS % width), (0, 0)), mode="edge")
    rows, columns = range(0, ROWS, height), range(0, COLUMNS, width)
    pieces = [jpeg(padded[i : i + height, j : j + width], 2) for i in rows for j in columns]
    tifffile.imwrite(
        path,
        iter(pieces),
        shape=photo.shape,
        dtype=photo.dtype,
        photometric="ycbcr",
        subsampling=(2, 2),
        compression="jpeg",
        jpegtables=jpeg(photo, 1),
        **({"tile": (height, width)} if parts == "tiles" else {"rowsperstrip": height}),
    )


@pytest.mark.parametrize("parts", PARTS)
def test_jpeg_that_shares_tables_and_halves_color_is_read_as_rgb(tmp_path, parts):
    photo = np.stack([pixels((ROWS, COLUMNS), seed=s) for s in range(3)], axis=-1)
    photo[...] = np.kron(photo[::10, ::10], np.ones((10, 10, 1)))[:ROWS, :COLUMNS]
    with_shared_tables(tmp_path / "a.tif", photo, parts)
    agrees(tmp_path / "a.tif", 3)
    read = open_source(tmp_path / "a.tif").read((*REGIONS[0], slice(0, 3)))
    assert np.abs(read.astype(int) - photo).mean() < 12  # of 250; colors mixed up: over 40


def test_jpeg_written_by_libtiff_is_read(tmp_path):
    photo = Pillow.fromarray(pixels((ROWS, COLUMNS, 3)))
    photo.save(tmp_path / "a.tif", compression="jpeg", tiffinfo={278: 16})  # rows of a strip
    with tifffile.TiffFile(tmp_path / "a.tif") as written:
        assert written.pages.first.jpegtables
        assert len(written.pages.first.dataoffsets) == 10
    agrees(tmp_path / "a.tif", 3)


@pytest.mark.parametrize("parts", PARTS)
@pytest.mark.parametrize("color", COLORS)
def test_parts_that_were_never_written_are_black(tmp_path, parts, color):
    path, channels = tmp_path / "a.tif", COLORS[color]
    tifffile.imwrite(
        path,
        pixels((ROWS, COLUMNS, *channels)),
        photometric="rgb" if channels else "minisblack",
        compression="zlib",
        **PARTS[parts],
    )
    with tifffile.TiffFile(path, mode="r+") as file:
        tags = file.pages.first.tags
        for name in ("ByteCounts", "Offsets"):
            tag = tags[("Tile" if parts == "tiles" else "Strip") + name]
            tag.overwrite([0 if k % 3 == 1 else value for k, value in enumerate(tag.value)])
    agrees(path, sum(channels))
    second = (slice(20, 30), slice(50, 90), *(slice(0, n) for n in channels))
    assert not open_source(path).read(second).any()


def test_no_more_is_decoded_than_a_region_touches(tmp_path, monkeypatch):
    tifffile.imwrite(tmp_path / "a.tif", pixels((ROWS, COLUMNS)), tile=(32, 48), compression="zlib")
    read, decoded = [], tiff._decoded
    monkeypatch.setattr(tiff, "_decoded", lambda *a: read.append(a[-1]) or decoded(*a))
    open_source(tmp_path / "a.tif").read((slice(33, 64), slice(40, 96)))
    assert read == [3, 4]


def described(path, rows, columns, content, count=None, scheme=8):
    """A TIFF of one gray strip, whatever its tags claim."""
    tags = [(256, columns), (257, rows), (258, 8), (259, scheme), (262, 1)]
    tags += [(273, 8 + 2 + 9 * 12 + 4), (277, 1), (278, rows), (279, count or len(content))]
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    path.write_bytes(struct.pack("<2sHIH", b"II", 42, 8, 9) + entries + bytes(4) + content)


def refused(path, sentence, *channels):
    with pytest.raises(CrfDeblurError, match=sentence):
        open_source(path).read((slice(0, 9), slice(0, 9), *channels))


def test_strips_that_claim_more_than_their_bytes_hold_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(tifffile.TiffPage, "decode", None)  # nothing may be decoded
    content = zlib.compress(bytes(3_800_000), 9)
    assert len(content) < 3800
    described(tmp_path / "a.tif", 12000, 12000, content)
    refused(tmp_path / "a.tif", "bytes cannot hold the 144000000 of a tile or strip")
    described(tmp_path / "b.tif", 40000, 40000, content)
    refused(tmp_path / "b.tif", r"in pieces of 1\.5 GiB.*save it in tiles")
    described(tmp_path / "c.tif", 90, 90, content, count=3 << 30)
    refused(tmp_path / "c.tif", "data end early")


def test_a_small_part_of_many_bytes_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(tiff, "UNSUSPICIOUS", 1000)
    described(tmp_path / "a.tif", 20, 21, bytes(2000))
    refused(tmp_path / "a.tif", "2000 bytes for a tile or strip of 420")


def test_a_jpeg_larger_than_its_part_is_refused(tmp_path):
    path = tmp_path / "a.tif"
    with_shared_tables(path, pixels((ROWS, COLUMNS, 3)), "tiles")
    content = bytearray(path.read_bytes())
    with tifffile.TiffFile(path) as file:
        start = file.pages.first.dataoffsets[0]
    frame = content.index(b"\xff\xc0", start)
    content[frame + 5 : frame + 9] = b"\xff\xff\xff\xff"
    path.write_bytes(content)
    refused(path, "claims to have", slice(0, 3))
