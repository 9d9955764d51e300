"""A guard: where a restored picture is impossible, it gives way to the blurred one."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..progress import Job, Progress
from .base import Deconvolver, check_method
from .noise import PlaneStatistics, measure

# Chosen on restorations of six pictures with right and wrong PSFs and responses, and on twelve
# photos; docs/benchmarks/guard.md reports those of six other pictures.
TOLERATED = 0.04  # of the energy that was changed: as much can lie below zero
STEEPNESS = 2  # power of what lies below zero with which the share that is kept falls beyond
LEAST = 0.1  # share of a change below which nothing is kept: a tenth of garbage is garbage
WIDTH = 0.5  # PSF sides: standard deviation of the window in which it is judged
CELLS = 4  # in a PSF side: the share is known so finely
FEWEST = 2  # pixels of a cell
NOISE = 3.0  # noise levels by which light can seem to be below zero
NOTHING = 1e-30  # energy: single precision holds it


@dataclass(frozen=True, slots=True)
class Guarded(Deconvolver):
    """Another method, and where its result is impossible, less of it.

    There is no negative light. Where a wrong PSF, a wrong response or clipped light make a
    restored picture ring, it falls below zero. In a Gaussian window around each pixel, `h` is
    the energy that lies below zero by more than noise, over that of all that was changed. Of
    the change is kept ``s = min(1, (tolerated / h)^2)``, or rather ``max(0, (s - .1) / .9)``: at
    worst the result is the blurred picture.

    Parameters
    ----------
    method : Deconvolver
        What restores the plane.
    tolerated : float
        Share of the energy that can lie below zero, above 0.
    """

    method: Deconvolver
    tolerated: float = TOLERATED

    def __post_init__(self) -> None:
        check_method(self.method)
        if isinstance(self.method, Guarded):
            raise ValueError("expected a method to be guarded, got one that is guarded already")
        arguments.number(self.tolerated, "a share that is tolerated", above=0, most=1)

    @property
    def reach(self) -> float:
        """Sides of the PSF around a tile that its method needs, or the windows of the guard."""
        return max(self.method.reach, 3 * WIDTH)

    def run(
        self,
        plane: FloatArray,
        psf: FloatArray,
        *,
        clipped: BoolArray | None = None,
        statistics: PlaneStatistics | None = None,
    ) -> Job[FloatArray]:
        """Long job: deconvolve a plane or volume with a checked PSF, and judge the result."""
        sharp = yield from self.method.run(plane, psf, clipped=clipped, statistics=statistics)
        yield Progress("guard", 0, 1)
        noise = (statistics or measure(plane)).noise
        change = sharp - plane
        # a plane that is below zero itself was recorded with an offset
        darkest = min(float(arrays.namespace(plane).min(plane)), 0.0)
        below = arrays.raised(darkest - sharp - NOISE * noise, 0.0)
        cell = tuple(max(side // CELLS, FEWEST) for side in psf.shape)
        wide = [WIDTH * side / own for side, own in zip(psf.shape, cell, strict=True)]
        impossible, changed = (
            ndimage.gaussian_filter(_in_cells(each * each, cell), wide, mode="nearest", truncate=3)
            for each in (below, change)
        )
        share = impossible / np.maximum(changed, NOTHING)
        kept = (self.tolerated / np.maximum(share, self.tolerated)) ** STEEPNESS
        kept = np.maximum(kept - LEAST, 0) / (1 - LEAST)
        spread = _spread(kept, tuple(plane.shape), cell).astype(arrays.dtype_name(plane))
        # so that what is kept as a whole stays the same, bit by bit
        result: FloatArray = sharp - (1 - arrays.like(spread, plane)) * change
        return result


def _in_cells(values: FloatArray, cell: tuple[int, ...]) -> FloatArray:
    """Means over cells, as an array of numpy; what remains at the ends goes to the last ones."""
    values = np.asarray(arrays.to_numpy(values), dtype=np.float64)
    for axis, side in enumerate(cell):
        count = max(values.shape[axis] // side, 1)
        starts = np.arange(count) * side
        lengths = np.diff([*starts, values.shape[axis]])
        shape = [-1 if each == axis else 1 for each in range(values.ndim)]
        values = np.add.reduceat(values, starts, axis=axis) / lengths.reshape(shape)
    return values


def _spread(values: FloatArray, shape: tuple[int, ...], cell: tuple[int, ...]) -> FloatArray:
    """Values of cells linearly between their middles, and constant beyond the outer ones."""
    for axis, (length, side) in enumerate(zip(shape, cell, strict=True)):
        place = (np.arange(length) + 0.5) / side - 0.5
        place = place.clip(0, values.shape[axis] - 1)
        before = np.minimum(place.astype(int), max(values.shape[axis] - 2, 0))
        after = np.minimum(before + 1, values.shape[axis] - 1)
        share = (place - before).reshape([-1 if each == axis else 1 for each in range(len(shape))])
        values = (1 - share) * values.take(before, axis) + share * values.take(after, axis)
    return values
