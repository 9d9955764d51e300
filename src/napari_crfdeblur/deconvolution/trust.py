"""How far to believe a restored picture: what noise, the PSF and the response leave uncertain."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy import fft, ndimage

from .. import arguments
from .._typing import BoolArray, FloatArray
from ..progress import Job, Progress, drain
from ..psf.base import as_psf
from .guard import kept_of, mixed
from .noise import PlaneStatistics, checked_statistics, measure_channels
from .seen import Seen, SeenChannel, checked_pair, seeing
from .steepness import contradicts

WIDTH = 1.0  # cells: standard deviation of the window in which a picture is alike
GRID = 96  # pixels of the period on which the spectrum of a PSF is known, or twice the PSF
RATIOS = np.geomspace(1e-6, 1e8, 57)  # of signal to noise; four for a factor of ten
FAINTEST = 1e-3  # of the energy of differences, that is signal even where noise explains all of it
NOTHING = 1e-30

SlopeError: TypeAlias = Callable[[FloatArray], FloatArray]
"""Relative error of the slope of an inverse response, at some light."""


@dataclass(frozen=True, slots=True, eq=False)
class Trust:
    """How much of each place of a picture was restored, and how far to believe it.

    Parameters
    ----------
    kept : ndarray, shape (M, N) or (Z, M, N)
        Share of the restoration that the guard has kept, 0 to 1, float32.
    error : ndarray, the shape of `kept`
        Standard deviation of the restored light about the true one to be expected, root mean
        square over the channels, float32.
    believed : ndarray, the shape of `kept`
        Share of the change that can be believed, 0 to 1, float32: all where what was changed is far
        above its error, none where the guard has taken it back.
    """

    kept: FloatArray
    error: FloatArray
    believed: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A restored picture that was judged.

    Parameters
    ----------
    sharp : ndarray, shape (M, N) or (M, N, C); with one axis more for volumes
        In linear light, guarded if that was wished.
    trust : Trust
    """

    sharp: FloatArray
    trust: Trust


def judge(
    linear: FloatArray,
    sharp: FloatArray,
    psf: FloatArray,
    *,
    clipped: BoolArray | None = None,
    statistics: Sequence[PlaneStatistics] | None = None,
    slope_errors: Sequence[SlopeError] = (),
    guarded: bool = True,
) -> Judged:
    """Judge a restored picture: guard it, and say how far it can be believed.

    A place is taken for a sample of pictures with the power ``s / |D|^2``, those of nature (Field
    1987), `s` from the energy of the differences that the blurred picture has there. Of these the
    best linear restoration (Wiener 1949) leaves the error

        ``sum_f s n / (s |K|^2 + n |D|^2)``

    in each pixel, `n` the variance of the noise at the light of the place and of what the PSF
    leaves unexplained; and the blur itself, where the guard has left it, ``s |1 - K|^2 / |D|^2``.
    To it comes the slope of the response: what was changed is wrong by the same share as that.
    Clipped light was changed to what only its surroundings tell, so that all of its change counts
    as an error.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C); with one axis more for volumes
        What was restored, in linear light.
    sharp : ndarray, the shape of `linear`
        What came out.
    psf : ndarray, shape (H, W) or (D, H, W)
        Point spread function; of many, one that stands for all.
    clipped : ndarray of bool, the shape of `linear`, optional
        True where the camera saturated.
    statistics : sequence of PlaneStatistics, optional
        Of each channel of `linear`, with the misfit of the PSF; measured by default.
    slope_errors : sequence of callable
        Relative error of the slope of the inverse response at some light, for all channels or for
        each; by default there is none.
    guarded : bool
        Whether what is impossible gives way to the blurred picture (:func:`~.guard.guard`), and
        all of it if the picture is sharper than the PSF permits (:func:`~.steepness.contradicts`).

    Raises
    ------
    ValueError
        Pictures of different shapes, or which do not fit the PSF.
    CrfDeblurError
        A PSF that is none.
    """
    return drain(
        judging(
            linear,
            sharp,
            psf,
            clipped=clipped,
            statistics=statistics,
            slope_errors=slope_errors,
            guarded=guarded,
        )
    )


