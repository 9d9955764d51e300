"""What functions are given, checked: "expected ..., got ..." for all that they cannot take.

Public functions and constructors check by these what they are given, so that it fails there and
in words, not deep inside. `what` names the argument as the message does: "a weight", "an image
(M, N)". All raise ValueError, unless they say otherwise.
"""

from collections.abc import Collection, Sequence
from math import inf, isfinite
from numbers import Integral, Real
from pathlib import Path
from reprlib import Repr
from typing import Any, TypeVar

import array_api_compat
import numpy as np

from ._typing import FloatArray
from .errors import CrfDeblurError

T = TypeVar("T")
REAL = ("bool", "int", "uint", "float")  # what names of data types of real numbers begin with
SHOWN = 80  # characters of a value in a message
# Steps of an iteration: more than any needs to converge, and few enough for small arrays to end.
MOST_STEPS = 10_000
LARGEST = 1e9  # value of a pixel: sums of squares stay within single precision
_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = SHOWN


def refusal(what: str, got: object) -> ValueError:
    """The error that says what was expected, and what came."""
    return ValueError(f"expected {what}, got {abridged(got)}")


def abridged(value: object) -> str:
    """A value as messages show it: short, and arrays by their shape and kind."""
    if array_api_compat.is_array_api_obj(value):
        return f"an array {tuple(getattr(value, 'shape', ()))} of {getattr(value, 'dtype', '?')}"
    return _SHORT.repr(value)[:SHOWN]


def instance(value: T, kind: type | tuple[type, ...], what: str) -> T:
    """The value, if it is an instance of a class."""
    if not isinstance(value, kind):
        raise refusal(what, value)
    return value


def instances(values: Sequence[T], kind: type | tuple[type, ...], what: str) -> Sequence[T]:
    """The values, if they are a sequence of instances of a class."""
    if not isinstance(values, Sequence) or isinstance(values, (str, bytes)):
        raise refusal(what, values)
    for value in values:
        instance(value, kind, what)
    return values


def path(value: str | Path, what: str = "the name of a file") -> Path:
    """The path, if the value is one or a text."""
    return Path(instance(value, (str, Path), what))


def number(
    value: Any,
    what: str,
    *,
    least: float = -inf,
    above: float = -inf,
    most: float = inf,
    below: float = inf,
) -> float:
    """The value, if it is a finite real number within bounds."""
    known = isinstance(value, Real) and not isinstance(value, bool) and _finite(value)
    if not (known and least <= value <= most and above < value < below):
        raise refusal(what + _within(least, above, most, below), value)
    return value  # type: ignore[no-any-return]  # as it came: an int stays one


def whole(value: Any, what: str, *, least: float = -inf, most: float = inf) -> int:
    """The value, if it is a whole number within bounds."""
    known = isinstance(value, Integral) and not isinstance(value, bool)
    if not (known and least <= value <= most):
        raise refusal(what + _within(least, -inf, most, inf), value)
    return int(value)


def step_count(value: Any, what: str, *, least: int = 1, most: float = MOST_STEPS) -> int:
    """The value, if it is a number of steps that end some time."""
    return whole(value, what, least=least, most=most)


def odd(value: Any, what: str, *, most: float = inf) -> int:
    """The value, if it is an odd whole number of at least 3: a size of a PSF."""
    side = whole(value, f"an odd {what}", least=3, most=most)
    if side % 2 == 0:
        raise refusal(f"an odd {what}", value)
    return side


def _finite(value: Any) -> bool:
    try:
        return isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False


def _within(least: float, above: float, most: float, below: float) -> str:
    """Bounds in words."""
    bounds = ((" of at least", least), (" above", above), (" at most", most), (" below", below))
    return " and".join(f"{word} {bound:.9g}" for word, bound in bounds if abs(bound) < inf)


def numbers(
    values: object,
    what: str,
    *,
    count: int | None = None,
    least: float = -inf,
    most: float = inf,
) -> tuple[float, ...]:
    """The values as a tuple, if they are finite real numbers within bounds, `count` of them."""
    found = array(values, what + _within(least, -inf, most, inf), axes=(1,), finite=True)
    if count not in (None, len(found)) or not all(least <= value <= most for value in found):
        raise refusal(what + _within(least, -inf, most, inf), values)
    return tuple(found.tolist())


def array(
    values: Any,
    what: str,
    *,
    axes: Collection[int] = (),
    kinds: Collection[str] = REAL,
    finite: bool = False,
) -> Any:
    """The values as an array of numpy, or of another library as they are; not copied.

    Parameters
    ----------
    values : array_like
        Any array of numpy, torch, cupy, or nested sequences.
    what : str
        What is expected, in words.
    axes : collection of int
        How many axes it can have; by default any number.
    kinds : collection of str
        What the names of its data types can begin with.
    finite : bool
        Whether infinity and NaN are refused.
    """
    try:
        found: Any = values if array_api_compat.is_array_api_obj(values) else np.asarray(values)
    except (TypeError, ValueError):  # numpy cannot make an array of it
        raise refusal(what, values) from None
    fits = kind_of(found).startswith(tuple(kinds)) and (not axes or found.ndim in axes)
    if not fits or isinstance(found, np.ma.MaskedArray):  # whose masks most functions forget
        raise refusal(what, values if found.ndim == 0 else found)
    if finite and not is_finite(found):
        raise ValueError(f"expected finite values of {what}, got some that are NaN or infinite")
    return found


def kept(values: object, what: str, *, axes: Collection[int] = ()) -> FloatArray:
    """A read-only copy in float64, if the values are finite real numbers."""
    own = np.array(array(values, what, axes=axes, finite=True), dtype=np.float64)
    own.setflags(write=False)
    return own


def addable(values: object, what: str) -> FloatArray:
    """The values in float64, if they are real numbers whose sum does not overflow.

    Those that are not finite are left for others to refuse.
    """
    found = np.asarray(array(values, what), dtype=np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        overflows = np.isfinite(found).all() and not np.isfinite(found.sum())
    if overflows:
        raise ValueError(f"expected {what} whose sum is finite, got values up to {found.max():g}")
    return found


def kind_of(values: Any) -> str:
    """Name of a data type in all libraries: ``float32``, or ``uint8``."""
    dtype = values.dtype
    return str(dtype.name if isinstance(dtype, np.dtype) else dtype).rpartition(".")[2]


def is_finite(values: Any) -> bool:
    """Whether no value of an array of any library is infinite or NaN."""
    if kind_of(values).startswith("float"):
        xp = array_api_compat.array_namespace(values)
        return bool(xp.all(xp.isfinite(values)))
    return True


def check_pixels(image: Any) -> None:
    """Raise CrfDeblurError for a picture with pixels that nothing can be made of.

    Infinite ones, NaN, and those so large that sums of their squares would overflow.
    """
    if not kind_of(image).startswith("float") or 0 in image.shape:
        return
    xp = array_api_compat.array_namespace(image)
    low, high = float(xp.min(image)), float(xp.max(image))
    if not (isfinite(low) and isfinite(high)):
        raise CrfDeblurError(
            "the image has pixels that are not finite (NaN or infinity); replace them first"
        )
    if max(-low, high) > LARGEST:
        raise CrfDeblurError(
            f"the image has values from {low:.4g} to {high:.4g}; divide a floating-point image by "
            "its full scale, so that it lies in [0, 1]"
        )
