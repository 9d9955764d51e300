"""Regions of a TIFF, read without the rest."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import ceil, prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._typing import Image
from ..crew.stamp import Stamp
from ..deconvolution.tiles import Region
from ..errors import DAMAGED, CrfDeblurError
from ..io.npy import NpyLayout, read_npy_region
from ..io.segments import check_compression, check_segment

if TYPE_CHECKING:
    from tifffile import TiffFrame, TiffPage

LARGEST_PART = 1 << 30  # bytes: a tile or strip is decoded as a whole, whatever is asked of it
UNSUSPICIOUS = 1 << 26  # bytes that are decoded, or read, whatever the other size is
STRONGEST = 3000  # bytes from one: deflate makes 1032 at most, LZW 2700
JPEGS = (6, 7, 33007, 34892)  # schemes whose data have a size of their own


@dataclass(frozen=True, eq=False)
class Layout:
    """Where the pixels of a TIFF lie.

    Parameters
    ----------
    shape, dtype, color
        Of the photo, channels last.
    start : int or None
        First byte, if all pixels lie one after the other, uncompressed.
    stored : dtype
        As the file has it.
    planes : bool
        Whether each color lies by itself.
    pages : tuple
        Unless `start` is known: where the parts of each page lie.
    negative : bool
        Whether white is stored as 0.
    """

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    color: bool
    start: int | None
    stored: np.dtype[Any]
    planes: bool
    pages: "tuple[TiffPage | TiffFrame, ...]"
    negative: bool


@lru_cache(maxsize=8)
def layout(stamp: Stamp) -> Layout:
    """Where the pixels of the first series of pages lie.

    Raises
    ------
    CrfDeblurError
        A palette, or a picture that is stored turned or in parts too large to be read.
    """
    import tifffile

    with tifffile.TiffFile(stamp.path) as tiff:
        series, page = tiff.series[0], tiff.pages.first
        _check(page, stamp.path)
        color = page.samplesperpixel > 1
        planes = color and page.planarconfig == tifffile.PLANARCONFIG.SEPARATE
        shape = tuple(series.shape)
        if planes:
            shape = *shape[:-3], *shape[-2:], shape[-3]
        start = series.dataoffset if page.compression == 1 and not page.is_tiled else None
        pages = tuple(each for each in series.pages if each) if start is None else ()
        stored = np.dtype(tiff.byteorder + series.dtype.char)
        if start is not None and start + prod(shape) * stored.itemsize > stamp.size:
            raise ValueError("its data end early")
        for each in pages:
            _key(each).decode  # noqa: B018 - made while the file is open
    negative = page.photometric == tifffile.PHOTOMETRIC.MINISWHITE
    return Layout(shape, stored.newbyteorder("="), color, start, stored, planes, pages, negative)


def size_of_page(path: Path) -> int:
    """Pixels of a TIFF of one page; 0 if it has more, or cannot be read."""
    import tifffile

    try:
        with tifffile.TiffFile(path) as tiff:
            page = tiff.pages.first
            return page.imagewidth * page.imagelength if len(tiff.pages) == 1 else 0
    except DAMAGED:
        return 0


def _check(page: "TiffPage", path: Path) -> None:
    import tifffile

    check_compression(path, page)
    if page.photometric == tifffile.PHOTOMETRIC.PALETTE:
        raise CrfDeblurError(
            f"{path}: large images with a palette cannot be read in parts; convert it to gray "
            "or RGB"
        )
    if page.tags.valueof("Orientation", default=1) != 1:
        raise CrfDeblurError(
            f"{path}: is stored turned; save it upright, so that it can be read in parts"
        )
    if page.compression != 1 and _size_of_part(page) > LARGEST_PART:
        raise CrfDeblurError(
            f"{path}: is compressed in pieces of {_size_of_part(page) / (1 << 30):.1f} GiB, too "
            "large to be read in parts; save it in tiles, or uncompressed"
        )


def read_region(stamp: Stamp, region: Region) -> Image:
    """Pixels of a region of a TIFF, whatever its parts are."""
    found = layout(stamp)
    if found.start is not None:
        pixels = _of_block(stamp, found, region)
    else:
        pixels = _of_pages(stamp, found, region)
    if found.negative:
        return 1 - pixels if pixels.dtype.kind == "f" else ~pixels
    return pixels


def _of_block(stamp: Stamp, found: Layout, region: Region) -> Image:
    """Pixels that lie one after the other; read, since a map of a file cut short is deadly."""
    shape, wanted = found.shape, region
    if found.planes:
        shape = *shape[:-3], shape[-1], *shape[-3:-1]
        wanted = *region[:-3], region[-1], *region[-3:-1]
    with stamp.path.open("rb") as file:
        block = NpyLayout(shape, found.stored, False, found.start or 0)
        pixels = read_npy_region(file, block, wanted)
    return np.moveaxis(pixels, -3, -1) if found.planes else pixels


def _of_pages(stamp: Stamp, found: Layout, region: Region) -> Image:
    plane = 3 if found.color else 2
    stack, inner = region[:-plane], region[-plane:]
    pixels: Image = np.empty([part.stop - part.start for part in region], dtype=found.dtype)
    numbers = np.arange(len(found.pages)).reshape(found.shape[:-plane])[stack]
    with stamp.path.open("rb") as file:
        for place, number in np.ndenumerate(numbers):
            # Channels are an axis of their own from here on, also where there is only one.
            out = pixels[place] if found.color else pixels[place][..., np.newaxis]
            channels = inner[2] if found.color else slice(0, 1)
            page = found.pages[number]
            if not found.planes:
                _read_plane(file, stamp.size, page, 0, (*inner[:2], channels), out)
                continue
            for k in range(channels.start, channels.stop):
                only = out[..., k - channels.start, np.newaxis]
                _read_plane(file, stamp.size, page, k, (*inner[:2], slice(0, 1)), only)
    return pixels


def _read_plane(
    file: Any, size: int, page: "TiffPage | TiffFrame", plane: int, region: Region, out: Image
) -> None:
    """Decode the tiles or strips of one plane of a page that a region touches."""
    key = _key(page)
    height, width = _sides_of_part(key)
    down, across = ceil(key.imagelength / height), ceil(key.imagewidth / width)
    rows, columns, channels = region
    for i, j in product(
        range(rows.start // height, ceil(rows.stop / height)),
        range(columns.start // width, ceil(columns.stop / width)),
    ):
        top, left = i * height, j * width
        bottom, right = min(top + height, rows.stop), min(left + width, columns.stop)
        upper, start = max(top, rows.start), max(left, columns.start)
        target = out[upper - rows.start : bottom - rows.start]
        target = target[:, start - columns.start : right - columns.start]
        part = _decoded(file, size, page, (plane * down + i) * across + j)
        if part is None:
            target[...] = key.nodata
        else:
            target[...] = part[upper - top : bottom - top, start - left : right - left, channels]


def _decoded(file: Any, size: int, page: "TiffPage | TiffFrame", index: int) -> Image | None:
    """Pixels of a tile or strip, shape (rows, columns, channels); None if it was never written."""
    key, count = _key(page), page.databytecounts[index]
    if count == 0:
        return None
    offset, expected = page.dataoffsets[index], _size_of_part(key)
    if offset + count > size:
        raise ValueError("its data end early")
    if expected > UNSUSPICIOUS and expected > STRONGEST * count:
        raise ValueError(f"{count} bytes cannot hold the {expected} of a tile or strip")
    if count > UNSUSPICIOUS and count > 2 * expected:
        raise ValueError(f"{count} bytes for a tile or strip of {expected}")
    file.seek(offset)
    content = file.read(count)
    check_segment(content, key)
    tables = {}
    if key.compression in JPEGS:
        tables = {"jpegtables": page.jpegtables, "jpegheader": key.jpegheader}
    decoded: Any = key.decode(content, index, **tables)[0]
    pixels: Image = decoded[0]
    return pixels


def _key(page: "TiffPage | TiffFrame") -> "TiffPage":
    """How the parts of a page are stored."""
    if page.keyframe is None:
        raise ValueError("a page without a description")
    return page.keyframe


def _sides_of_part(page: "TiffPage") -> tuple[int, int]:
    """Rows and columns of a tile or strip."""
    if page.is_tiled:
        return page.tilelength, page.tilewidth
    return min(page.rowsperstrip, page.imagelength), page.imagewidth


def _size_of_part(page: "TiffPage") -> int:
    """Bytes of a decoded tile or strip, as the tags say."""
    channels = page.samplesperpixel if page.planarconfig == 1 else 1
    return prod(_sides_of_part(page)) * channels * ceil(page.bitspersample / 8)
