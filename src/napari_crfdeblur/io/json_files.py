"""JSON that others have written: read whole within limits, or refused in a sentence."""

import json
from collections.abc import Iterator
from math import isfinite
from pathlib import Path
from typing import Any

from ..errors import CrfDeblurError
from ..texts import brief
from .inputs import read_bytes
from .limits import LIMITS, Limits

WHOLE = 10**300  # all whole numbers below are finite as floats
DIGITS = len(str(WHOLE))


def read_json(path: Path, *, limits: Limits = LIMITS) -> Any:
    """Read a JSON file.

    Parameters
    ----------
    path : Path
        UTF-8.
    limits : Limits, optional
        For its size and nesting.

    Returns
    -------
    object
        None, bool, int below 1e300, finite float, str, list or dict of such.

    Raises
    ------
    CrfDeblurError
        Missing, too large, not JSON, nested too deeply; with numbers that are not finite or too
        large, or an object that has a key twice.
    """
    content = read_bytes(path, limits.json)
    try:
        return parse_json(content, limits=limits)
    except ValueError as error:
        raise CrfDeblurError(
            f"{path}: not a JSON file, or damaged ({brief(error)}); get a whole copy, or make "
            "it again"
        ) from error


def parse_json(content: bytes | str, *, limits: Limits = LIMITS) -> Any:
    """What a JSON text holds, as :func:`read_json` returns it.

    Raises
    ------
    ValueError
        Not JSON, or beyond the limits.
    """
    text = content if isinstance(content, str) else content.decode("utf-8-sig")
    try:
        found = json.loads(
            text,
            object_pairs_hook=_object,
            parse_int=_whole,
            parse_float=_number,
            parse_constant=_no_number,
        )
    except RecursionError as error:
        raise ValueError(_too_deep(limits)) from error
    check_values(found, limits=limits)
    return found


def check_values(content: object, *, limits: Limits = LIMITS) -> None:
    """Raise ValueError for lists and objects nested too deeply, and for numbers too large."""
    open_ones: list[Iterator[object]] = [iter((content,))]
    while open_ones:
        if len(open_ones) > limits.nesting + 1:
            raise ValueError(_too_deep(limits))
        for each in open_ones[-1]:
            if isinstance(each, dict | list | tuple):
                open_ones.append(iter(each.values() if isinstance(each, dict) else each))
                break
            if isinstance(each, float) and not isfinite(each):
                raise ValueError(f"{each} is no number of JSON")
            if isinstance(each, int) and not -WHOLE < each < WHOLE:
                raise ValueError("a whole number beyond 1e300")
        else:
            open_ones.pop()


def number_list(values: object) -> list[float]:
    """A list of numbers as it is.

    Raises
    ------
    ValueError
        Anything else.
    """
    if not isinstance(values, list) or not all(type(each) in (int, float) for each in values):
        raise ValueError("expected a list of numbers")
    return values


def _too_deep(limits: Limits) -> str:
    return f"more than {limits.nesting} lists and objects within each other"


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("an object has a key twice")
    return found


def _whole(text: str) -> int:
    if len(text) > DIGITS:
        raise ValueError(f"a whole number of {len(text)} digits")
    return int(text)


def _number(text: str) -> float:
    number = float(text)
    if not isfinite(number):
        raise ValueError(f"{text[:20]} is too large a number")
    return number


def _no_number(text: str) -> float:
    raise ValueError(f"{text} is no number of JSON")