def judging(
    linear: FloatArray,
    sharp: FloatArray,
    psf: FloatArray,
    *,
    clipped: BoolArray | None = None,
    statistics: Sequence[PlaneStatistics] | None = None,
    slope_errors: Sequence[SlopeError] = (),
    guarded: bool = True,
) -> Job[Judged]:
    """Job of :func:`judge`: reports progress, can be stopped."""
    psf = as_psf(psf)
    linear, sharp, clipped = checked_pair(linear, sharp, psf.shape, clipped)
    if statistics is None:
        statistics = measure_channels(linear, psf, clipped)
    statistics = checked_statistics(statistics, linear, psf.ndim)
    what = "functions that give the error of a slope"
    slopes = arguments.instances(slope_errors, object, what)
    if not all(callable(own) for own in slopes):
        raise arguments.refusal(what, slope_errors)
    arguments.instance(guarded, bool, "whether it is guarded")
    seen = yield from seeing(linear, sharp, psf.shape, clipped, statistics)
    kept = np.ones(seen.cells.shape, dtype=np.float32)
    if guarded:
        kept = 0 * kept if contradicts(linear, psf) else kept_of(seen, psf.shape)
        sharp = mixed(linear, sharp, kept)
    result = Judged(sharp, _trust(seen, kept, _Model.of(psf), slopes))
    yield Progress("judging", 1, 1)
    return result


def _trust(
    seen: Seen, kept: FloatArray, model: "_Model", slope_errors: Sequence[SlopeError]
) -> Trust:
    errors, blurs = np.zeros((2, *seen.cells.counts))
    for number, each in enumerate(seen.channels):
        error, blur = model.errors(each)
        if slope_errors:
            slope_error = slope_errors[number % len(slope_errors)](each.light)
            error += np.square(slope_error) * _around(each.changed)
        errors, blurs = errors + error + _around(each.invented), blurs + blur
    changed, own = _around(seen.total("changed")), seen.cells.means(kept)
    expected = np.square(own) * errors + np.square(1 - own) * blurs
    share = own * changed / np.maximum(changed + errors, NOTHING)
    error = np.sqrt(expected / len(seen.channels)).astype(np.float32)
    believed = share.clip(0, 1).astype(np.float32)
    return Trust(kept, seen.cells.spread(error), seen.cells.spread(believed))


def _around(energy: FloatArray) -> FloatArray:
    """Of a window around each cell."""
    around: FloatArray = ndimage.gaussian_filter(energy, WIDTH)
    return around


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """What pictures of nature lose by a PSF, in each pixel.

    Parameters
    ----------
    gains : ndarray
        Error of the best linear restoration over the variance of the noise, at `RATIOS`.
    blur : float
        Error of the blurred picture, over `s`.
    passed : float
        Share of the energy of differences that the PSF passes.
    """

    gains: FloatArray
    blur: float
    passed: float

    @classmethod
    def of(cls, psf: FloatArray) -> "_Model":
        shape = [max(round(GRID ** (2 / psf.ndim)), 2 * side) for side in psf.shape]
        centered = np.zeros(shape)
        centered[tuple(slice(side) for side in psf.shape)] = psf
        middle = [-(side // 2) for side in psf.shape]
        transfer = fft.fftn(np.roll(centered, middle, tuple(range(psf.ndim))))
        steps = np.zeros(shape)
        for axis, side in enumerate(shape):
            along = [-1 if each == axis else 1 for each in range(psf.ndim)]
            steps += (4 * np.sin(np.pi * fft.fftfreq(side)) ** 2).reshape(along)
        passed = np.square(np.abs(transfer))
        gains = [np.mean(ratio / (ratio * passed + steps)) for ratio in RATIOS]
        lost = np.square(np.abs(1 - transfer)) / np.maximum(steps, NOTHING)
        return cls(np.array(gains), float(lost.mean()), float(np.square(psf).sum()))

    def errors(self, seen: SeenChannel) -> tuple[FloatArray, FloatArray]:
        """Variances of the restored and of the blurred plane about the sharp one."""
        found, differences = seen.statistics, _around(seen.differences)
        share = np.ones_like(seen.light)
        if found.model is not None and found.model.mean > 0:
            share = found.model.variance(seen.light) / found.model.mean
        noise = np.maximum((found.relative_noise() * found.contrast) ** 2 * share, NOTHING)
        # white noise has twice its variance in the differences along each axis
        own = differences - 2 * seen.light.ndim * found.noise**2 * share
        signal = np.maximum(own, FAINTEST * differences) / self.passed
        ratio = np.log(np.maximum(signal / noise, RATIOS[0]))
        restored = noise * np.exp(np.interp(ratio, np.log(RATIOS), np.log(self.gains)))
        return restored, signal * self.blur
