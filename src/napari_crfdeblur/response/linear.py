"""Both ends of the path: undo the response of a photo, and apply it again."""

from collections.abc import Callable, Iterable, Sequence
from itertools import count
from math import prod
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .. import arguments
from .._typing import FloatArray, Image
from ..arrays import row_blocks
from ..errors import CrfDeblurError
from ..photo import check_image, from_unit, photo_kind
from ..progress import Job, Progress, drain
from .base import ResponseCurve

Response: TypeAlias = ResponseCurve | Sequence[ResponseCurve]
"""One curve for all channels, or one for each."""

# Values worked on at a time: few enough to stay in the processor's cache.
BLOCK = 1 << 17
# A float32 from 2^-64 to 1 is its own position in a table: 23 bits of mantissa below an
# exponent, so that tables indexed by its leading bits are equally fine for dark and bright.
OCTAVES = 64
MANTISSA_BITS = 23


def linearize(photo: Image, curve: Response) -> FloatArray:
    """Undo the response: relative irradiance ``E = g(I)`` of a photo.

    Parameters
    ----------
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        uint8, uint16, or float in [0, 1] (values outside are clipped to it). A fourth channel
        is taken for light, too: leave out alpha.
    curve : ResponseCurve or sequence of C of them
        One response for all channels or one for each.

    Returns
    -------
    ndarray, the shape of `photo`
        In [0, 1]; float32, or float64 if the photo is.

    Raises
    ------
    ValueError
        Not an image, or another number of curves than of channels.
    CrfDeblurError
        Some pixels are NaN.
    """
    return drain(linearizing(photo, curve))


def linearizing(photo: Image, curve: Response) -> Job[FloatArray]:
    """Job of :func:`linearize`: reports progress, can be stopped."""
    check_image(photo)
    kind = np.float64 if photo.dtype == np.float64 else np.float32

    def light(own: ResponseCurve) -> Convert:
        if photo.dtype.kind == "u":
            return _level_table(own, photo.dtype)
        exact = kind is np.float64
        return _filling(own.to_irradiance if exact else _interpolation(own.to_irradiance))

    return (yield from _by_channel("linearizing", photo, curve, kind, light))


def reapply(linear: FloatArray, curve: Response, dtype: DTypeLike = np.float32) -> Image:
    """Apply the response: record light as a photo, ``I = f(E)``.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C)
        Relative irradiance, float; values outside [0, 1] are clipped to it.
    curve : ResponseCurve or sequence of C of them
        One response for all channels or one for each.
    dtype : data type
        Kind of the photo: uint8, uint16 or float.

    Returns
    -------
    ndarray, the shape of `linear`
        Of kind `dtype`, integers over their full scale, rounded to nearest.

    Raises
    ------
    CrfDeblurError
        Some pixels are NaN.
    """
    return drain(reapplying(linear, curve, dtype))


def reapplying(linear: FloatArray, curve: Response, dtype: DTypeLike = np.float32) -> Job[Image]:
    """Job of :func:`reapply`: reports progress, can be stopped."""
    linear, dtype = arguments.array(linear, "an image of floats"), photo_kind(dtype)
    check_image(linear)

    def record(own: ResponseCurve) -> Convert:
        exact = linear.dtype == np.float64
        if dtype == np.uint8 and not exact:
            return _intensity_table(own)
        intensity = own.to_intensity if exact else _interpolation(own.to_intensity)
        return _filling(lambda light: from_unit(intensity(light), dtype))

    return (yield from _by_channel("re-applying the response", linear, curve, dtype, record))


def clipped_share(linear: FloatArray) -> float:
    """Share of the values of light outside [0, 1], lost when the response is applied."""
    linear = arguments.array(linear, "light as an array", finite=True)
    if linear.size == 0:
        raise arguments.refusal("light in at least one pixel", linear)
    outside = np.count_nonzero(linear < 0) + np.count_nonzero(linear > 1)
    return float(outside / linear.size)


Convert: TypeAlias = Callable[[Image, Image], None]
"""Fills a block of the result from one of the image, both contiguous, of shape (N,)."""


