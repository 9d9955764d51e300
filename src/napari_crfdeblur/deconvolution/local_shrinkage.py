"""Deconvolution that judges details by their neighborhood: texture kept, noise removed."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import prod
from typing import Any

import array_api_compat
import numpy as np

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..boundary import frame
from ..fourier import gradient_power
from ..progress import Job, Progress
from . import loops
from .noise import PlaneStatistics
from .recorded import recording
from .regularized import Regularized
from .splitting import solving

# Thresholds of the first stage, which keeps only what is large, and of the last: squares of a
# share of the contrast.
FIRST, LAST = 0.15, 4e-4
NORMS = (3, 2, 6)  # squared, of the filters (1, 1, 1), (-1, 0, 1) and (1, -2, 1)
SIDE = 5  # of the neighborhood
NOTHING = 1e-20  # energy, for contrast 1, that is none: what is not there is not shrunk
HALO = 4  # pixels that a filter, the neighborhood and the filter back reach
BLOCK = 1 << 16  # elements at a time; of a large plane more, since every block has a halo


@dataclass(frozen=True, slots=True)
class LocalShrinkage(Regularized):
    """Half-quadratic splitting with shrinkage by the energy of the neighborhood.

    The picture is seen through the filters `D_j` of the 3 x 3 discrete cosine transform but for
    the mean, in every position. Each stage shrinks what they see,

        ``v = d max(0, 1 - t / e)``, ``d = D_j x``, `e` the mean of ``d^2`` over 5 x 5 pixels,

    as Cai & Silverman (2001, Incorporating information on neighbouring coefficients into wavelet
    estimation, Sankhya B 63) do with wavelets, after James & Stein (1961): a faint detail
    remains if there are others around it, as in texture, and is taken for noise if it is alone.
    Then the picture that fits both the blurred one and `v` follows from one pair of transforms,

        ``x = argmin 1/2 |k * x - y|^2 + w / (2 t) sum_j |D_j x - v_j|^2``,

    the half-quadratic splitting of Geman & Yang (1995, Nonlinear image recovery with
    half-quadratic regularization). `t` falls from stage to stage, in equal ratios. Where noise
    grows with the light, `t` is larger in the light, by the noise level there. The plane
    is scaled to contrast 1 meanwhile, so that affine changes of the plane change the result
    alike.

    Parameters
    ----------
    weight : float, optional
        `w`, for a plane of contrast 1 (four standard deviations). By default it follows from
        the noise level and the errors of the plane.
    model_error : float, optional
        Least noise that is reckoned with, as a share of the contrast; by default measured.
    stages : int
        Values of `t`.
    """

    FACTOR = 0.15  # best on average over pictures, PSFs and noise of .002 to .03

    stages: int = 6

    def __post_init__(self) -> None:
        Regularized.__post_init__(self)
        arguments.step_count(self.stages, "a number of stages", least=2)

    def run(
        self,
        plane: FloatArray,
        psf: FloatArray,
        *,
        clipped: BoolArray | None = None,
        weights: FloatArray | None = None,
        statistics: PlaneStatistics | None = None,
    ) -> Job[FloatArray]:
        """Long job: deconvolve a plane or volume with a checked PSF."""
        total = 1 + 2 * self.stages
        reports = [Progress("local shrinkage", done, total) for done in range(total + 1)]
        yield reports[0]
        found, weight = self.judge(plane, psf, clipped, statistics)
        sharp, data = yield from recording(plane, psf, clipped, found.contrast, reports[0], weights)
        yield reports[1]
        filters = partial(_power, gradient_power(sharp.shape, sharp))
        scales = _noisiness(sharp, found)
        for stage, threshold in enumerate(np.geomspace(FIRST, LAST, self.stages).tolist()):
            before, middle, after = reports[1 + 2 * stage : 4 + 2 * stage]
            if stage > 0:
                yield from data.filling(sharp, before)
            pull = shrink(sharp, threshold, scales)
            yield middle
            sharp = yield from solving(data, pull, weight / threshold, filters, (middle, after))
        return sharp[frame(plane.shape)] * found.contrast


def shrink(plane: FloatArray, threshold: float, scales: FloatArray | None = None) -> FloatArray:
    """``sum_j D_j' v_j`` of a periodic plane, `v` its shrunk details, block by block.

    Parameters
    ----------
    plane : ndarray, shape (M, N) or (Z, M, N)
        `x`; not modified.
    threshold : float
        `t`.
    scales : ndarray, the shape of `plane`, optional
        Factors of `t`.
    """
    shape, plane = plane.shape, _lasting(plane)
    shrunk: FloatArray = arrays.empty_like(plane)
    factors = None if scales is None else _lasting(scales)
    if fused := loops.compiled(loops.shrink_details, plane):
        _shrink_compiled(fused, plane, threshold, factors, shrunk)
    else:
        _shrink_blocks(plane, threshold, factors, shrunk)
    result: FloatArray = arrays.namespace(plane).reshape(shrunk, shape)
    return result


def _shrink_compiled(
    fused: Callable[..., None],
    plane: FloatArray,
    threshold: float,
    factors: FloatArray | None,
    shrunk: FloatArray,
) -> None:
    """:func:`shrink` of a plane by its compiled loop, into `shrunk`."""
    factors = np.empty((0, 0), dtype=plane.dtype) if factors is None else factors
    shares = (1 / np.outer(NORMS, NORMS)).ravel().astype(plane.dtype)
    least, nothing = (plane.dtype.type(each) for each in (SIDE**2 * threshold, NOTHING))
    fused(plane, factors, least, shares, nothing, shrunk)


def _shrink_blocks(
    plane: FloatArray, threshold: float, factors: FloatArray | None, shrunk: FloatArray
) -> None:
    """:func:`shrink` block by block, into `shrunk`."""
    for block in arrays.row_blocks(plane.shape, _block_size(plane)):
        least: float | FloatArray = threshold
        if factors is not None:
            least = threshold * _around(factors, block, 1)
        shrunk[block, ...] = _through_filters(_around(plane, block, HALO), (), least)


def _lasting(plane: FloatArray) -> FloatArray:
    """View without the axes of one pixel, along which there are no details."""
    shape = tuple(side for side in plane.shape if side > 1) or (1,)
    view: FloatArray = arrays.namespace(plane).reshape(plane, shape)
    return view


def _noisiness(plane: FloatArray, statistics: PlaneStatistics) -> FloatArray | None:
    """Noise level of every pixel, over that of the picture; None if it is the same everywhere.

    Parameters
    ----------
    plane : ndarray
        Blurred and periodic, over the contrast.
    statistics : PlaneStatistics
        Of the picture.
    """
    model, mean = statistics.model, statistics.noise
    if model is None or model.gain == 0 or mean == 0:
        return None
    shape, plane = plane.shape, _lasting(plane)
    level: FloatArray = arrays.empty_like(plane)
    for block in arrays.row_blocks(plane.shape, _block_size(plane)):
        light = _around(plane, block, HALO)
        for _ in range(2):
            light = _neighborhood(light) / SIDE**light.ndim
        level[block, ...] = (model.variance(light * statistics.contrast) / mean**2) ** 0.5
    result: FloatArray = arrays.namespace(plane).reshape(level, shape)
    return result


def _block_size(plane: FloatArray) -> int:
    least = 4 * HALO * prod(plane.shape[1:])
    return max(least, BLOCK if arrays.is_numpy(plane) else arrays.DEVICE_BLOCK)


def _around(plane: FloatArray, block: slice, halo: int) -> FloatArray:
    """Rows of a periodic plane, with so many pixels more on all sides."""
    start, stop, side = block.start - halo, block.stop + halo, plane.shape[0]
    part: FloatArray = plane[max(start, 0) : min(stop, side), ...]
    if start < 0 or stop > side:
        part = arrays.take_rows(plane, np.arange(start, stop) % side)
    xp, device = arrays.namespace(plane), array_api_compat.device(plane)
    for axis, length in enumerate(plane.shape[1:], start=1):
        beside = np.arange(-halo, 0) % length, np.arange(halo) % length
        before, after = (xp.take(part, xp.asarray(i, device=device), axis=axis) for i in beside)
        part = xp.concat([before, part, after], axis=axis)
    return part


def _through_filters(
    part: FloatArray, orders: tuple[int, ...], threshold: float | FloatArray
) -> FloatArray:
    """Filter along the axes that are left, shrink, and filter back: the halo shorter.

    Parameters
    ----------
    part : ndarray
        Filtered along the axes before by the filters of these `orders`.
    """
    axis = len(orders)
    if axis == part.ndim:
        return _shrunk(part, prod(NORMS[order] for order in orders), threshold)
    mean_so_far = axis == part.ndim - 1 and not any(orders)
    total: FloatArray | None = None
    for order, filtered in _filtered(part, axis):
        if order == 0 and mean_so_far:
            continue
        details = _through_filters(filtered, (*orders, order), threshold)
        back = _filtered_back(details, axis, order)
        if total is None:
            total = back
        else:
            total += back
    assert total is not None  # there are at least two orders
    return total


def _neighbors(part: FloatArray, axis: int, count: int) -> Iterator[FloatArray]:
    """The part from each of `count` successive positions along an axis."""
    side = part.shape[axis] - count + 1
    for start in range(count):
        where: tuple[Any, ...] = (*(slice(None),) * axis, slice(start, start + side), ...)
        yield part[where]


def _filtered(part: FloatArray, axis: int) -> Iterator[tuple[int, FloatArray]]:
    """The filters of order 0, 1, 2 along an axis, not normalized."""
    before, here, after = _neighbors(part, axis, 3)
    total = before + after
    yield 0, total + here
    yield 1, after - before
    yield 2, total - 2 * here


def _filtered_back(part: FloatArray, axis: int, order: int) -> FloatArray:
    """The adjoint of one filter."""
    before, here, after = _neighbors(part, axis, 3)
    if order == 1:
        return before - after
    return before + after + (here if order == 0 else -2 * here)


def _shrunk(details: FloatArray, norm: float, threshold: float | FloatArray) -> FloatArray:
    """``d max(0, 1 - t / e) / norm``, for filters that are too large by the root of `norm`."""
    energy = _neighborhood(details * details)
    arrays.raise_to(energy, NOTHING)
    share: FloatArray = (-(SIDE**details.ndim) * threshold) / energy
    share += 1 / norm
    arrays.raise_to(share, 0)
    share *= details[(slice(2, -2),) * details.ndim]
    return share


def _neighborhood(values: FloatArray) -> FloatArray:
    """Sum over the 5 x 5 pixels around each."""
    for axis in range(values.ndim):
        first, second = _neighbors(values, axis, 2)
        pairs = first + second
        first, _, third = _neighbors(pairs, axis, 3)
        *_, fifth = _neighbors(values, axis, SIDE)
        inside: tuple[Any, ...] = (*(slice(None),) * axis, slice(fifth.shape[axis]), ...)
        values = (first + third)[inside]
        values += fifth
    return values


def _power(gradient: tuple[FloatArray, ...], block: slice) -> FloatArray:
    """``sum_j |D_j|^2``: what all filters keep together, less what the mean keeps."""
    mean: Any = 1.0
    axes, whole = len(gradient), 1.0
    for axis, each in enumerate(gradient):
        if each.shape[0] == 1:
            continue
        shape = (1,) * axis + (-1,) + (1,) * (axes - 1 - axis)
        along = (3 - each[block if axis == 0 else slice(None)]) ** 2 / 3
        mean, whole = mean * arrays.namespace(each).reshape(along, shape), 3 * whole
    power: FloatArray = whole - mean
    return power
