"""The gradient of the sharp picture as a distribution: what is likely, and how uncertain it is."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import fft, signal

from ...._typing import FloatArray
from ....fourier import ComplexArray, Shape, fast_shape, otf
from ..blurred import Blurred
from .nonnegative import NonnegativeFit

STEPS = 5  # of conjugate gradients: they go on from the gradient of the step before
SIDES = 2  # components of a gradient: along rows and along columns
FIRST_ENERGY = 3.0  # of a sharp gradient, before it is known, in that of the blurred one
WHOLLY = 0.999  # how far a gradient must be usable to be used


@dataclass(frozen=True, slots=True, eq=False)
class GradientPosterior:
    """Normal distribution of every gradient of the sharp picture.

    Parameters
    ----------
    mean : ndarray, shape (2, P, Q)
        Forward differences along rows and along columns, on a periodic grid.
    variance : ndarray, shape (1, P, Q)
        Of either difference.
    precision : ndarray, shape (1, P, Q)
        Of the prior of either difference at its most probable width.
    """

    mean: FloatArray
    variance: FloatArray
    precision: FloatArray

    def shifted(self, rows: int, columns: int) -> "GradientPosterior":
        """The same, moved by whole pixels."""
        parts = (self.mean, self.variance, self.precision)
        return GradientPosterior(*(np.roll(part, (rows, columns), axis=(1, 2)) for part in parts))


@dataclass(frozen=True, slots=True, eq=False)
class BlurredGradient:
    """Gradient of a blurred picture, and what it says of the sharp one and of the PSF.

    The model is ``b = k * h * s + n``: `s` is the gradient of a picture of steps, `h` the softness
    of a sharp photo, `k` the PSF, `n` normal noise; outside the frame and near clipped pixels
    nothing is known. Each pair `s` of differences is normal of a variance ``v`` of its own, of
    which nothing is known but that it is a scale, ``p(v) ~ 1 / v``: few gradients are large, and
    most are nearly 0.

    Parameters
    ----------
    measured : ndarray, shape (2, P, Q)
        `b`, 0 where nothing is known.
    known : ndarray, shape (2, P, Q)
        1 where `b` is known, 0 elsewhere.
    softness : ndarray, shape (3, 3)
        `h`, sum 1.
    size : int
        Sides of the array that holds the PSF, pixels.
    """

    measured: FloatArray
    known: FloatArray
    softness: FloatArray
    size: int

    @classmethod
    def of(cls, blurred: Blurred, size: int, softness: float) -> "BlurredGradient":
        """For PSFs of at most `size` pixels, and `h` of that standard deviation in pixels."""
        rows, columns = blurred.plane.shape
        # two pixels more for the softness
        shape = fast_shape((rows + size + 2, columns + size + 2))
        measured, known = np.zeros((2, 2, *shape), dtype=blurred.plane.dtype)
        usable = 1.0 if blurred.usable is None else blurred.usable >= WHOLLY
        known[:, :rows, :columns] = usable
        known[0, rows - 1] = known[1, :, columns - 1] = 0
        measured[:, :rows, :columns] = blurred.gradient()
        return cls(known * measured, known, soft_point(softness), size)

    def assuming(self, softness: float) -> "BlurredGradient":
        """The same, but for `h` of another standard deviation in pixels."""
        return replace(self, softness=soft_point(softness))

    @property
    def shape(self) -> Shape:
        """Of the periodic grid."""
        return self.measured.shape[1], self.measured.shape[2]

    def unknown(self) -> GradientPosterior:
        """What is known of the sharp gradient before there is a PSF."""
        energy = FIRST_ENERGY * np.square(self.measured).sum() / self.known.sum()
        nothing = np.zeros_like(self.measured)
        return GradientPosterior(nothing, nothing[:1], np.full_like(nothing[:1], 1 / energy))

    def posterior(
        self, psf: FloatArray, noise: float, before: GradientPosterior
    ) -> GradientPosterior:
        """Distribution of the sharp gradient, given the PSF and what it was `before`.

        Minimizes ``|M (k * h * s - b)|^2 + noise^2 p |s|^2``, `M` what is known, `p` the precision
        `before`, by a few conjugate gradients; the variance is that of independent gradients.
        The new precision is that of the most probable widths, ``p = 4 / E |s|^2``: the minimum over
        `v` of ``E |s|^2 / v + 4 log v``, half of the logarithms from `p(v)`.
        """
        blur = signal.convolve(psf, self.softness, method="direct")
        held, gain = noise**2 * before.precision, float(np.vdot(blur, blur))
        mean = self._minimum(self._transfer(blur), held, 1 / (gain + held), before.mean)
        variance = noise**2 / (gain + held)
        energy = np.square(mean).sum(axis=0, keepdims=True) + SIDES * variance
        return GradientPosterior(mean, variance, 2 * SIDES / energy)

    def refit(self, psf: FloatArray, posterior: GradientPosterior) -> FloatArray:
        """PSF of least expected misfit, not negative, sum 1: one step of expectation-maximization.

        The variance of the gradients stands beside ``|k|^2``: gradients that are uncertain cannot
        sharpen the PSF. Where nothing is known, `b` is what the PSF so far predicts.
        """
        soft = fft.rfft2(posterior.mean) * self._transfer(self.softness)
        predicted = fft.irfft2(soft * self._transfer(psf), self.shape, overwrite_x=True)
        completed = np.where(self.known > 0, self.measured, predicted)
        fit = NonnegativeFit.of(soft, fft.rfft2(completed), self.shape, len(psf))
        uncertain = SIDES * float(posterior.variance.sum(dtype=np.float64))
        found = np.asarray(fit.solve(uncertain, psf), np.float64)
        return np.asarray(found / found.sum()) if found.any() else psf

    def energy(self, psf: FloatArray, noise: float, posterior: GradientPosterior) -> float:
        """How unlikely the blurred picture is with this PSF, for each pixel; less is better.

        ``|M (k * h * s - b)|^2 / noise^2 + p |s|^2 + 2 sum log(1 + |k * h|^2 / (p noise^2))``:
        the cost of Wipf & Zhang (2014), with variances ``1 / p``. It bounds
        minus twice the logarithm of the evidence, but for a constant, with the variances at the
        values that the posterior found, not at those that would make the bound tightest.
        """
        blur = signal.convolve(psf, self.softness, method="direct")
        spectrum = fft.rfft2(posterior.mean) * self._transfer(blur)
        misses = self.known * fft.irfft2(spectrum, self.shape, overwrite_x=True) - self.measured
        gain = float(np.vdot(blur, blur)) / noise**2
        widths = SIDES * np.log1p(gain / posterior.precision).sum(dtype=np.float64)
        sizes = (posterior.precision * posterior.mean**2).sum(dtype=np.float64)
        misfit = np.square(misses, dtype=np.float64).sum() / noise**2
        return float((misfit + sizes + widths) / self.known[0].sum(dtype=np.float64))

    def _transfer(self, psf: FloatArray) -> ComplexArray:
        return otf(psf, self.shape, self.measured.dtype)

    def _minimum(
        self, transfer: ComplexArray, held: FloatArray, scale: FloatArray, start: FloatArray
    ) -> FloatArray:
        """Conjugate gradients from `start`, preconditioned by `scale`."""
        back = np.conj(transfer)

        def seen(values: FloatArray) -> FloatArray:
            spectrum = fft.rfft2(values)
            spectrum *= transfer
            blurred = fft.irfft2(spectrum, self.shape, overwrite_x=True)
            blurred *= self.known
            return np.asarray(blurred)

        def returned(values: FloatArray) -> FloatArray:
            spectrum = fft.rfft2(values, overwrite_x=True)
            spectrum *= back
            return np.asarray(fft.irfft2(spectrum, self.shape, overwrite_x=True))

        mean = start.copy()
        residual = returned(self.measured - seen(mean))
        residual -= held * mean
        scaled = scale * residual
        direction, left = scaled.copy(), float(np.vdot(residual, scaled))
        for _ in range(STEPS):
            if not left > 0:
                break
            image = returned(seen(direction))
            image += held * direction
            step = left / float(np.vdot(direction, image))
            mean += step * direction
            image *= step
            residual -= image
            np.multiply(scale, residual, out=scaled)
            before, left = left, float(np.vdot(residual, scaled))
            direction *= left / before
            direction += scaled
        return mean


def soft_point(deviation: float) -> FloatArray:
    """A point as soft as a sharp picture is: 3 x 3 pixels, of this standard deviation in pixels."""
    side = deviation**2 / 2
    profile = np.array([side, 1 - 2 * side, side])
    return np.outer(profile, profile)
