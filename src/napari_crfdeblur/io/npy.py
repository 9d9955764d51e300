"""Arrays in NPY files: what their header claims is checked, then they are read where they lie."""

from dataclasses import dataclass
from math import prod
from typing import Any, BinaryIO

import numpy as np

from .._typing import Image
from .inputs import size_of

HEADER = 1 << 16  # bytes; numpy writes 128, and what it needs for many axes
AXES = 32  # of arrays, as all versions of numpy have them


@dataclass(frozen=True, slots=True)
class NpyLayout:
    """Where the numbers of an array lie in its file.

    Parameters
    ----------
    shape : tuple of int
    stored : dtype
        Real numbers, as the file has them.
    columns_first : bool
        Whether the first index runs fastest.
    start : int
        First byte.
    """

    shape: tuple[int, ...]
    stored: np.dtype[Any]
    columns_first: bool
    start: int

    @property
    def taken(self) -> int:
        """Bytes of all numbers."""
        return prod(self.shape) * self.stored.itemsize


def npy_layout(file: BinaryIO) -> NpyLayout:
    """What the header of an NPY file says, as far as the file has it.

    Raises
    ------
    Exception
        One of :data:`~napari_crfdeblur.errors.DAMAGED`, if it is no NPY file, makes no sense,
        holds no real numbers, or fewer than it claims.
    """
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0), (3, 0)):
        raise ValueError(f"format {version} is not known")
    first = version == (1, 0)
    place = file.tell()
    length = int.from_bytes(file.read(2 if first else 4), "little")
    if length > HEADER:
        raise ValueError(f"its header claims {length} bytes")
    file.seek(place)
    read = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
    shape, columns_first, dtype = read(file, max_header_size=HEADER)
    if dtype.kind not in "fiub" or dtype.itemsize > 16:
        raise ValueError(f"no real numbers, but {dtype}")
    if len(shape) > AXES or any(side < 0 for side in shape):
        raise ValueError("its shape is impossible")
    found = NpyLayout(shape, dtype, columns_first, file.tell())
    if found.start + found.taken > size_of(file):
        raise ValueError("its data end early")
    return found


def read_npy(file: BinaryIO, layout: NpyLayout) -> Image:
    """The whole array, as :func:`npy_layout` found it."""
    return read_npy_region(file, layout, tuple(slice(0, side) for side in layout.shape))


def read_npy_region(file: BinaryIO, layout: NpyLayout, region: tuple[slice, ...]) -> Image:
    """A region, with a slice of step 1 for every axis.

    It is read, not mapped: a map of a file that is cut short meanwhile ends the program.
    """
    if layout.columns_first:
        mirrored = NpyLayout(layout.shape[::-1], layout.stored, False, layout.start)
        return read_npy_region(file, mirrored, region[::-1]).T
    sides = [part.stop - part.start for part in region]
    size = layout.stored.itemsize
    steps = [prod(layout.shape[axis + 1 :]) * size for axis in range(len(sides))]
    outer = max(0, len(sides) - _whole_axes(layout.shape, region) - 1)
    found: Image = np.empty(sides, dtype=layout.stored)
    for index in np.ndindex(*sides[:outer]):
        within = zip(region, (*index, 0), steps, strict=False)
        file.seek(layout.start + sum((part.start + i) * step for part, i, step in within))
        run = found[(*index, ...)].reshape(-1).view(np.uint8)
        if file.readinto(run) < run.nbytes:  # type: ignore[attr-defined]
            raise ValueError("its data end early")
    return found


def _whole_axes(shape: tuple[int, ...], region: tuple[slice, ...]) -> int:
    """How many of the last axes a region has in full: their numbers lie one after the other."""
    count = 0
    for side, part in zip(shape[::-1], region[::-1], strict=True):
        if (part.start, part.stop) != (0, side):
            break
        count += 1
    return count
