"""The first page of a TIFF, or all that belong to it, as they are meant to be seen."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .._typing import Image

if TYPE_CHECKING:
    from tifffile import TiffFrame, TiffPage

LARGEST = 1 << 30  # samples; more are asked for only by a damaged header


def read_tiff(path: Path) -> Image:
    """Read the first page: channels last, colors instead of a palette, black 0, upright.

    Raises
    ------
    Exception
        What the decoder raises for data that end early or make no sense.
    """
    import tifffile

    with tifffile.TiffFile(path) as tiff:
        page = tiff.pages[0]
        if not isinstance(page, tifffile.TiffPage) or page.photometric is None:
            raise ValueError("no picture in it")
        check_size(page, path.stat().st_size)
        pixels = np.asarray(page.asarray())
        if page.planarconfig == tifffile.PLANARCONFIG.SEPARATE and pixels.ndim == 3:
            pixels = np.moveaxis(pixels, 0, -1)
        if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
            pixels = negative(pixels)
        if page.photometric == tifffile.PHOTOMETRIC.PALETTE and page.colormap is not None:
            # 16 bits for each color, of which palettes use the upper 8.
            pixels = np.moveaxis(page.colormap[:, pixels] >> 8, 0, -1).astype(np.uint8)
        return upright(pixels, page.tags.valueof("Orientation", default=1))


def read_slices(path: Path) -> Image | None:
    """Read a stack of gray pages, shape (Z, M, N) or with more axes; None if there is none.

    Raises
    ------
    Exception
        As :func:`read_tiff`.
    """
    import tifffile

    with tifffile.TiffFile(path) as tiff:
        series, page = tiff.series[0], tiff.pages.first
        black = tifffile.PHOTOMETRIC.MINISBLACK, tifffile.PHOTOMETRIC.MINISWHITE
        if page.photometric not in black or page.samplesperpixel > 1 or series.ndim < 3:
            return None
        if series.size > LARGEST:
            raise ValueError(f"{series.size} pixels")
        for each in series.pages:
            if each is not None:
                check_parts(each, path.stat().st_size)
        pixels = series.asarray()
        if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
            pixels = negative(pixels)
        planes = np.moveaxis(pixels, (-2, -1), (0, 1))
        turned = upright(planes, page.tags.valueof("Orientation", default=1))
        return np.ascontiguousarray(np.moveaxis(turned, (0, 1), (-2, -1)))


def negative(pixels: Image) -> Image:
    """What was stored with white as 0."""
    return 1 - pixels if pixels.dtype.kind == "f" else ~pixels


def check_size(page: "TiffPage", size: int) -> None:
    """Raise ValueError if the picture is larger than the file can hold, or than any photo."""
    if page.imagewidth * page.imagelength * page.imagedepth * page.samplesperpixel > LARGEST:
        raise ValueError(f"{page.imagewidth} x {page.imagelength} pixels")
    check_parts(page, size)


def check_parts(page: "TiffPage | TiffFrame", size: int) -> None:
    """Raise ValueError if the data of a page end beyond the file."""
    parts = zip(page.dataoffsets, page.databytecounts, strict=True)
    if any(start + count > size for start, count in parts):
        raise ValueError("its data end early")


def upright(pixels: Image, orientation: int) -> Image:
    """Turn a stored picture as its orientation tag says, 1 to 8 (TIFF 6.0, page 36)."""
    if orientation in (5, 6, 7, 8):
        pixels = np.swapaxes(pixels, 0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)
