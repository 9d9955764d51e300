"""Both ends of the path: undo the response of a photo, and apply it again."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ._typing import FloatArray, Image
from .photo import check_image, from_unit
from .response import ResponseCurve

Response: TypeAlias = ResponseCurve | Sequence[ResponseCurve]
"""One curve for all channels, or one for each."""

# Pixels worked on at a time: small enough to stay in the processor's cache.
BLOCK = 1 << 16
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
    """
    check_image(photo)
    if photo.dtype == np.float64:
        return _by_channel(
            photo, curve, np.float64, lambda c, x, out: _copy(c.to_irradiance(x), out)
        )
    if photo.dtype.kind == "u":
        return _by_channel(photo, curve, np.float32, _look_up_levels)
    single = photo.astype(np.float32, copy=False)
    return _by_channel(
        single, curve, np.float32, lambda c, x, out: _interpolate(c.to_irradiance, x, out)
    )


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
    """
    linear, dtype = np.asarray(linear), np.dtype(dtype)
    check_image(linear)
    if linear.dtype == np.float64:
        exact = _by_channel(
            linear, curve, np.float64, lambda c, x, out: _copy(c.to_intensity(x), out)
        )
        return from_unit(exact, dtype)
    single = linear.astype(np.float32, copy=False)
    if dtype == np.uint8:
        return _by_channel(single, curve, np.uint8, _look_up_intensity)
    interpolated = _by_channel(
        single, curve, np.float32, lambda c, x, out: _interpolate(c.to_intensity, x, out)
    )
    return from_unit(interpolated, dtype)


def clipped_share(linear: FloatArray) -> float:
    """Share of the values of light outside [0, 1], lost when the response is applied."""
    outside = np.count_nonzero(linear < 0) + np.count_nonzero(linear > 1)
    return float(outside / linear.size)


Apply: TypeAlias = Callable[[ResponseCurve, Image, Image], None]


def _by_channel(image: Image, curve: Response, dtype: DTypeLike, apply: Apply) -> Image:
    """Run `apply(curve, values, out)` on blocks of contiguous pixels, channel by channel."""
    out = np.empty(image.shape, dtype=dtype)
    if isinstance(curve, ResponseCurve):
        apply(curve, np.ascontiguousarray(image).reshape(-1), out.reshape(-1))
        return out
    channels = image.shape[2] if image.ndim == 3 else 1
    if len(curve) != channels:
        raise ValueError(
            f"expected one curve or {channels}, one for each channel, got {len(curve)}"
        )
    if image.ndim == 2:
        return _by_channel(image, curve[0], dtype, apply)
    for channel, own in enumerate(curve):
        out[..., channel] = _by_channel(image[..., channel], own, dtype, apply)
    return out


def _copy(values: Image, out: Image) -> None:
    out[...] = values


def _blocks(size: int) -> list[slice]:
    return [slice(start, min(start + BLOCK, size)) for start in range(0, size, BLOCK)]


def _look_up_levels(curve: ResponseCurve, levels: Image, out: Image) -> None:
    """Irradiance of every level that the integer kind can hold, then one look-up a pixel."""
    top = np.iinfo(levels.dtype).max
    table = curve.to_irradiance(np.arange(top + 1) / top).astype(np.float32)
    if levels.dtype == np.uint8:
        # Two neighbors in one look-up: a third less time.
        even = levels.size - levels.size % 2
        pairs = table[np.arange(1 << 16, dtype=np.uint16).view(np.uint8)].view(np.uint64)
        _look_up(pairs, levels[:even].view(np.uint16), out[:even].view(np.uint64))
        levels, out = levels[even:], out[even:]
    _look_up(table, levels, out)


def _look_up(table: Image, index: Image, out: Image) -> None:
    for block in _blocks(index.size):
        np.take(table, index[block], out=out[block], mode="clip")


def _knots(bits: int) -> tuple[NDArray[np.float32], int, int]:
    """Values whose float32 starts with each pattern of leading bits; the shift; the first."""
    shift = MANTISSA_BITS - bits
    one = int(np.float32(1).view(np.int32)) >> shift
    first = one - (OCTAVES << bits)
    patterns = np.arange(first, one + 1, dtype=np.int32) << shift
    return patterns.view(np.float32), shift, first


def _look_up_intensity(curve: ResponseCurve, irradiance: Image, out: Image) -> None:
    """8-bit intensity by the 13 leading bits: light exact to 2^-14, a 60th of a level."""
    knots, shift, first = _knots(bits=13)
    middles = np.append(knots[:-1] + np.diff(knots) / 2, knots[-1])
    middles[0] = 0
    # The table starts at pattern 0: its empty part costs less than a subtraction a pixel. As
    # integers, negative numbers are negative, and `clip` puts them in the darkest cell.
    table = np.zeros(first + middles.size, dtype=np.uint8)
    table[first:] = from_unit(curve.to_intensity(middles), np.uint8)
    pattern = np.empty(min(BLOCK, irradiance.size), dtype=np.int32)
    index = np.empty(pattern.size, dtype=np.intp)
    for block in _blocks(irradiance.size):
        cells = slice(block.stop - block.start)
        np.right_shift(irradiance[block].view(np.int32), shift, out=pattern[cells])
        index[cells] = pattern[cells]  # quicker than a shift with a cast
        np.take(table, index[cells], out=out[block], mode="clip")


def _interpolate(direction: Callable[[FloatArray], FloatArray], values: Image, out: Image) -> None:
    """Straight lines between knots a 1024th apart: exact to 1e-7 of the value for a gamma."""
    knots, shift, first = _knots(bits=10)
    levels = direction(knots)
    levels[0] = 0
    rise = np.append(np.diff(levels), 0) / (1 << shift)
    rise[0] = 0  # the first cell stands for all that is darker, 0 and negative values
    table, rise = levels.astype(np.float32), rise.astype(np.float32)
    for block in _blocks(values.size):
        pattern = values[block].view(np.int32)
        cell = (pattern >> shift) - np.int32(first)
        part = (pattern & ((1 << shift) - 1)).astype(np.float32)
        part *= np.take(rise, cell, mode="clip")
        np.add(np.take(table, cell, mode="clip"), part, out=out[block])
