"""The light in saturated pixels, found from what its blur sheds around them.

A lamp that saturates the camera still shows how bright it is: its blur reaches pixels that are
not saturated. Richardson-Lucy, which never goes below zero and follows factors of ten with
ease, finds that light; least squares with it filled in no longer ring.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import repeat
from math import prod

import numpy as np
from scipy import ndimage

from .. import arrays
from .._typing import BoolArray, FloatArray
from ..boundary import frame, periodic_shape
from ..fourier import convolving, kept_otf
from ..progress import Job, Progress
from .richardson_lucy import restoring
from .tiles import Region

ITERATIONS = 30  # twice as many gain 1 dB around the highlights, half as many lose 2 dB
MARGIN = 2  # PSF sides around clipped pixels that are looked at


@dataclass(frozen=True, slots=True, eq=False)
class Filled:
    """A plane whose clipped pixels hold the light that they would have recorded.

    Parameters
    ----------
    plane : ndarray, shape (M, N) or (Z, M, N)
        Nowhere below what was recorded.
    scenes : list of (tuple of slice, ndarray)
        Parts of the plane, and the sharp picture found there.
    """

    plane: FloatArray
    scenes: list[tuple[Region, FloatArray]]


def filling(
    plane: FloatArray, psf: FloatArray, clipped: BoolArray | None, at: Progress
) -> Job[Filled]:
    """Job: fill in the highlights of a plane, as a part of another: reports `at` repeatedly."""
    filled = Filled(plane if clipped is None else arrays.copy(plane), [])
    if clipped is None:
        return filled
    for box in _boxes(arrays.to_numpy(clipped), psf.shape):
        part, own = arrays.contiguous(plane[box]), arrays.contiguous(clipped[box])
        scene = yield from restoring(part, psf, own, ITERATIONS, repeat(at))
        inside = frame(part.shape)
        filled.scenes.append((box, scene[inside]))
        transfer = kept_otf(psf, periodic_shape(part.shape, psf.shape), part)
        light = (yield from convolving(scene, transfer, at))[inside]
        yield at
        filled.plane[box] = arrays.namespace(part).where(own & (light > part), light, part)
    return filled


def _boxes(clipped: BoolArray, sides: tuple[int, ...]) -> Iterator[Region]:
    """Parts of a plane around its clipped pixels; or all of it, if they are everywhere."""
    shape = clipped.shape
    cells = tuple(-(-length // side) for length, side in zip(shape, sides, strict=True))
    grid = np.zeros(cells, dtype=bool)
    grid[tuple(np.nonzero(clipped)[axis] // side for axis, side in enumerate(sides))] = True
    full = ndimage.generate_binary_structure(len(shape), len(shape))
    labels, _ = ndimage.label(ndimage.binary_dilation(grid, full, MARGIN), full)
    boxes = [
        tuple(
            slice(cell.start * side, min(cell.stop * side, length))
            for cell, side, length in zip(found, sides, shape, strict=True)
        )
        for found in ndimage.find_objects(labels)
    ]
    area = sum(prod(part.stop - part.start for part in box) for box in boxes)
    yield from boxes if area < prod(shape) else [frame(shape)]
