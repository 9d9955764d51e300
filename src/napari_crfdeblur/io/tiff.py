"""The first page of a TIFF, or all that belong to it, as they are meant to be seen."""

from collections.abc import Callable
from math import ceil, prod
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from .._typing import Image
from .inputs import size_of
from .limits import Claim
from .segments import check_compression, check_segments

if TYPE_CHECKING:
    from tifffile import TiffFrame, TiffPage


def read_tiff(path: Path, file: BinaryIO, check: Callable[[Path, Claim], None]) -> Image:
    """Read the first page: channels last, colors instead of a palette, black 0, upright.

    Parameters
    ----------
    path : Path
        Name of the file.
    file : binary file
        Open.
    check : callable
        Refuses what the page claims to be, before it is read.

    Raises
    ------
    Exception
        What the decoder raises for data that end early or make no sense.
    """
    import tifffile

    with tifffile.TiffFile(file, _multifile=False) as tiff:
        page = tiff.pages[0]
        if not isinstance(page, tifffile.TiffPage) or page.photometric is None:
            raise ValueError("no picture in it")
        check_compression(path, page)
        check(path, _claim(page, size_of(file)))
        check_parts(file, page, page)
        pixels = np.asarray(page.asarray())
        if page.planarconfig == tifffile.PLANARCONFIG.SEPARATE and pixels.ndim == 3:
            pixels = np.moveaxis(pixels, 0, -1)
        if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
            pixels = negative(pixels)
        if page.photometric == tifffile.PHOTOMETRIC.PALETTE and page.colormap is not None:
            # 16 bits for each color, of which palettes use the upper 8.
            pixels = np.moveaxis(page.colormap[:, pixels] >> 8, 0, -1).astype(np.uint8)
        return upright(pixels, page.tags.valueof("Orientation", default=1))


def read_slices(path: Path, file: BinaryIO, check: Callable[[Path, Claim], None]) -> Image | None:
    """Read a stack of gray pages, shape (Z, M, N) or with more axes; None if there is none.

    Parameters
    ----------
    path, file, check
        As for :func:`read_tiff`.

    Raises
    ------
    Exception
        As :func:`read_tiff`.
    """
    import tifffile

    with tifffile.TiffFile(file, _multifile=False) as tiff:
        series, page = tiff.series[0], tiff.pages.first
        black = tifffile.PHOTOMETRIC.MINISBLACK, tifffile.PHOTOMETRIC.MINISWHITE
        if page.photometric not in black or page.samplesperpixel > 1 or series.ndim < 3:
            return None
        check_compression(path, page)
        taken, size = prod(series.shape) * series.dtype.itemsize, size_of(file)
        check(path, Claim(series.shape, taken, size))
        if series.dataoffset is not None and series.dataoffset + taken > size:
            raise ValueError("its data end early")
        for each in series.pages:
            if each is not None:
                check_parts(file, each, page)
        pixels = series.asarray()
        if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
            pixels = negative(pixels)
        planes = np.moveaxis(pixels, (-2, -1), (0, 1))
        turned = upright(planes, page.tags.valueof("Orientation", default=1))
        return np.ascontiguousarray(np.moveaxis(turned, (0, 1), (-2, -1)))


def negative(pixels: Image) -> Image:
    """What was stored with white as 0."""
    return 1 - pixels if pixels.dtype.kind == "f" else ~pixels


def _claim(page: "TiffPage", stored: int) -> Claim:
    """What a page says that it holds, with all of its tiles, which are decoded whole."""
    rows, columns = page.imagelength * page.imagedepth, page.imagewidth
    if page.is_tiled:
        rows = ceil(rows / page.tilelength) * page.tilelength * page.tiledepth
        columns = ceil(columns / page.tilewidth) * page.tilewidth
    size = page.dtype.itemsize if page.dtype is not None else 1
    channels = page.samplesperpixel
    return Claim((rows, columns), rows * columns * channels * size, stored, channels)


def check_parts(file: BinaryIO, page: "TiffPage | TiffFrame", first: "TiffPage") -> None:
    """Raise ValueError if the data of a page, stored like the first, end early or claim much."""
    size = size_of(file)
    parts = zip(page.dataoffsets, page.databytecounts, strict=True)
    if any(start + count > size for start, count in parts):
        raise ValueError("its data end early")
    whole = first.dtype is not None and first.is_contiguous and len(page.dataoffsets) > 0
    if whole and page.dataoffsets[0] + first.nbytes > size:
        raise ValueError("its data end early")
    check_segments(file, page, first)


def upright(pixels: Image, orientation: int) -> Image:
    """Turn a stored picture as its orientation tag says, 1 to 8 (TIFF 6.0, page 36)."""
    if orientation in (5, 6, 7, 8):
        pixels = np.swapaxes(pixels, 0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)
