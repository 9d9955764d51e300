"""The first page of a TIFF as it is meant to be seen."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .._typing import Image

if TYPE_CHECKING:
    from tifffile import TiffPage

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
            pixels = 1 - pixels if pixels.dtype.kind == "f" else ~pixels
        if page.photometric == tifffile.PHOTOMETRIC.PALETTE and page.colormap is not None:
            # 16 bits for each color, of which palettes use the upper 8.
            pixels = np.moveaxis(page.colormap[:, pixels] >> 8, 0, -1).astype(np.uint8)
        return upright(pixels, page.tags.valueof("Orientation", default=1))


def check_size(page: "TiffPage", size: int) -> None:
    """Raise ValueError if the picture is larger than the file can hold, or than any photo."""
    if page.imagewidth * page.imagelength * page.imagedepth * page.samplesperpixel > LARGEST:
        raise ValueError(f"{page.imagewidth} x {page.imagelength} pixels")
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
