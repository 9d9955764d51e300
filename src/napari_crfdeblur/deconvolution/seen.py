"""What is seen of a restored picture beside the blurred one, cell by cell: what judges it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..progress import Job, Progress
from .cells import Cells
from .noise import PlaneStatistics, measure

CELLS = 4  # in a PSF side: a picture is judged so finely
FEWEST = 2  # pixels of a cell
NOISE = 3.0  # noise levels by which light can seem to be beyond what is possible


@dataclass(frozen=True, slots=True, eq=False)
class SeenChannel:
    """Means over each cell of a channel.

    Parameters
    ----------
    statistics : PlaneStatistics
        Of the blurred plane.
    light : ndarray
        Blurred light.
    differences, restored : ndarray
        Energy of the differences of the blurred and of the restored plane along all axes.
    below : ndarray
        Energy of what was restored below zero by more than noise.
    above : ndarray
        Energy of what was restored above the brightest light that was recorded within a PSF; near
        clipped light, of which nothing is known above, the same as `below`.
    changed, invented : ndarray
        Energy of all that was changed, and of that part of it which is clipped light.
    lamps : ndarray of bool
        Whether clipped light is within a PSF.
    """

    statistics: PlaneStatistics
    light: FloatArray
    differences: FloatArray
    restored: FloatArray
    below: FloatArray
    above: FloatArray
    changed: FloatArray
    invented: FloatArray
    lamps: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A restored picture beside the blurred one.

    Parameters
    ----------
    cells : Cells
    channels : sequence of SeenChannel
    """

    cells: Cells
    channels: Sequence[SeenChannel]

    def total(self, name: str) -> FloatArray:
        """One of the energies, all channels together."""
        total: FloatArray = np.sum([getattr(each, name) for each in self.channels], axis=0)
        return total

    @property
    def noise(self) -> FloatArray:
        """Energy of the differences that is noise: twice its variance along each axis."""
        axes = len(self.cells.shape)
        total: FloatArray = np.zeros(self.cells.counts)
        for each in self.channels:
            model = each.statistics.model
            own = each.statistics.noise**2 if model is None else model.variance(each.light)
            total = total + 2 * axes * own
        return total

    @property
    def lamps(self) -> BoolArray:
        """Whether clipped light of any channel is within a PSF."""
        lamps: BoolArray = np.any([each.lamps for each in self.channels], axis=0)
        return lamps


def seeing(
    linear: FloatArray,
    sharp: FloatArray,
    sides: tuple[int, ...],
    clipped: BoolArray | None,
    statistics: Sequence[PlaneStatistics] | None = None,
) -> Job[Seen]:
    """Job: look at a restored picture; statistics of each channel are measured by default.

    Parameters are those of :func:`~.guard.guard`, checked.
    """
    cell = tuple(max(side // CELLS, FEWEST) for side in sides)
    cells, found = Cells(tuple(linear.shape[: len(sides)]), cell), []
    channels = list(np.ndindex(linear.shape[len(sides) :]))
    for number, channel in enumerate(channels):
        yield Progress("judging", number, len(channels) + 1)
        before, after = linear[(..., *channel)], sharp[(..., *channel)]
        lost = None if clipped is None else clipped[(..., *channel)]
        known = statistics[number] if statistics else measure(arrays.contiguous(before))
        found.append(_seen(before, after, lost, cells, known))
    return Seen(cells, found)


def _seen(
    before: FloatArray,
    after: FloatArray,
    clipped: BoolArray | None,
    cells: Cells,
    statistics: PlaneStatistics,
) -> SeenChannel:
    noise = NOISE * statistics.noise
    # a plane that is below zero itself was recorded with an offset
    darkest = min(float(arrays.namespace(before).min(before)), 0.0) - noise
    brightest = _reached(_highest(before, cells)) + noise
    white = brightest.max() - noise  # beyond it a photo that clips shows no change
    light, differences, restored, below, above, changed, invented = np.zeros((7, *cells.counts))
    for rows, own, band in cells.bands():
        plane, sharp = (np.asarray(arrays.to_numpy(each[rows, ...])) for each in (before, after))
        light[own] = band.means(plane)
        for axis in range(plane.ndim):
            for values, energy in ((plane, differences), (sharp, restored)):
                step = np.diff(values, axis=axis, append=values.take([-1], axis))
                energy[own] += band.energies(step)
        if float(sharp.min()) < darkest:
            below[own] = band.energies(np.maximum(darkest - sharp, 0))
        if float(sharp.max()) > brightest[own].min():
            highest = band.held(brightest[own].astype(sharp.dtype))
            above[own] = band.energies(np.maximum(sharp - highest, 0))
        if clipped is not None:
            sharp = np.minimum(sharp, white)
        change = sharp - plane
        if clipped is not None:
            invented[own] = band.energies(change * arrays.to_numpy(clipped[rows, ...]))
        changed[own] = band.energies(change)
    lamps = np.zeros(cells.counts, dtype=bool)
    if clipped is not None:
        lamps = _reached(_highest(clipped, cells)) > 0
        above[lamps] = below[lamps]
    return SeenChannel(
        statistics, light, differences, restored, below, above, changed, invented, lamps
    )


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


def checked_pair(
    linear: FloatArray, sharp: FloatArray, sides: tuple[int, ...], clipped: BoolArray | None
) -> tuple[FloatArray, FloatArray, BoolArray | None]:
    """A blurred and a restored picture that fit each other and the sides of a PSF."""
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
