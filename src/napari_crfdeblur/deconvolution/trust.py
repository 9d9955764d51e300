"""How far to believe a restored picture: what noise, the PSF and the response leave uncertain."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy import fft, ndimage

from .. import arrays
from .._typing import BoolArray, FloatArray
from ..progress import Job, Progress
from .cells import Cells
from .guard import Guarded, judged_in
from .noise import PlaneStatistics, measure

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


def trusting(
    linear: FloatArray,
    guarded: Guarded,
    psf: FloatArray,
    *,
    clipped: BoolArray | None = None,
    slope_errors: Sequence[SlopeError] = (),
) -> Job[Trust]:
    """Job: what can be expected of the error of a picture that was restored and guarded.

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
    guarded : Guarded
        What came out.
    psf : ndarray, shape (H, W) or (D, H, W)
        Made by :func:`~napari_crfdeblur.psf.as_psf`; of many, one that stands for all.
    clipped : ndarray of bool, the shape of `linear`, optional
        True where the camera saturated.
    slope_errors : sequence of callable
        Relative error of the slope of the inverse response at some light, for all channels or for
        each; by default there is none.
    """
    cells, model = judged_in(linear.shape, psf.shape), _Model.of(psf)
    errors, changes, blurs = np.zeros((3, *cells.counts))
    channels = list(np.ndindex(linear.shape[psf.ndim :]))
    for number, channel in enumerate(channels):
        yield Progress("trust", number, len(channels))
        before, after = linear[(..., *channel)], guarded.sharp[(..., *channel)]
        lost = None if clipped is None else clipped[(..., *channel)]
        seen = _seen(before, after, lost, cells)
        error, blur = model.errors(seen, measure(arrays.contiguous(before), psf, lost))
        if slope_errors:
            slope_error = slope_errors[number % len(slope_errors)](seen.light)
            error += np.square(slope_error) * seen.changed
        errors, blurs = errors + error + seen.invented, blurs + blur
        changes += seen.changed
    kept = cells.means(guarded.kept.astype(np.float64))
    expected = np.square(kept) * errors + np.square(1 - kept) * blurs
    share = kept * changes / np.maximum(changes + errors, NOTHING)
    yield Progress("trust", len(channels), len(channels))
    return Trust(
        guarded.kept,
        cells.spread(np.sqrt(expected / len(channels))).astype(np.float32),
        cells.spread(share).clip(0, 1).astype(np.float32),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What is seen of a plane in each cell: all energies are means over a window.

    Parameters
    ----------
    light : ndarray
        Mean light of the blurred plane.
    differences : ndarray
        Energy of its differences along all axes.
    changed, invented : ndarray
        Energy of what was changed, and of that part of it which is clipped light.
    """

    light: FloatArray
    differences: FloatArray
    changed: FloatArray
    invented: FloatArray


def _seen(before: FloatArray, after: FloatArray, clipped: BoolArray | None, cells: Cells) -> _Seen:
    light, differences, changed, invented = np.zeros((4, *cells.counts))
    for rows, own, band in cells.bands():
        plane, sharp = (
            np.asarray(arrays.to_numpy(each[rows, ...]), dtype=np.float64)
            for each in (before, after)
        )
        change = np.square(sharp - plane)
        light[own], changed[own] = band.means(plane), band.means(change)
        for axis in range(plane.ndim):
            step = np.diff(plane, axis=axis, append=plane.take([-1], axis))
            differences[own] += band.means(np.square(step))
        if clipped is not None:
            invented[own] = band.means(change * arrays.to_numpy(clipped[rows, ...]))
    return _Seen(
        light, *(ndimage.gaussian_filter(each, WIDTH) for each in (differences, changed, invented))
    )


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

    def errors(self, seen: _Seen, found: PlaneStatistics) -> tuple[FloatArray, FloatArray]:
        """Variances of the restored and of the blurred picture about the sharp one."""
        share = np.ones_like(seen.light)
        if found.model is not None and found.model.mean > 0:
            share = found.model.variance(seen.light) / found.model.mean
        noise = np.maximum((found.relative_noise() * found.contrast) ** 2 * share, NOTHING)
        # white noise has twice its variance in the differences along each axis
        own = seen.differences - 2 * seen.light.ndim * found.noise**2 * share
        signal = np.maximum(own, FAINTEST * seen.differences) / self.passed
        ratio = np.log(np.maximum(signal / noise, RATIOS[0]))
        restored = noise * np.exp(np.interp(ratio, np.log(RATIOS), np.log(self.gains)))
        return restored, signal * self.blur
