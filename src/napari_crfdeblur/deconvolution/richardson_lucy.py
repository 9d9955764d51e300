"""Richardson-Lucy deconvolution: maximum likelihood for photon noise."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..boundary import frame, periodic_shape
from ..fourier import convolving, correlating, kept_otf
from ..progress import Job, Progress
from . import loops
from .base import Deconvolver
from .damping import smoothed, undamped
from .noise import PlaneStatistics, measure
from .share import share_inside, share_of

FAINTEST = 1e-6  # damping, in standard deviations, that any noise exceeds
STRONGEST = 1e3  # damping, that keeps everything as it was recorded
CHOICE = 3  # steps after which it is looked again which clipped pixels the scene exceeds


@dataclass(frozen=True, slots=True)
class RichardsonLucy(Deconvolver):
    """Multiplicative steps, ``x <- x / (k' * m) (k' * (m y / (k * x)))``.

    Richardson (1972) and Lucy (1974); `k'` is the mirrored PSF. The mask `m` is 1 inside the
    frame and 0 outside, where the scene is unknown and estimated along (Bertero & Boccacci
    2005), so that nothing is assumed beyond the border. Where the camera saturated, it is 0 as
    long as ``k * x`` is above `y`: any light above the recorded one explains it. Non-negative, and
    negative values of `y` count as zero; changes of scale commute with it. Noise grows with the
    number of steps, unless one of two options holds it back.

    Parameters
    ----------
    iterations : int
        Number of steps: more are sharper and noisier.
    total_variation : float
        Weight of the total variation as prior (Dey et al. 2006), 0 to 0.1; .002 in the paper,
        and more for more noise. 0: none.
    damping : float
        Standard deviations of the noise within which what was recorded counts as explained, so that
        it is not followed any further (White 1994); 2 to 3 for pictures with even areas. 0: none.
    """

    # No border is continued, so that smaller tiles lose little, and take half of the memory.
    tile_side = 6.5

    iterations: int = 30
    total_variation: float = 0.0
    damping: float = 0.0

    def __post_init__(self) -> None:
        arguments.step_count(self.iterations, "a number of iterations")
        what = "a weight of total variation"
        arguments.number(self.total_variation, what, least=0, most=0.1)
        what = "damping in standard deviations"
        arguments.number(self.damping, what, least=0, most=STRONGEST)

    @property
    def reach(self) -> float:
        """The more steps, the farther: where what they carry on falls to a tenth of the noise."""
        return 2.0 * float((self.iterations / 30) ** 0.3)

    def run(
        self,
        plane: FloatArray,
        psf: FloatArray,
        *,
        clipped: BoolArray | None = None,
        weights: FloatArray | None = None,
        statistics: PlaneStatistics | None = None,
    ) -> Job[FloatArray]:
        """Long job: deconvolve a plane or volume with a checked PSF.

        Negative values of the plane count as zero.
        """
        found = statistics or measure(plane)
        steps = max(round(self.iterations / found.reckoned), 1)
        total = 2 + 2 * steps
        reports = (Progress("Richardson-Lucy", done, total) for done in range(total + 1))
        yield next(reports)
        restraint = Restraint(self.total_variation, self.damping, found)
        light = _light(plane)
        scene = yield from restoring(light, psf, clipped, steps, reports, restraint, weights)
        result: FloatArray = arrays.contiguous(scene[frame(plane.shape)])
        return result


@dataclass(frozen=True, slots=True)
class Restraint:
    """What holds the noise back: the options of :class:`RichardsonLucy`, and the noise.

    Parameters
    ----------
    total_variation, damping : float
        As there.
    statistics : PlaneStatistics
        Noise of the plane.
    """

    total_variation: float
    damping: float
    statistics: PlaneStatistics

    def damp(self, plane: FloatArray, predicted: FloatArray) -> FloatArray | None:
        """Share of its correction that every pixel keeps; None if all do."""
        if self.damping < FAINTEST:
            return None
        return undamped(plane, predicted, self.statistics, self.damping)

    def smooth(self, share: FloatArray, scene: FloatArray) -> FloatArray:
        """One over what divides the correction of the scene."""
        return smoothed(share, scene, self.total_variation) if self.total_variation else share


def restoring(
    plane: FloatArray,
    psf: FloatArray,
    clipped: BoolArray | None,
    iterations: int,
    reports: Iterator[Progress],
    restraint: Restraint | None = None,
    weights: FloatArray | None = None,
) -> Job[FloatArray]:
    """Job: the scene, continued beyond the frame as far as it sheds light into it.

    Parameters
    ----------
    plane, psf, clipped
        As for :meth:`Deconvolver.run`.
    iterations : int
        Number of steps.
    reports : iterator of Progress
        Two for every step, and two before.
    restraint : Restraint, optional
        What holds the noise back; by default nothing.
    weights : ndarray, the shape of `plane`, optional
        What each pixel is worth: the mask `m`, 0 to 1.
    """
    transfer = kept_otf(psf, periodic_shape(plane.shape, psf.shape), plane)
    yield (at := next(reports))
    if weights is None:
        inside = share_inside(psf, plane)
    else:
        inside = yield from share_of(weights, transfer, periodic_shape(plane.shape, psf.shape), at)
    share = inside
    sharp: FloatArray = arrays.zeros(periodic_shape(plane.shape, psf.shape), plane)
    sharp[...] = max(arrays.mean(plane), _tiny(plane))
    # of dark pixels, where rounding could make the prediction zero or negative
    floor = max(1e-6 * arrays.mean(plane), _tiny(plane))
    free: BoolArray | None = None
    yield (at := next(reports))
    for step in range(iterations):
        ratio = yield from convolving(sharp, transfer, at)
        if clipped is not None and step % CHOICE == 0:
            yield at
            free = _any(clipped & (ratio[frame(plane.shape)] > plane))
            share = inside
            if free is not None:
                mask = arrays.namespace(plane).astype(~free, plane.dtype)
                mask = mask if weights is None else mask * weights
                share = yield from share_of(mask, transfer, ratio.shape, at)
        kept = restraint.damp(plane, ratio[frame(plane.shape)]) if restraint else None
        _divide(plane, ratio, free, floor)
        if kept is not None:
            _keep(ratio[frame(plane.shape)], kept, free)
        if weights is not None:
            ratio[frame(plane.shape)] *= weights
        yield (at := next(reports))
        correction = yield from correlating(ratio, transfer, at)
        del ratio  # the memory of one plane
        _multiply(sharp, correction, restraint.smooth(share, sharp) if restraint else share)
        yield (at := next(reports))
    return sharp


def _light(plane: FloatArray) -> FloatArray:
    """The plane, its negative values as zero: there is no less light than none."""
    xp = arrays.namespace(plane)
    return arrays.raised(plane, 0.0) if float(xp.min(plane)) < 0 else plane


def _tiny(plane: FloatArray) -> float:
    return float(np.finfo(arrays.dtype_name(plane)).tiny)


def _any(pixels: BoolArray) -> BoolArray | None:
    return pixels if bool(arrays.namespace(pixels).any(pixels)) else None


def _divide(plane: FloatArray, predicted: FloatArray, free: BoolArray | None, floor: float) -> None:
    """Replace the prediction, at least `floor`, by ``m y / prediction``."""
    if fused := loops.compiled(loops.divide_inside, predicted):
        fused(plane, predicted, plane.dtype.type(floor), plane.dtype.type(0))
    else:
        _divide_blocks(plane, predicted, floor)
    if free is not None:
        predicted[frame(plane.shape)][free] = 0


def _divide_blocks(plane: FloatArray, predicted: FloatArray, floor: float) -> None:
    inside = frame(plane.shape)
    for block in arrays.blocks(plane):
        part = predicted[(block, *inside[1:])]
        arrays.raise_to(part, floor)
        arrays.divide(arrays.raised(plane[block, ...], 0.0), part, out=part)
    for axis, side in enumerate(plane.shape):
        outside: tuple[Any, ...] = (*(slice(None),) * axis, slice(side, None), ...)
        predicted[outside] = 0


def _keep(ratio: FloatArray, kept: FloatArray, free: BoolArray | None) -> None:
    """Replace the ratio by ``1 + kept (ratio - 1)``, but in pixels that do not count."""
    damped = 1 + kept * (ratio - 1)
    ratio[...] = damped if free is None else arrays.namespace(ratio).where(free, 0.0, damped)


def _multiply(sharp: FloatArray, correction: FloatArray, share: FloatArray) -> None:
    """``x <- x correction share``, in place; scene pixels of share 0, hardly seen, stay."""
    if fused := loops.compiled(loops.multiply, sharp):
        fused(sharp, correction, share, sharp.dtype.type(0))
        return
    xp = arrays.namespace(sharp)
    for block in arrays.blocks(sharp):
        part, own = correction[block, ...], share[block, ...]
        arrays.raise_to(part, 0.0)  # rounding can make it negative
        part *= own
        part += xp.astype(own == 0, part.dtype)
        sharp[block, ...] *= part
