"""A guard: where a restored picture swings beyond what is possible, it gives way to the photo."""

from dataclasses import dataclass
from types import NoneType

import numpy as np
from scipy import ndimage

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..progress import Job, Progress, drain
from .cells import Cells
from .noise import measure

# Chosen on restorations of six pictures with right and wrong PSFs and responses, and on twelve
# photos; docs/benchmarks/guard.md reports those of six other pictures.
TOLERATED = 0.035  # of the energy that was changed, at which half of the change is kept
STEEPNESS = 3  # power of what is impossible with which the share that is kept falls beyond
POOLED = 5.0  # how much the whole picture counts beside a window: one PSF is wrong everywhere
LEAST = 0.1  # share of a change below which nothing is kept: a tenth of garbage is garbage
WHOLE = 0.95  # share from which all is kept, so that a right restoration stays as it is
WIDTH = 0.5  # PSF sides: standard deviation of the window in which a place is judged
CELLS = 4  # in a PSF side: the share is known so finely
FEWEST = 2  # pixels of a cell
NOISE = 3.0  # noise levels by which light can seem to be beyond what is possible
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

    @classmethod
    def unjudged(cls, sharp: FloatArray, axes: int) -> "Guarded":
        """A restored picture with so many axes, beside those of colors, that is kept as it is."""
        return cls(sharp, np.ones(sharp.shape[:axes], dtype=np.float32))


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
    linear, sharp, clipped = _checked(linear, sharp, sides, clipped)
    found = yield from _swinging(linear, sharp, sides, clipped)
    wide = [WIDTH * side / own for side, own in zip(sides, found.cells.sides, strict=True)]
    whole = whole or found.whole
    below, above, changed = (
        ndimage.gaussian_filter(each, wide, mode="nearest", truncate=3) + POOLED * pooled
        for each, pooled in (
            (found.below, whole.below),
            (found.above, whole.above),
            (found.changed, whole.changed),
        )
    )
    share = np.sqrt(below * above) / np.maximum(changed, NOTHING)
    half = 1 / (1 + (share / TOLERATED) ** STEEPNESS)
    kept = ((half - LEAST) / (WHOLE - LEAST)).clip(0, 1)
    spread = found.cells.spread(kept).astype(np.float32)
    result = Guarded(_mixed(linear, sharp, spread), spread)
    yield Progress("guard", 1, 1)
    return result


