"""Blur that varies across the picture: overlapping windows, each with its own PSF."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil

import numpy as np

from .. import arguments
from .._typing import BoolArray, FloatArray
from ..errors import CrfDeblurError
from ..progress import Job, Progress, drain, reporting
from ..psf.field.base import PsfField
from ..psf.misfit import evenly, misfit
from .base import Deconvolver, check_method
from .noise import PlaneStatistics, measure
from .weights import checked_weights, guessed, of_plane

SMALLEST = 72  # pixels between windows; below, the overlap is most of the work
CHANGE = 1.5  # pixels that the ends of the PSF move from one window to the next
JUDGED = 64  # windows, at most, in which is looked what their PSFs leave unexplained
MARGIN = 2.0  # sides of the PSF around a window, of which nothing is kept, as around tiles


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """A part of a picture with weights that add up to 1 with those of its neighbors.

    Parameters
    ----------
    inner, outer : tuple of slice
        Where it has weight, and the same with a margin as far as the picture goes.
    weight : ndarray
        Of the pixels of `inner`.
    center : (float, float)
        Where its PSF is taken, (row, column) pixels.
    """

    inner: tuple[slice, slice]
    outer: tuple[slice, slice]
    weight: FloatArray
    center: tuple[float, float]

    @property
    def kept(self) -> tuple[slice, slice]:
        """Where in the outer part the inner one lies."""
        rows, columns = (
            slice(own.start - wide.start, own.stop - wide.start)
            for own, wide in zip(self.inner, self.outer, strict=True)
        )
        return rows, columns


def deconvolving_varying(
    linear: FloatArray,
    psfs: PsfField,
    method: Deconvolver,
    *,
    clipped: BoolArray | None = None,
    weights: FloatArray | None = None,
) -> Job[FloatArray]:
    """Job of :func:`deconvolve_varying`: reports progress, can be stopped."""
    linear = arguments.array(linear, "an image of float32 or float64")
    arguments.instance(psfs, PsfField, "a PsfField")
    check_method(method)
    if clipped is not None:
        clipped = arguments.array(clipped, "clipped pixels as bool", kinds=("bool",))
    _check(linear, psfs, clipped)
    weights = checked_weights(weights, linear)
    sharp = np.zeros_like(linear)
    windows = list(_windows(psfs))
    channels = list(np.ndindex(linear.shape[2:]))
    total = len(windows) * len(channels)
    for number, channel in enumerate(channels):
        plane = np.ascontiguousarray(linear[:, :, *channel])
        lost = None if clipped is None else clipped[:, :, *channel]
        worth = None if weights is None else of_plane(weights[:, :, *channel])
        plane = plane if worth is None else guessed(plane, worth)
        at = Progress("deconvolving windows", number * len(windows), total)
        statistics = yield from _judging(plane, psfs, windows, lost, at)
        for done, window in enumerate(windows):
            yield Progress("deconvolving windows", number * len(windows) + done, total)
            rows, columns = window.outer
            own = None if lost is None else np.ascontiguousarray(lost[rows, columns])
            restored = yield from reporting(
                method.run(
                    np.ascontiguousarray(plane[rows, columns]),
                    psfs.at(*window.center),
                    clipped=own,
                    weights=None if worth is None else np.ascontiguousarray(worth[rows, columns]),
                    statistics=statistics,
                ),
                Progress("deconvolving windows", number * len(windows) + done, total),
            )
            rows, columns = window.inner
            sharp[rows, columns, *channel] += window.weight * restored[window.kept]
    yield Progress("deconvolving windows", total, total)
    return sharp


def deconvolve_varying(
    linear: FloatArray,
    psfs: PsfField,
    method: Deconvolver,
    *,
    clipped: BoolArray | None = None,
    weights: FloatArray | None = None,
) -> FloatArray:
    """Undo a blur that varies across a linear image.

    The picture is cut into windows that overlap by half; each is restored with the PSF of its
    middle, and the results are added with weights that rise and fall linearly and are 1 in sum,
    so that nothing shows where windows meet (Nagy & O'Leary 1998, Restoring images degraded by
    spatially variant blur, Sec. 3; the sum of windows as in Hirsch et al. 2010, Efficient
    filter flow).

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C)
        Relative irradiance, float32 or float64.
    psfs : PsfField
        Of a picture of this shape.
    method : Deconvolver
        What is done with each window; the strength of its regularization is that of the whole.
    clipped : ndarray of bool, the shape of `linear`, optional
        True where the camera saturated.
    weights : ndarray, the shape of `linear`, optional
        What each pixel is worth, as for :func:`~.base.deconvolve`.

    Returns
    -------
    ndarray
        The shape and kind of `linear`.

    Raises
    ------
    ValueError
        The field is of a picture of another shape.
    CrfDeblurError
        Pixels that are not finite, or weights that are all zero.
    """
    return drain(deconvolving_varying(linear, psfs, method, clipped=clipped, weights=weights))


def _judging(
    plane: FloatArray,
    psfs: PsfField,
    windows: Sequence[_Window],
    clipped: BoolArray | None,
    at: Progress,
) -> Job[PlaneStatistics]:
    """Job: statistics of a whole plane, whose misfit is the median of those of its windows."""
    seen = (
        (plane[own.outer], psfs.at(*own.center), None if clipped is None else clipped[own.outer])
        for own in evenly(windows, JUDGED)
    )
    return replace(measure(plane), misfit=(yield from measuring_misfit(seen, at)))


def measuring_misfit(
    seen: Iterable[tuple[FloatArray, FloatArray, BoolArray | None]], at: Progress
) -> Job[float | None]:
    """Job: the median misfit of windows, of each its plane, PSF and clipped pixels."""
    found = []
    for plane, psf, lost in seen:
        yield at
        found.append(misfit([plane], psf, None if lost is None else [lost]))
    known = [each for each in found if each is not None]
    return float(np.median(known)) if known else None


def _windows(psfs: PsfField) -> Iterator[_Window]:
    margin = [ceil(MARGIN * side) for side in psfs.psfs.shape[2:]]
    axes = [
        list(spans(side, window_count(side, pace), wide))
        for side, pace, wide in zip(psfs.shape, psfs.pace, margin, strict=True)
    ]
    for (row, rows, wide_rows, down), (column, columns, wide_columns, across) in product(*axes):
        weight = np.outer(down, across).astype(np.float32)
        yield _Window((rows, columns), (wide_rows, wide_columns), weight, (row, column))


def window_count(side: int, pace: float) -> int:
    """Windows along an axis: where the PSF has changed there is the next, but none is too near."""
    return max(1, min(round(side / (CHANGE * pace) + 0.5), side // SMALLEST))


def spans(side: int, count: int, margin: int) -> Iterator[tuple[float, slice, slice, FloatArray]]:
    """Middle, pixels with weight, pixels with the margin, and weights of windows of an axis.

    Middles are the same distance apart, half of it from the borders; a weight falls from 1 at
    the middle of its window to 0 at those of its neighbors, and stays 1 to a border.
    """
    middles = (np.arange(count) + 0.5) * side / count - 0.5
    position = np.arange(side)
    for number, middle in enumerate(middles):
        points = np.arange(count) == number
        weight = np.interp(position, middles, points.astype(float))
        inside = np.flatnonzero(weight > 0)
        start, stop = int(inside[0]), int(inside[-1]) + 1
        wide = slice(max(start - margin, 0), min(stop + margin, side))
        yield float(middle), slice(start, stop), wide, weight[start:stop]


def _check(linear: FloatArray, psfs: PsfField, clipped: BoolArray | None) -> None:
    if linear.ndim not in (2, 3) or linear.shape[:2] != psfs.shape:
        raise ValueError(f"expected an image of {psfs.shape} as the PSFs, got {linear.shape}")
    if linear.dtype not in (np.float32, np.float64):
        raise ValueError(f"expected a linear image of float32 or float64, got {linear.dtype}")
    if clipped is not None and clipped.shape != linear.shape:
        raise ValueError(f"expected clipped pixels of shape {linear.shape}, got {clipped.shape}")
    if any(large > side for large, side in zip(psfs.psfs.shape[2:], psfs.shape, strict=True)):
        raise CrfDeblurError("the PSFs are larger than the image; give smaller ones")
    arguments.check_pixels(linear)
