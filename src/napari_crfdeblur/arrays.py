"""Arrays of numpy, torch, cupy: one way to work on all of them.

What is written with operators, slices and :func:`namespace` runs on every kind of array that
follows the array API standard, on its own device. Here is the rest: where numpy has a faster
way, and how arrays of one kind become another.
"""

from collections.abc import Iterator
from math import prod
from typing import Any

import array_api_compat
import numpy as np
from scipy import fft

from ._typing import FloatArray

BLOCK = 1 << 16  # elements that are worked on at a time, so that they stay in the cache
DEVICE_BLOCK = 1 << 24  # elsewhere every step costs a launch: enough to hide it


def namespace(array: Any) -> Any:
    """Functions of the array API for arrays of this kind."""
    return array_api_compat.array_namespace(array)


def is_numpy(array: Any) -> bool:
    """Whether numpy can work on it directly."""
    return isinstance(array, np.ndarray)


def as_array(values: Any) -> Any:
    """An array as it is; anything else as an array of numpy."""
    return values if array_api_compat.is_array_api_obj(values) else np.asarray(values)


def to_numpy(array: Any) -> Any:
    """The array in the memory of the processor, as numpy's."""
    if is_numpy(array):
        return array
    if array_api_compat.is_cupy_array(array):
        return array.get()
    return np.asarray(array_api_compat.to_device(array, "cpu") if _elsewhere(array) else array)


def _elsewhere(array: Any) -> bool:
    return array_api_compat.is_torch_array(array) and array.device.type != "cpu"


def _of_numpy(kind: Any) -> Any:
    """Data type, if this stands for arrays of numpy: one of them, or a data type; or None."""
    if is_numpy(kind):
        return kind.dtype
    # numpy's data types are classes, or instances that look like arrays in nothing but `shape`
    return kind if isinstance(kind, (type, str, np.dtype)) else None


def like(values: Any, kind: Any) -> Any:
    """Values of numpy as an array of another's kind, precision and device.

    Parameters
    ----------
    values : ndarray
        What is to be converted.
    kind : array or data type
        A real array to be like; a data type stands for numpy's arrays of it.
    """
    if dtype := _of_numpy(kind):
        return np.asarray(values, dtype=dtype)
    xp = namespace(kind)
    # as float64, which every library takes over, before it is given the precision
    whole = xp.asarray(np.ascontiguousarray(values), device=array_api_compat.device(kind))
    return xp.astype(whole, kind.dtype)


def zeros(shape: tuple[int, ...], kind: Any) -> Any:
    """Zeros of another array's kind, precision and device, or of a data type of numpy."""
    if dtype := _of_numpy(kind):
        return np.zeros(shape, dtype=dtype)
    device = array_api_compat.device(kind)
    return namespace(kind).zeros(shape, dtype=kind.dtype, device=device)


def empty_like(array: Any) -> Any:
    """An array of the same shape and kind, with any values."""
    return np.empty_like(array) if is_numpy(array) else namespace(array).empty_like(array)


def copy(array: Any) -> Any:
    """An array of the same values, its own memory."""
    return array.copy() if is_numpy(array) else namespace(array).asarray(array, copy=True)


def contiguous(array: Any) -> Any:
    """The array with its elements side by side; a view of numpy's is copied."""
    if is_numpy(array):
        return np.ascontiguousarray(array)
    return copy(array)


def rfftn(array: Any) -> Any:
    """Transform of a real array along all axes: its half spectrum."""
    if is_numpy(array):
        return fft.rfftn(array)
    return namespace(array).fft.rfftn(array)


def irfftn(spectrum: Any, shape: tuple[int, ...]) -> Any:
    """Real array of the given shape with this half spectrum, which can be overwritten."""
    if is_numpy(spectrum):
        # in place but for the last axis: irfftn would copy the spectrum, which at 12 megapixels
        # takes two fifths of its time
        spectrum = fft.ifftn(spectrum, axes=tuple(range(len(shape) - 1)), overwrite_x=True)
        return fft.irfft(spectrum, n=shape[-1], overwrite_x=True)
    axes = tuple(range(len(shape)))
    return namespace(spectrum).fft.irfftn(spectrum, s=tuple(shape), axes=axes)


def row_blocks(shape: tuple[int, ...], size: int) -> Iterator[slice]:
    """Slices of the first axis, of about `size` elements or of one row."""
    height = max(1, size // max(1, prod(shape[1:])))
    for start in range(0, shape[0], height):
        yield slice(start, min(start + height, shape[0]))


def blocks(array: Any) -> Iterator[slice]:
    """Slices of the first axis that fit the cache, for a series of elementwise steps."""
    return row_blocks(array.shape, BLOCK if is_numpy(array) else DEVICE_BLOCK)


def dot(first: Any, second: Any) -> float:
    """Sum of the products of two real arrays of one shape."""
    if is_numpy(first):
        return float(np.vdot(first, second))
    return float(namespace(first).sum(first * second))


def norm(array: Any) -> float:
    """Root of the sum of squares."""
    return float(dot(array, array) ** 0.5)


def subtract(first: Any, second: Any, out: Any) -> None:
    """``out[...] = first - second`` without an array in between, where numpy allows it."""
    if is_numpy(out):
        np.subtract(first, second, out=out)
    else:
        out[...] = first - second


def raise_to(array: Any, least: float) -> None:
    """Raise what is smaller to `least`, in place."""
    if is_numpy(array):
        np.maximum(array, least, out=array)
    else:
        array[...] = namespace(array).clip(array, min=least)


def raised(array: Any, least: float) -> Any:
    """The array, what is smaller raised to `least`."""
    return np.maximum(array, least) if is_numpy(array) else namespace(array).clip(array, min=least)


def take_rows(array: Any, rows: FloatArray) -> Any:
    """Rows of the first axis by their numbers, an array of numpy."""
    if is_numpy(array):
        return array.take(rows, axis=0)
    xp = namespace(array)
    index = xp.asarray(rows, device=array_api_compat.device(array))
    return xp.take(array, index, axis=0)


def look_up(table: FloatArray, position: Any) -> Any:
    """Entries of a table of numpy's, in the kind of `position`: its cell, clipped to the last.

    Parameters
    ----------
    table : ndarray, shape (N,)
        The entries, in the precision of `position`.
    position : array
        Cells as floats of 0 or more, rounded down; overwritten.
    """
    if is_numpy(position):
        return table.take(position.astype(np.intp), mode="clip")
    xp = namespace(position)
    cell = xp.astype(xp.clip(position, max=len(table) - 1.0), xp.int64)
    return xp.reshape(xp.take(like(table, position), xp.reshape(cell, (-1,))), cell.shape)


def dtype_name(kind: Any) -> str:
    """``float32`` or the like, for arrays of every kind."""
    return str(kind.dtype).rpartition(".")[2]


def divide(first: Any, second: Any, out: Any) -> None:
    """``out[...] = first / second`` without an array in between, where numpy allows it."""
    if is_numpy(out):
        np.divide(first, second, out=out)
    else:
        out[...] = first / second


def mean(array: Any) -> float:
    """Mean, added up in double precision."""
    xp = namespace(array)
    return float(xp.sum(array, dtype=xp.float64) / prod(array.shape))