def _by_channel(
    stage: str,
    image: Image,
    curve: Response,
    dtype: DTypeLike,
    prepare: Callable[[ResponseCurve], Convert],
) -> Job[Image]:
    """Job: convert an image by `prepare(curve)`, channel by channel and block by block."""
    out = np.empty(image.shape, dtype=dtype)
    parts = list(_parts(image, out, curve))
    blocks = list(row_blocks((len(image), max(1, prod(parts[0][1].shape[1:]))), BLOCK))
    reports = (Progress(stage, done, len(parts) * len(blocks)) for done in count())
    yield next(reports)
    for own, source, target in parts:
        convert = prepare(own)
        for rows in blocks:
            part = target[rows]
            result = np.ascontiguousarray(part).reshape(-1)  # itself, unless of one channel
            values = np.ascontiguousarray(source[rows]).reshape(-1)
            if values.dtype.kind == "f" and np.isnan(values).any():
                raise CrfDeblurError(
                    "the image has pixels that are not a number (NaN); replace them first"
                )
            convert(values, result)
            if not part.flags.c_contiguous:
                part[...] = result.reshape(part.shape)
            yield next(reports)
    return out


def _parts(
    image: Image, out: Image, curve: Response
) -> Iterable[tuple[ResponseCurve, Image, Image]]:
    """All channels with the one curve, or each with its own; and where their result goes."""
    if isinstance(curve, ResponseCurve):
        return [(curve, image, out)]
    arguments.instances(curve, ResponseCurve, "a response curve, or one for each channel")
    channels = image.shape[2] if image.ndim == 3 else 1
    if len(curve) != channels:
        raise ValueError(
            f"expected one curve or {channels}, one for each channel, got {len(curve)}"
        )
    if image.ndim == 2:
        return [(curve[0], image, out)]
    return zip(curve, np.moveaxis(image, -1, 0), np.moveaxis(out, -1, 0), strict=True)


def _filling(function: Callable[[Image], Image]) -> Convert:
    def convert(values: Image, out: Image) -> None:
        out[...] = function(values)

    return convert


def _level_table(curve: ResponseCurve, dtype: np.dtype[Any]) -> Convert:
    """Irradiance of every level that the integer kind can hold: one look-up a pixel."""
    top = np.iinfo(dtype).max
    table = curve.to_irradiance(np.arange(top + 1) / top).astype(np.float32)
    if dtype != np.uint8:
        return lambda levels, out: _look_up(table, levels, out)
    # Two neighbors in one look-up: a third less time.
    pairs = table[np.arange(1 << 16, dtype=np.uint16).view(np.uint8)].view(np.uint64)

    def convert(levels: Image, out: Image) -> None:
        even = levels.size - levels.size % 2
        _look_up(pairs, levels[:even].view(np.uint16), out[:even].view(np.uint64))
        _look_up(table, levels[even:], out[even:])

    return convert


def _look_up(table: Image, index: Image, out: Image) -> None:
    np.take(table, index, out=out, mode="clip")


def _knots(bits: int) -> tuple[NDArray[np.float32], int, int]:
    """Values whose float32 starts with each pattern of leading bits; the shift; the first."""
    shift = MANTISSA_BITS - bits
    one = int(np.float32(1).view(np.int32)) >> shift
    first = one - (OCTAVES << bits)
    patterns = np.arange(first, one + 1, dtype=np.int32) << shift
    return patterns.view(np.float32), shift, first


def _intensity_table(curve: ResponseCurve) -> Convert:
    """8-bit intensity by the 13 leading bits: light exact to 2^-14, a 60th of a level."""
    knots, shift, first = _knots(bits=13)
    middles = np.append(knots[:-1] + np.diff(knots) / 2, knots[-1])
    middles[0] = 0
    # The table starts at pattern 0: its empty part costs less than a subtraction a pixel. As
    # integers, negative numbers are negative, and `clip` puts them in the darkest cell.
    table = np.zeros(first + middles.size, dtype=np.uint8)
    table[first:] = from_unit(curve.to_intensity(middles), np.uint8)

    def convert(light: Image, out: Image) -> None:
        pattern = light.astype(np.float32, copy=False).view(np.int32)
        _look_up(table, pattern >> shift, out)

    return convert


def _interpolation(
    direction: Callable[[FloatArray], FloatArray],
) -> Callable[[FloatArray], FloatArray]:
    """Straight lines between knots a 1024th apart: exact to 1e-7 of the value for a gamma."""
    knots, shift, first = _knots(bits=10)
    levels = direction(knots)
    levels[0] = 0
    rise = np.append(np.diff(levels), 0) / (1 << shift)
    rise[0] = 0  # the first cell stands for all that is darker, 0 and negative values
    table, rise = levels.astype(np.float32), rise.astype(np.float32)

    def interpolate(values: FloatArray) -> FloatArray:
        pattern = values.astype(np.float32, copy=False).view(np.int32)
        cell = ((pattern >> shift) - np.int32(first)).astype(np.intp)
        part = (pattern & ((1 << shift) - 1)).astype(np.float32)
        part *= rise.take(cell, mode="clip")
        part += table.take(cell, mode="clip")
        return part

    return interpolate