def judged_in(shape: tuple[int, ...], sides: tuple[int, ...]) -> Cells:
    """The cells in which a picture of a shape is judged, for a PSF of these sides."""
    cell = tuple(max(side // CELLS, FEWEST) for side in sides)
    return Cells(tuple(shape[: len(sides)]), cell)


def swing_of(
    linear: FloatArray,
    sharp: FloatArray,
    sides: tuple[int, ...],
    *,
    clipped: BoolArray | None = None,
) -> Swing:
    """How far a restored picture swings as a whole; parameters as for :func:`guard`."""
    linear, sharp, clipped = _checked(linear, sharp, sides, clipped)
    return drain(_swinging(linear, sharp, sides, clipped)).whole


def _mixed(linear: FloatArray, sharp: FloatArray, kept: FloatArray) -> FloatArray:
    """The restored picture, and the blurred one for what is not kept."""
    result: FloatArray = arrays.copy(sharp)
    for rows in arrays.blocks(sharp):
        part = kept[rows, ...].reshape(*kept[rows, ...].shape, *(1,) * (sharp.ndim - kept.ndim))
        if (part < 1).any():  # what is kept as a whole stays the same, bit by bit
            change = sharp[rows, ...] - linear[rows, ...]
            result[rows, ...] -= arrays.like(1 - part, sharp) * change
    return result


@dataclass(frozen=True, slots=True, eq=False)
class _Swings:
    """Mean energies in each cell, all channels together, and whether clipped light is near."""

    cells: Cells
    below: FloatArray
    above: FloatArray
    changed: FloatArray
    lamps: BoolArray

    @property
    def whole(self) -> Swing:
        """Away from clipped light, unless that is nearly everywhere."""
        clear = ~self.lamps
        if clear.mean() < LEAST_CLEAR:
            clear[...] = True
        return Swing(
            *(float(each[clear].mean()) for each in (self.below, self.above, self.changed))
        )


def _swinging(
    linear: FloatArray, sharp: FloatArray, sides: tuple[int, ...], clipped: BoolArray | None
) -> Job[_Swings]:
    """Job: how far a restored picture swings, cell by cell."""
    cells = judged_in(linear.shape, sides)
    below, above, changed = np.zeros((3, *cells.counts))
    lamps = np.zeros(cells.counts, dtype=bool)
    channels = list(np.ndindex(linear.shape[len(sides) :]))
    for number, channel in enumerate(channels):
        yield Progress("guard", number, len(channels) + 1)
        before, after = linear[(..., *channel)], sharp[(..., *channel)]
        own = _energies(before, after, cells)
        if clipped is not None:
            near = _reached(_highest(clipped[(..., *channel)], cells)) > 0
            own[1] = np.where(near, own[0], own[1])
            lamps |= near
        below, above, changed = below + own[0], above + own[1], changed + own[2]
    return _Swings(cells, below, above, changed, lamps)


def _energies(before: FloatArray, after: FloatArray, cells: Cells) -> FloatArray:
    """Mean energies below, above and changed of a plane, in each cell, shape (3, ...)."""
    noise = NOISE * measure(arrays.contiguous(before)).noise
    # a plane that is below zero itself was recorded with an offset
    darkest = min(float(arrays.namespace(before).min(before)), 0.0) - noise
    brightest = _reached(_highest(before, cells)) + noise
    found = np.empty((3, *cells.counts))
    for rows, own, band in cells.bands():
        light, sharp = (np.float64(arrays.to_numpy(each[rows, ...])) for each in (before, after))
        highest = band.held(brightest[own])
        beyond = np.maximum(darkest - sharp, 0), np.maximum(sharp - highest, 0), sharp - light
        for part, each in zip(found, beyond, strict=True):
            part[own] = band.means(each * each)
    return found


def _highest(plane: FloatArray | BoolArray, cells: Cells) -> FloatArray:
    """The highest value in each cell."""
    highest = np.empty(cells.counts)
    for rows, own, band in cells.bands():
        highest[own] = band.reduced(arrays.to_numpy(plane[rows, ...]), np.maximum)
    return highest


def _reached(highest: FloatArray) -> FloatArray:
    """The highest values within a PSF of anywhere in a cell."""
    reached: FloatArray = ndimage.maximum_filter(highest, 2 * -(-CELLS // 2) + 1, mode="nearest")
    return reached


def _checked(
    linear: FloatArray, sharp: FloatArray, sides: tuple[int, ...], clipped: BoolArray | None
) -> tuple[FloatArray, FloatArray, BoolArray | None]:
    arguments.instance(sides, tuple, "the sides of a PSF")
    for side in sides:
        arguments.whole(side, "a side of a PSF in pixels", least=1)
    if len(sides) not in (2, 3):
        raise arguments.refusal("two or three sides of a PSF", sides)
    what, axes = "an image that fits the sides of the PSF", (len(sides), len(sides) + 1)
    linear, sharp = (
        arguments.array(each, what, axes=axes, kinds=("float",)) for each in (linear, sharp)
    )
    if linear.shape != sharp.shape or 0 in linear.shape:
        raise ValueError(
            f"expected two images of one shape, got {tuple(linear.shape)} and {tuple(sharp.shape)}"
        )
    for image in (linear, sharp):
        arguments.check_pixels(image)
    if clipped is not None:
        clipped = arguments.array(clipped, "clipped pixels as bool", kinds=("bool",))
        if clipped.shape != linear.shape:
            raise arguments.refusal(f"clipped pixels of shape {tuple(linear.shape)}", clipped)
    return linear, sharp, clipped
