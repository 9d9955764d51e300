"""Which of several PSFs is right: the restored picture is sparse, the spectrum has their zeros."""

from dataclasses import dataclass

import numpy as np

from ..._typing import BoolArray, FloatArray
from ...fourier import correlate, forward, gradient_power, inverse, otf, power
from ..misfit import Spectra, window_for
from .blurred import Blurred
from .edge_prediction import continued, divergence, gradient

# Total variation of a picture of contrast 1. Of .01, .02, .04, .08 and .16 the middle chose the
# best of 24 PSFs most often: less lets what rings decide, more takes what the PSF would restore.
WEIGHT = 0.03
FIRST_COUPLING, GROWTH, STAGES = 0.12, 2 * 2**0.5, 6  # of the gradient to its shrunk one
# Of the likelihood of the spectrum beside the logarithm of the sparsity. On 28 photos that served
# for the choice .25 to 4 chose alike, but for large blur at night, for which more than 1 is worse.
# On 18 others less than 1 was worse, by up to .09 in the mean similarity: too large a PSF restores
# sparsely, and its spectrum tells it.
SPECTRUM = 1.0
LEAST_SEEN = 0.15  # of the picture away from clipped light: with less, all of it counts


@dataclass(frozen=True, slots=True, eq=False)
class Plausibility:
    """Judge of PSFs for one blurred picture.

    Two things tell right PSFs from wrong ones on photos of known truth, where residuals, negative
    light and plain sparsity do not:

    - the *normalized sparsity* of the restored picture, ``mean |D x| / rms |D x|`` (Krishnan, Tay &
      Fergus 2011, Blind deconvolution using a normalized sparsity measure, CVPR): blur and ringing
      both raise it;
    - the *spectrum*: what the PSF blocks has to be missing in it. The mean logarithm of the
      likelihood of :class:`~napari_crfdeblur.psf.spectral_fit.SpectralFit`.

    Parameters
    ----------
    periodic : ndarray, shape (P, Q)
        The plane, continued so that it can be repeated.
    seen : ndarray of bool, shape (M, N)
        What counts: not the border, nor what lies near clipped light.
    spectra : Spectra
        Of the plane.
    """

    periodic: FloatArray
    seen: BoolArray
    spectra: Spectra

    @classmethod
    def of(cls, blurred: Blurred, size: int) -> "Plausibility":
        """For PSFs whose extent is about `size` pixels."""
        plane = blurred.plane
        lost = np.zeros(plane.shape, bool) if blurred.usable is None else blurred.usable < 1
        seen = np.asarray(~lost)
        if seen.mean() < LEAST_SEEN:
            seen = np.ones(plane.shape, bool)
        spectra = Spectra.seen([plane], [~seen], window_for(plane.shape, size))
        border = min(size // 2 + 2, min(plane.shape) // 4)
        inner = np.zeros(plane.shape, bool)
        inner[border:-border, border:-border] = True
        return cls(continued(plane, size), seen & inner, spectra)

    def judge(self, psf: FloatArray) -> float:
        """How plausible a PSF is: likelihood of the spectrum less the logarithm of the sparsity."""
        return SPECTRUM * self.spectra.explained_by(psf).likelihood() - float(
            np.log(self.sparsity(psf))
        )

    def sparsity(self, psf: FloatArray) -> float:
        """Normalized sparsity of the picture restored with a PSF, in (0, 1]; less is sparser."""
        rows, columns = self.seen.shape
        steps = np.hypot(*gradient(self._restored(psf)[:rows, :columns]))[self.seen]
        return float(steps.mean() / np.sqrt(np.square(steps, dtype=np.float64).mean()))

    def _restored(self, psf: FloatArray) -> FloatArray:
        """Minimum of ``1/2 |k * x - y|^2 + w |D x|_1``, by half-quadratic splitting."""
        sharp, shape = self.periodic, self.periodic.shape
        transfer = otf(psf, shape, sharp.dtype)
        blurred, gain = forward(correlate(sharp, transfer)), power(transfer)
        rows, columns = gradient_power(shape, sharp.dtype)
        smoothing, coupling = rows[:, None] + columns, FIRST_COUPLING
        for _ in range(STAGES):
            down, across = np.roll(sharp, -1, axis=0) - sharp, np.roll(sharp, -1, axis=1) - sharp
            length = np.maximum(np.hypot(down, across), np.finfo(sharp.dtype).tiny)
            left = np.maximum(1 - WEIGHT / (coupling * length), 0)
            spectrum = forward(divergence(left * down, left * across))
            spectrum *= coupling
            spectrum += blurred
            spectrum /= gain + coupling * smoothing
            sharp = inverse(spectrum, shape)
            coupling *= GROWTH
        return sharp
