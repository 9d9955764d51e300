"""A guard: where a restored picture swings beyond what is possible, it gives way to the photo."""

from dataclasses import dataclass
from types import NoneType

import numpy as np
from scipy import ndimage

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..progress import Job, Progress, drain
from .seen import Seen, checked_pair, seeing

# Chosen on restorations of six pictures with right and wrong PSFs and responses, and on twelve
# photos; docs/benchmarks/guard.md reports those of six other pictures.
TOLERATED = 0.035  # of the energy that was changed, at which half of the change is kept
STEEPNESS = 3  # power of what is impossible with which the share that is kept falls beyond
POOLED = 5.0  # how much the whole picture counts beside a window: one PSF is wrong everywhere
LEAST = 0.1  # share of a change below which nothing is kept: a tenth of garbage is garbage
WHOLE = 0.95  # share from which all is kept, so that a right restoration stays as it is
WIDTH = 0.5  # PSF sides: standard deviation of the window in which a place is judged
# Shares of the energy of differences, noise left out, that a restoration must leave for some of it
# and for all of it to be kept, where these are so many times those of noise.
SMOOTHED, UNSMOOTHED, DETAILED = 0.5, 0.8, 4.0
LEAST_CLEAR = 0.1  # share of cells without clipped light near that are enough to judge the whole
NOTHING = 1e-30  # energy: single precision holds it


@dataclass(frozen=True, slots=True)
class Swing:
    """How far a restored picture swings beyond what is possible: mean energies of a picture.

    Parameters
    ----------
    below : float
        Of what lies below zero by more than noise.
    above : float
        Of what lies above the brightest light that was recorded within a PSF.
    changed : float
        Of all that was changed.
    """

    below: float
    above: float
    changed: float

    def __post_init__(self) -> None:
        for name in self.__slots__:
            arguments.number(getattr(self, name), f"a mean energy {name}", least=0)

    @classmethod
    def mean(cls, swings: "list[Swing]") -> "Swing":
        """Of several parts of a picture, alike in size."""
        each = zip(*((own.below, own.above, own.changed) for own in swings), strict=True)
        return cls(*(float(np.mean(values)) for values in each))


@dataclass(frozen=True, slots=True, eq=False)
class Guarded:
    """A restored picture in which what is impossible gave way to the blurred one.

    Parameters
    ----------
    sharp : ndarray, shape (M, N) or (M, N, C); with one axis more for volumes
        In linear light.
    kept : ndarray, shape (M, N) or (Z, M, N)
        Share of the change that was kept, 0 to 1, float32: one for all channels, so that no
        color is left over.
    """

    sharp: FloatArray
    kept: FloatArray


def guard(
    linear: FloatArray,
    sharp: FloatArray,
    sides: tuple[int, ...],
    *,
    clipped: BoolArray | None = None,
    whole: Swing | None = None,
) -> Guarded:
    """Judge a restored picture, and keep as much of the change as can be believed.

    Where a wrong PSF, a wrong response or clipped light make a restored picture ring, it swings
    both ways: below zero, which no light is, and above all light around. (Below zero alone, dark
    places are off by a constant, as with a wrong response, which harms nothing.) So `h` is the
    geometric mean of the energies of both, over that of all that was changed: in a Gaussian window
    around each place, together with five times that of the whole picture. Of the change is kept
    ``1 / (1 + (h / .035)^3)``, or all if that is nearly all, or nothing if it is little:
    at worst the result is the blurred picture. Near clipped light, which may well be brighter
    than all that was recorded, only what is below zero counts.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C); (Z, M, N) or (Z, M, N, C) for a PSF of 3 sides
        What was restored, in linear light.
    sharp : ndarray, the shape of `linear`
        What came out.
    sides : tuple of int
        Of the PSF.
    clipped : ndarray of bool, the shape of `linear`, optional
        True where the camera saturated.
    whole : Swing, optional
        Of the whole picture, if this is a part of it.

    Raises
    ------
    ValueError
        Pictures of different shapes, or which do not fit the sides.
    """
    return drain(guarding(linear, sharp, sides, clipped=clipped, whole=whole))


