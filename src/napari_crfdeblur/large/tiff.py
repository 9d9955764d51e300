"""Regions of a TIFF, and TIFFs that are written region by region."""

import os
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import ceil, prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._typing import Image
from ..deconvolution.tiles import Region
from ..errors import DAMAGED, CrfDeblurError
from .stamp import Stamp

if TYPE_CHECKING:
    from tifffile import TiffFrame, TiffPage

TILE = 256  # side of the tiles that are written
LARGEST_PART = 1 << 30  # bytes: a tile or strip is decoded as a whole, whatever is asked of it
UNSUSPICIOUS = 1 << 26  # bytes that are decoded, or read, whatever the other size is
STRONGEST = 3000  # bytes from one: deflate makes 1032 at most, LZW 2700
JPEGS = (6, 7, 33007, 34892)  # schemes whose data have a size of their own
FRAMES = {0xFFC0 + kind for kind in range(16)} - {0xFFC4, 0xFFC8, 0xFFCC}  # markers, ISO 10918
FILL = 0xFFFF


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
        pixels = np.array(_mapped(stamp.path, found)[region])
    else:
        pixels = _of_pages(stamp, found, region)
    if found.negative:
        return 1 - pixels if pixels.dtype.kind == "f" else ~pixels
    return pixels


def _mapped(path: Path, found: Layout) -> Image:
    """All pixels, without reading them."""
    shape = found.shape
    if found.planes:
        shape = *shape[:-3], shape[-1], *shape[-3:-1]
    whole = np.memmap(path, dtype=found.stored, mode="r", offset=found.start or 0, shape=shape)
    return np.moveaxis(whole, -3, -1) if found.planes else whole


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
    tables = {}
    if key.compression in JPEGS:
        tables = {"jpegtables": page.jpegtables, "jpegheader": key.jpegheader}
        rows, columns = _size_of_jpeg((key.jpegheader or b"") + content)
        if rows * columns > prod(_sides_of_part(key)):
            raise ValueError("a JPEG larger than its tile or strip")
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


def _size_of_jpeg(content: bytes) -> tuple[int, int]:
    """Rows and columns in the header of a JPEG."""
    at = 2
    while at + 9 <= len(content):
        marker, length = struct.unpack_from(">HH", content, at)
        if marker == FILL:
            at += 1
        elif marker in FRAMES:
            rows, columns = struct.unpack_from(">HH", content, at + 5)
            return rows, columns
        else:
            at += 2 + length
    raise ValueError("a JPEG without a header")


@dataclass(frozen=True, slots=True, eq=False)
class TiffWriter:
    """A TIFF of tiles that is there already, and is filled region by region.

    Parameters
    ----------
    file : binary file
        Open for reading and writing.
    offsets : ndarray, shape (pages, rows of tiles, columns of tiles)
        First byte of each tile.
    shape : tuple of int
        Of the photo or stack.
    tile : tuple of int
        Shape of a tile, with channels if there are any.
    dtype : dtype
    lock : Lock
        One region at a time.
    """

    file: Any
    offsets: Image
    shape: tuple[int, ...]
    tile: tuple[int, ...]
    dtype: np.dtype[Any]
    lock: Any

    def write(self, region: Region, pixels: Image) -> None:
        """Write a region; tiles that it covers in part keep what else is in them."""
        plane = len(self.tile)
        stack, (rows, columns) = region[:-plane], region[-plane:][:2]
        numbers = np.arange(len(self.offsets)).reshape(self.shape[:-plane])[stack]
        height, width = self.tile[:2]
        tiles = list(
            product(
                range(rows.start // height, ceil(rows.stop / height)),
                range(columns.start // width, ceil(columns.stop / width)),
            )
        )
        with self.lock:
            for place, number in np.ndenumerate(numbers):
                for i, j in tiles:
                    top, left = max(rows.start, i * height), max(columns.start, j * width)
                    bottom = min(rows.stop, (i + 1) * height)
                    right = min(columns.stop, (j + 1) * width)
                    part = pixels[place][top - rows.start : bottom - rows.start]
                    part = part[:, left - columns.start : right - columns.start]
                    at = top - i * height, left - j * width
                    self._put(int(self.offsets[number, i, j]), at, part)

    def _put(self, offset: int, at: tuple[int, int], part: Image) -> None:
        whole = np.empty(self.tile, dtype=self.dtype)
        if part.shape != self.tile:
            self.file.seek(offset)
            whole[...] = np.frombuffer(self.file.read(whole.nbytes), self.dtype).reshape(self.tile)
        whole[at[0] : at[0] + part.shape[0], at[1] : at[1] + part.shape[1]] = part
        self.file.seek(offset)
        rest = memoryview(whole).cast("B")
        while rest:  # a disk that is nearly full takes a part, and says no at the next attempt
            rest = rest[self.file.write(rest) :]


@contextmanager
def tiff_writer(
    path: Path, shape: tuple[int, ...], dtype: np.dtype[Any], color: bool
) -> Iterator[TiffWriter]:
    """Make a BigTIFF of tiles, uncompressed, and fill it; the disk is asked for room at once."""
    import tifffile

    plane = 3 if color else 2
    pages = prod(shape[:-plane])
    kind = "rgb" if color else "minisblack"
    with tifffile.TiffWriter(path, bigtiff=True, byteorder="<") as tiff:
        tiff.write(shape=shape, dtype=dtype, tile=(TILE, TILE), photometric=kind)
    with tifffile.TiffFile(path) as tiff:
        offsets = np.array([page.dataoffsets for page in tiff.pages], dtype=np.int64)
    sides = [ceil(side / TILE) for side in shape[-plane:][:2]]
    with path.open("r+b", buffering=0) as file:
        _reserve(file.fileno(), path.stat().st_size)
        yield TiffWriter(
            file,
            offsets.reshape(pages, *sides),
            shape,
            (TILE, TILE, *shape[-plane:][2:]),
            dtype.newbyteorder("<"),
            threading.Lock(),
        )


def _reserve(file: int, size: int) -> None:
    """Ask for room on the disk before the work, where the system can."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file, 0, size)
