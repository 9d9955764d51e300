"""Regions of a TIFF, and TIFFs that are written region by region."""

import os
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
    pages : tuple
        Otherwise: where the parts of each page lie.
    first : TiffPage
        How all pages are stored.
    negative : bool
        Whether white is stored as 0.
    """

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    color: bool
    start: int | None
    stored: np.dtype[Any]
    pages: "tuple[TiffPage | TiffFrame, ...]"
    first: "TiffPage"
    negative: bool


@lru_cache(maxsize=8)
def layout(stamp: Stamp) -> Layout:
    """Where the pixels of the first series of pages lie.

    Raises
    ------
    CrfDeblurError
        A palette, or a picture that is stored turned or in planes of color.
    """
    import tifffile

    with tifffile.TiffFile(stamp.path) as tiff:
        series, page = tiff.series[0], tiff.pages.first
        _check(page, stamp.path)
        color = page.samplesperpixel > 1
        start = series.dataoffset if page.compression == 1 and not page.is_tiled else None
        pages = tuple(each for each in series.pages if each) if start is None else ()
        stored = np.dtype(tiff.byteorder + series.dtype.char)
        if start is None:
            page.decode  # noqa: B018 - made while the file is open
        elif start + prod(series.shape) * stored.itemsize > stamp.size:
            raise ValueError("its data end early")
    negative = page.photometric == tifffile.PHOTOMETRIC.MINISWHITE
    plain = stored.newbyteorder("=")
    return Layout(tuple(series.shape), plain, color, start, stored, pages, page, negative)


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

    separate = page.planarconfig == tifffile.PLANARCONFIG.SEPARATE and page.samplesperpixel > 1
    if page.photometric == tifffile.PHOTOMETRIC.PALETTE or separate:
        raise CrfDeblurError(
            f"{path}: large images with a palette, or with each color by itself, cannot be read "
            "in parts; convert it to gray or RGB, colors interleaved"
        )
    if page.tags.valueof("Orientation", default=1) != 1:
        raise CrfDeblurError(
            f"{path}: is stored turned; save it upright, so that it can be read in parts"
        )


def read_region(stamp: Stamp, region: Region) -> Image:
    """Pixels of a region of a TIFF, whatever its parts are."""
    found = layout(stamp)
    if found.start is not None:
        whole = np.memmap(
            stamp.path, dtype=found.stored, mode="r", offset=found.start, shape=found.shape
        )
        pixels = np.array(whole[region])
    else:
        pixels = _of_pages(stamp.path, found, region)
    if found.negative:
        return 1 - pixels if pixels.dtype.kind == "f" else ~pixels
    return pixels


def _of_pages(path: Path, found: Layout, region: Region) -> Image:
    plane = 3 if found.color else 2
    stack, inner = region[:-plane], region[-plane:]
    pixels: Image = np.empty([part.stop - part.start for part in region], dtype=found.dtype)
    numbers = np.arange(len(found.pages)).reshape(found.shape[:-plane])[stack]
    with path.open("rb") as file:
        for place, number in np.ndenumerate(numbers):
            _read_page(file, found, found.pages[number], inner, pixels[place])
    return pixels


def _read_page(
    file: Any, found: Layout, page: "TiffPage | TiffFrame", region: Region, out: Image
) -> None:
    """Decode the tiles or strips of a page that a region touches."""
    first = found.first
    height = first.tilelength if first.is_tiled else first.rowsperstrip
    width = first.tilewidth if first.is_tiled else first.imagewidth
    across = ceil(first.imagewidth / width)
    rows, columns = region[:2]
    for i, j in product(
        range(rows.start // height, ceil(rows.stop / height)),
        range(columns.start // width, ceil(columns.stop / width)),
    ):
        index = i * across + j
        file.seek(page.dataoffsets[index])
        content = file.read(page.databytecounts[index])
        if len(content) < page.databytecounts[index]:
            raise ValueError("its data end early")
        decoded, _, shape = first.decode(content, index)
        top, left = i * height, j * width
        bottom, right = min(top + shape[1], rows.stop), min(left + shape[2], columns.stop)
        upper, start = max(top, rows.start), max(left, columns.start)
        target = out[upper - rows.start : bottom - rows.start]
        target = target[:, start - columns.start : right - columns.start]
        if decoded is None:  # a part that was never written
            target[...] = 0
            continue
        part = decoded[0, upper - top : bottom - top, start - left : right - left]
        target[...] = part[..., region[2]] if found.color else part[..., 0]


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
