"""Fast convolution: sizes that transform fast, transfer functions, transforms of planes.

Planes and volumes, arrays of numpy and of other libraries alike.
"""

from functools import lru_cache
from math import prod
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray
from scipy import fft

from . import arrays
from ._typing import FloatArray
from .progress import Job, Progress, drain

ComplexArray: TypeAlias = NDArray[np.complexfloating[Any]]
Shape: TypeAlias = tuple[int, int]
Sides = TypeVar("Sides", bound=tuple[int, ...])
Kind: TypeAlias = FloatArray | DTypeLike
"""An array to be like, in kind, precision and device; or a data type, for numpy's arrays."""

LARGEST_KEPT = 1 << 21  # pixels of a plane whose transfer function is kept: 8 MB in float32


def fast_shape(shape: Sides) -> Sides:
    """Smallest shape that is at least `shape` and transforms fast as real numbers."""
    return type(shape)(fft.next_fast_len(side, real=True) for side in shape)


def forward(plane: FloatArray) -> ComplexArray:
    """Transform of a real plane (M, N): its half spectrum, (M, N // 2 + 1); volumes likewise."""
    spectrum: ComplexArray = arrays.rfftn(plane)
    return spectrum


def inverse(spectrum: ComplexArray, shape: tuple[int, ...]) -> FloatArray:
    """Real plane of the given shape whose half spectrum this is; overwrites `spectrum`."""
    plane: FloatArray = arrays.irfftn(spectrum, shape)
    return plane


def kept_otf(psf: FloatArray, shape: tuple[int, ...], kind: FloatArray) -> ComplexArray:
    """The same as :func:`otf`, computed once for all tiles or slices of one shape; read-only."""
    if prod(shape) > LARGEST_KEPT or not arrays.is_numpy(kind):
        return otf(psf, shape, kind)
    return _kept(psf.tobytes(), psf.dtype, psf.shape, tuple(shape), kind.dtype)


@lru_cache(maxsize=4)  # tiles in the middle and at borders
def _kept(
    values: bytes,
    precision: np.dtype[Any],
    sides: tuple[int, ...],
    shape: tuple[int, ...],
    kind: np.dtype[Any],
) -> ComplexArray:
    transfer = otf(np.frombuffer(values, precision).reshape(sides), shape, kind)
    transfer.flags.writeable = False
    return transfer


def otf(psf: FloatArray, shape: tuple[int, ...], kind: Kind = np.float32) -> ComplexArray:
    """Optical transfer function of a PSF for planes of `shape`.

    The pixel ``side // 2`` of the PSF is the origin, so that multiplying a half spectrum by
    it is a circular convolution that does not shift the picture.
    """
    kernel = arrays.zeros(shape, kind)
    kernel[tuple(slice(side) for side in psf.shape)] = arrays.like(psf, kind)
    shift = tuple(-(side // 2) for side in psf.shape)
    return forward(arrays.namespace(kernel).roll(kernel, shift, axis=tuple(range(psf.ndim))))


def gradient_power(shape: tuple[int, ...], kind: Kind = np.float32) -> tuple[FloatArray, ...]:
    """Power of the forward differences along each axis, as a vector each.

    ``4 sin^2(pi u)``, `u` in cycles per pixel; the last is for the half spectrum of planes of
    `shape`. :func:`laplacian_power` adds them up.
    """
    frequencies = [fft.fftfreq(side) for side in shape[:-1]] + [fft.rfftfreq(shape[-1])]
    return tuple(arrays.like(4 * np.sin(np.pi * each) ** 2, kind) for each in frequencies)


def laplacian_power(powers: tuple[FloatArray, ...], block: slice = slice(None)) -> FloatArray:
    """``|D|^2``, the sum over the axes of what :func:`gradient_power` gives: rows `block`."""
    along = arrays.namespace(powers[-1])
    total: FloatArray = powers[-1]
    for count, each in enumerate(reversed(powers[1:-1]), start=1):
        total = along.reshape(each, (-1,) + (1,) * count) + total
    total = along.reshape(powers[0][block], (-1,) + (1,) * (len(powers) - 1)) + total
    return total


def power(spectrum: ComplexArray) -> FloatArray:
    """Squared magnitude of a spectrum, without the square root that ``abs`` would take."""
    xp = arrays.namespace(spectrum)
    squared: FloatArray = xp.square(xp.real(spectrum))
    squared += xp.square(xp.imag(spectrum))
    return squared


def multiply_conjugate(spectrum: ComplexArray, transfer: ComplexArray) -> None:
    """Multiply a spectrum by the conjugate of another, in place."""
    xp = arrays.namespace(spectrum)
    for block in arrays.blocks(spectrum):
        spectrum[block, ...] *= xp.conj(transfer[block, ...])


def convolve(plane: FloatArray, transfer: ComplexArray) -> FloatArray:
    """Circular convolution of a plane with the PSF of this transfer function."""
    return drain(convolving(plane, transfer, Progress("convolution", 0, 1)))


def convolving(plane: FloatArray, transfer: ComplexArray, at: Progress) -> Job[FloatArray]:
    """Job of :func:`convolve`: reports `at` between its transforms."""
    spectrum = forward(plane)
    yield at
    spectrum *= transfer
    return inverse(spectrum, plane.shape)


def correlate(plane: FloatArray, transfer: ComplexArray) -> FloatArray:
    """Circular correlation with the PSF: the adjoint of :func:`convolve`."""
    return drain(correlating(plane, transfer, Progress("correlation", 0, 1)))


def correlating(plane: FloatArray, transfer: ComplexArray, at: Progress) -> Job[FloatArray]:
    """Job of :func:`correlate`: reports `at` between its transforms."""
    spectrum = forward(plane)
    yield at
    multiply_conjugate(spectrum, transfer)
    return inverse(spectrum, plane.shape)