def guarding(
    linear: FloatArray,
    sharp: FloatArray,
    sides: tuple[int, ...],
    *,
    clipped: BoolArray | None = None,
    whole: Swing | None = None,
) -> Job[Guarded]:
    """Job of :func:`guard`: reports progress, can be stopped."""
    arguments.instance(whole, (Swing, NoneType), "the swing of a whole picture, or None")
    linear, sharp, clipped = checked_pair(linear, sharp, sides, clipped)
    seen = yield from seeing(linear, sharp, sides, clipped)
    kept = kept_of(seen, sides, whole)
    result = Guarded(mixed(linear, sharp, kept), kept)
    yield Progress("judging", 1, 1)
    return result


def kept_of(seen: Seen, sides: tuple[int, ...], whole: Swing | None = None) -> FloatArray:
    """Share of the change that is kept at every pixel; parameters as for :func:`guard`."""
    whole = whole or _whole(seen)
    wide = [WIDTH * side / own for side, own in zip(sides, seen.cells.sides, strict=True)]
    below, above, changed = (
        ndimage.gaussian_filter(seen.total(name), wide, mode="nearest", truncate=3)
        + POOLED * getattr(whole, name)
        for name in ("below", "above", "changed")
    )
    share = np.sqrt(below * above) / np.maximum(changed, NOTHING)
    half = 1 / (1 + (share / TOLERATED) ** STEEPNESS)
    kept = ((half - LEAST) / (WHOLE - LEAST)).clip(0, 1) * _sharpened(seen, wide)
    if kept.min() == 1:
        return np.ones(seen.cells.shape, dtype=np.float32)
    return seen.cells.spread(kept.astype(np.float32))


def _sharpened(seen: Seen, wide: list[float]) -> FloatArray:
    """1 in each cell, or less where a restoration is smoother than the blurred picture.

    No blur that is undone takes detail away: that is a noise which was taken for too large.
    """
    before, after, noise = (
        ndimage.gaussian_filter(each, wide, mode="nearest", truncate=3)
        for each in (seen.total("differences"), seen.total("restored"), seen.noise)
    )
    share = after / np.maximum(before - noise, NOTHING)
    kept: FloatArray = ((share - SMOOTHED) / (UNSMOOTHED - SMOOTHED)).clip(0, 1)
    return np.where(before > DETAILED * noise, kept, 1.0)


def swing_of(
    linear: FloatArray,
    sharp: FloatArray,
    sides: tuple[int, ...],
    *,
    clipped: BoolArray | None = None,
) -> Swing:
    """How far a restored picture swings as a whole; parameters as for :func:`guard`."""
    linear, sharp, clipped = checked_pair(linear, sharp, sides, clipped)
    return _whole(drain(seeing(linear, sharp, sides, clipped)))


def _whole(seen: Seen) -> Swing:
    """The swing away from clipped light, unless that is nearly everywhere."""
    clear = ~seen.lamps
    if clear.mean() < LEAST_CLEAR:
        clear[...] = True
    energies = (seen.total(name)[clear] for name in ("below", "above", "changed"))
    return Swing(*(float(each.mean()) for each in energies))


def mixed(linear: FloatArray, sharp: FloatArray, kept: FloatArray) -> FloatArray:
    """The restored picture, and the blurred one for what is not kept."""
    result: FloatArray = arrays.copy(sharp)
    for rows in arrays.blocks(sharp):
        part = kept[rows, ...].reshape(*kept[rows, ...].shape, *(1,) * (sharp.ndim - kept.ndim))
        if (part < 1).any():  # what is kept as a whole stays the same, bit by bit
            change = sharp[rows, ...] - linear[rows, ...]
            result[rows, ...] -= arrays.like(1 - part, sharp) * change
    return result
