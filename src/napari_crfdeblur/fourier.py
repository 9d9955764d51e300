"""Fast convolution: sizes that transform fast, transfer functions, transforms of planes."""

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray
from scipy import fft

from ._typing import FloatArray
from .progress import Job, Progress, drain

ComplexArray: TypeAlias = NDArray[np.complexfloating[Any]]
Shape: TypeAlias = tuple[int, int]

BLOCK = 1 << 16  # elements that are worked on at a time, so that they stay in the cache


def fast_shape(shape: Shape) -> Shape:
    """Smallest shape that is at least `shape` and transforms fast as real numbers."""
    rows, columns = shape
    return fft.next_fast_len(rows, real=True), fft.next_fast_len(columns, real=True)


def forward(plane: FloatArray) -> ComplexArray:
    """Transform of a real plane (M, N): its half spectrum, (M, N // 2 + 1)."""
    spectrum: ComplexArray = fft.rfft2(plane)
    return spectrum


def inverse(spectrum: ComplexArray, shape: Shape) -> FloatArray:
    """Real plane of the given shape whose half spectrum this is; overwrites `spectrum`."""
    plane: FloatArray = fft.irfft2(spectrum, s=shape, overwrite_x=True)
    return plane


def otf(psf: FloatArray, shape: Shape, dtype: DTypeLike = np.float32) -> ComplexArray:
    """Optical transfer function of a PSF for planes of `shape`, in the precision of `dtype`.

    The pixel ``side // 2`` of the PSF is the origin, so that multiplying a half spectrum by
    it is a circular convolution that does not shift the picture.
    """
    kernel = np.zeros(shape, dtype=dtype)
    kernel[: psf.shape[0], : psf.shape[1]] = psf
    return forward(np.roll(kernel, [-(side // 2) for side in psf.shape], axis=(0, 1)))


def gradient_power(shape: Shape, dtype: DTypeLike = np.float32) -> tuple[FloatArray, FloatArray]:
    """Power of the forward differences, ``|D|^2 = rows[:, None] + columns``, as two vectors.

    ``4 sin^2(pi u)`` along either axis, `u` in cycles per pixel; `columns` is for the half
    spectrum of planes of `shape`.
    """
    rows = 4 * np.sin(np.pi * fft.fftfreq(shape[0])) ** 2
    columns = 4 * np.sin(np.pi * fft.rfftfreq(shape[1])) ** 2
    return rows.astype(dtype), columns.astype(dtype)


def power(spectrum: ComplexArray) -> FloatArray:
    """Squared magnitude of a spectrum, without the square root that ``abs`` would take."""
    squared: FloatArray = np.square(spectrum.real)
    squared += np.square(spectrum.imag)
    return squared


def row_blocks(shape: tuple[int, ...], size: int = BLOCK) -> Iterator[slice]:
    """Rows of a plane in blocks that fit the cache, for a series of elementwise steps."""
    height = max(1, size // shape[1])
    for start in range(0, shape[0], height):
        yield slice(start, min(start + height, shape[0]))


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
    for block in row_blocks(spectrum.shape):
        spectrum[block] *= np.conj(transfer[block])
    return inverse(spectrum, plane.shape)
