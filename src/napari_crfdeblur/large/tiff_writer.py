"""TIFFs that are written region by region."""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from math import ceil, prod
from pathlib import Path
from typing import Any

import numpy as np

from .._typing import Image
from ..deconvolution.tiles import Region

TILE = 256  # side of the tiles that are written


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
