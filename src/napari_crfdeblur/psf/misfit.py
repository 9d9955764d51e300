"""What a PSF leaves unexplained in a picture, seen at the frequencies that it blocks."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeVar

import numpy as np
from scipy import fft, ndimage, signal

from .. import arrays
from .._typing import BoolArray, FloatArray
from .spectral_fit import NOTHING, SpectralFit

SIDE = 256  # pixels of a window, or more for large PSFs, so that their zeros stay apart:
PSFS = 8  # of them in a window
FEWEST = 64  # pixels of the shorter side that tell anything
WINDOWS = 12  # at most, spread over the picture
RAMP = 24  # pixels in which a window falls to zero around clipped pixels
LEAST_AREA = 0.1  # of the windows that must be left
# A frequency is blocked if the PSF passes less of its power, and these must be so many of all:
# else the power that the picture lacks there may be its own. With 5 % a real photo (PSF 17 px, 3 %
# blocked) came out grainy; a Gaussian of .7 px, whose misfit is none, blocks 1.3 %.
BLOCKED, LEAST_BLOCKED = 0.005, 0.02

T = TypeVar("T")


def misfit(
    parts: Sequence[FloatArray],
    psf: FloatArray,
    clipped: Sequence[BoolArray] | None = None,
    *,
    least_blocked: float = LEAST_BLOCKED,
) -> float | None:
    """Noise level that a blurred plane seems to have beyond what its PSF can explain.

    A PSF with zeros blocks some frequencies: what is there all the same is noise, an error of the
    PSF or the response, or of compression, in unknown mixture. So the mean power of the blurred
    picture at the frequency `f` is taken for ::

        a(f) (V * |K|^2)(f) + n + e (1/4 / |f|)^3

    `K` is the spectrum of the PSF, `V` that of the (Hann) windows through which the picture is
    seen (Welch 1967, The use of fast Fourier transform for the estimation of power spectra), `a`
    the power of the sharp picture, a constant in each of 64 cells of frequency and orientation,
    `n` that of white noise, and `e` that of errors, which are larger at the low frequencies at
    which the picture is. All of these are fitted by maximum likelihood, for powers that are
    distributed exponentially (Whittle 1953, Estimation and information in stationary time series).

    Parameters
    ----------
    parts : sequence of ndarray, shape (M, N)
        Parts of the plane, alike in shape, or all of it. Any unit, finite. Some windows are used.
    psf : ndarray, shape (H, W)
        Made by :func:`~napari_crfdeblur.psf.as_psf`.
    clipped : sequence of ndarray of bool, optional
        For each part, True where the camera saturated, which is no convolution any more: what
        is near is left out, unless hardly anything remained.
    least_blocked : float
        Share of the frequencies that the PSF must block.

    Returns
    -------
    float, optional
        ``sqrt(n + e)``, the standard deviation of white noise that is as strong at 1/4 cycle per
        pixel; None for volumes, where the picture is too small to tell, and where the PSF blocks
        hardly anything, as those narrower than a pixel: then all of this may be the picture's own.
    """
    shape = window_for(parts[0].shape, max(psf.shape))
    if min(shape) < max(FEWEST, 2 * max(psf.shape)):
        return None
    spectra = Spectra.seen(parts, clipped, shape)
    if spectra.share < LEAST_AREA and clipped is not None:
        return misfit(parts, psf, least_blocked=least_blocked)
    if not spectra.blurred.any():
        return 0.0
    fit = spectra.explained_by(psf)
    return fit.unexplained() if fit.blocked(BLOCKED) >= least_blocked else None


def window_for(shape: tuple[int, ...], size: int) -> tuple[int, ...]:
    """Sides of the windows for PSFs of `size` pixels; none for a volume."""
    if len(shape) != 2:
        return (0,)
    return tuple(min(side, max(SIDE, PSFS * size)) // 2 * 2 for side in shape)


@dataclass(frozen=True, slots=True, eq=False)
class Spectra:
    """Mean powers of a blurred picture, and of the windows through which it is seen.

    Parameters
    ----------
    shape : (P, Q)
        Of the windows, even.
    blurred, tapers : ndarray, shape (P, Q // 2 + 1)
        Half spectra; noise of variance 1 has a mean power of 1 in the first.
    share : float
        Of the windows that is away from clipped pixels.
    """

    shape: tuple[int, ...]
    blurred: FloatArray
    tapers: FloatArray
    share: float

    @classmethod
    def seen(
        cls,
        parts: Sequence[FloatArray],
        clipped: Sequence[BoolArray] | None,
        shape: tuple[int, ...],
    ) -> "Spectra":
        """Through windows of a shape, away from clipped pixels."""
        hann = np.outer(*(signal.windows.hann(side, sym=False) for side in shape))
        blurred, tapers = np.zeros((2, shape[0], shape[1] // 2 + 1))
        whole, area = _powers(hann), 0.0
        places = evenly([*product(range(len(parts)), _boxes(parts[0].shape, shape))], WINDOWS)
        for part, box in places:
            lost = None if clipped is None else arrays.to_numpy(clipped[part][box])
            taper = hann if lost is None or not lost.any() else hann * _away_from(lost)
            window = arrays.to_numpy(parts[part][box])
            mean = (window * taper).sum() / max(taper.sum(), NOTHING)
            blurred += _powers((window - mean) * taper)
            tapers += whole if taper is hann else _powers(taper)
            area += np.square(taper).sum()
        share = float(area / np.square(hann).sum() / len(places))
        return cls(shape, blurred / max(area, NOTHING), tapers / max(area, NOTHING), share)

    def explained_by(self, psf: FloatArray) -> SpectralFit:
        """The fit of what this PSF lets through."""
        lags = fft.irfft2(_powers(psf, self.shape), self.shape)
        lags *= fft.irfft2(self.tapers, self.shape)
        return SpectralFit.of(self.blurred, fft.rfft2(lags).real)


def _away_from(clipped: BoolArray) -> FloatArray:
    """1 far from clipped pixels, 0 at them, and between so smooth that it adds nothing."""
    distance = ndimage.distance_transform_edt(~clipped)
    mask: FloatArray = 0.5 - 0.5 * np.cos(np.pi * np.minimum(distance / RAMP, 1))
    return mask


def evenly(items: Sequence[T], most: int) -> list[T]:
    """At most so many of the items, the first and the last among them, evenly in between."""
    places = np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int)
    return [items[place] for place in places]


def _boxes(shape: tuple[int, ...], sides: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """Windows that overlap by half or more, evenly over a plane."""
    starts = [
        np.linspace(0, length - side, 1 + int(np.ceil(2 * (length - side) / side))).astype(int)
        for length, side in zip(shape, sides, strict=True)
    ]
    for top in starts[0].tolist():
        for left in starts[1].tolist():
            yield slice(top, top + sides[0]), slice(left, left + sides[1])


def _powers(plane: FloatArray, shape: tuple[int, ...] | None = None) -> FloatArray:
    """Half of the power spectrum."""
    powers: FloatArray = np.square(np.abs(fft.rfft2(plane, shape)))
    return powers
