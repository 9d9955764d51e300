"""What the guard has done to a picture, in words."""

from enum import Enum

import numpy as np

from .. import arguments
from .._typing import FloatArray
from .trust import Trust

NOTICED = 0.02  # share of a picture in which a result can be taken back without a word
NEARLY_ALL = 0.9  # share of a picture from which it is the whole
# Thirds along an axis, by the mean place of what was taken back.
ROWS, COLUMNS = ("upper", "", "lower"), ("left", "", "right")


class Verdict(Enum):
    """What became of a restoration; the value is a sentence for the user."""

    RESTORED = "restored everywhere"
    PARTLY = (
        "in part the photo as it was: there the restoration rang, since the PSF or the response "
        "does not fit; give another PSF or response, or less strength"
    )
    PHOTO = (
        "the photo as it was: the restoration rang everywhere, since the PSF or the response does "
        "not fit; give the PSF or its size, find it in another region, or give the response"
    )


def verdict(trust: Trust) -> Verdict:
    """What became of a restoration."""
    arguments.instance(trust, Trust, "a Trust")
    back = _taken_back(trust)
    if back < NOTICED:
        return Verdict.RESTORED
    return Verdict.PHOTO if back > NEARLY_ALL else Verdict.PARTLY


def verdict_sentence(trust: Trust) -> str:
    """What became of a restoration, in how much of it and where, for the user."""
    found = verdict(trust)
    if found is not Verdict.PARTLY:
        return str(found.value)
    return f"{found.value} ({_taken_back(trust):.0%} of the picture, {_where(trust.kept)})"


def _taken_back(trust: Trust) -> float:
    """Share of a picture in which less than half of the restoration was kept."""
    return float(np.mean(trust.kept < 0.5))


def _where(kept: FloatArray) -> str:
    """Where less is kept: the part of the picture in which it is on average."""
    plane = (kept < 0.5).reshape(-1, *kept.shape[-2:]).mean(axis=0)
    names = []
    for axis, parts in enumerate((ROWS, COLUMNS)):
        along = plane.sum(axis=1 - axis)
        place = float(np.average(np.arange(len(along)), weights=along)) / len(along)
        names.append(parts[min(int(3 * place), 2)])
    words = " ".join(name for name in names if name)
    return f"mostly in the {words} part" if words else "about its middle"
