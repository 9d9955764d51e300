"""What is known of the response after the fit: its spread, and the error to expect."""

from dataclasses import dataclass

import numpy as np

from ..._typing import FloatArray
from ...response.prior import ResponsePrior
from .family import Family
from .search import Solution

SAMPLES = 129  # intensities at which the error to expect is judged
# Slope of the response, as a share of its mean, below which the irradiance is not resolved.
LEAST_GAIN = 0.02
# By how much the variance is larger than computed, that of the prior, too: no camera is drawn
# from a normal distribution, nor is its response a sum of a few curves.
WIDENED = 4.0
# By how much more in offset and scale, which no edge tells: they follow from the form of the
# response below the darkest edge and above the brightest one.
UNSEEN = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class ResponsePosterior:
    """Coefficients of the response as a normal distribution.

    Parameters
    ----------
    prior : ResponsePrior
        The family.
    coefficients : ndarray, shape (n,)
        Most probable ones.
    covariance : ndarray, shape (n, n)
        As the model computes it; the truth of simulated and real responses demands
        ``WIDENED`` times as much.
    """

    prior: ResponsePrior
    coefficients: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, found: Solution) -> "ResponsePosterior":
        """Inverse Hessian, and the scatter of the edges: what the model expects and what is.

        The first knows no wrong model, the second no direction of which no edge speaks. Their
        sum does not go beyond the prior.
        """
        inverse = np.linalg.inv(found.normal.hessian)
        scores = found.normal.scores
        scatter = inverse @ (scores.T @ scores) @ inverse
        return cls(found.problem.prior, found.state.coefficients, _within_prior(inverse + scatter))

    @classmethod
    def before(cls, prior: ResponsePrior) -> "ResponsePosterior":
        """The prior itself."""
        return cls(prior, np.zeros(prior.size), np.eye(prior.size))

    @property
    def narrowed(self) -> ResponsePrior:
        """The prior of the next photo of this camera: widened, but not beyond that of this one."""
        covariance = _within_prior(WIDENED * self.covariance)
        return self.prior.narrowed(self.coefficients, covariance)

    def deviation(self, intensity: FloatArray, covered: tuple[float, float]) -> FloatArray:
        """Standard deviation of the irradiance at given intensities, shape (N,).

        Parameters
        ----------
        intensity : ndarray, shape (N,)
        covered : (float, float)
            Range of intensity of which edges speak, up to offset and scale.
        """
        seen = np.linspace(*covered, SAMPLES)
        light = self._light(seen)
        ends = np.clip(light[[0, -1]], 1e-6, 1 - 1e-6)
        # What moves the covered part as a whole, by its values at the ends of that part.
        affine = np.stack([1 - light, light], axis=1)
        moved = np.linalg.lstsq(affine, self._change(seen), rcond=None)[0]
        at_ends = np.stack([1 - light[[0, -1]], light[[0, -1]]], axis=1) @ moved
        share = [
            np.interp(self._light(intensity), [0, *ends, 1], [0, *hat, 0]) for hat in np.eye(2)
        ]
        whole = np.stack(share, axis=1) @ at_ends
        return self._spread(self._change(intensity) + (np.sqrt(UNSEEN) - 1) * whole)

    def expected_error(self, covered: tuple[float, float]) -> float:
        """Root mean square irradiance error to expect, after the best affine alignment."""
        intensity = np.linspace(*covered, SAMPLES)
        affine = np.stack([np.ones(SAMPLES), self._light(intensity)], axis=1)
        aligned = np.linalg.qr(affine).Q
        change = self._change(intensity)
        spread = self._spread(change - aligned @ (aligned.T @ change))
        return float(np.sqrt(np.mean(spread**2)))

    def _light(self, intensity: FloatArray) -> FloatArray:
        return self.prior.curve(self.coefficients).to_irradiance(intensity)

    def _change(self, intensity: FloatArray) -> FloatArray:
        """Change of the irradiance at given intensities with each coefficient, (N, n)."""
        exposure = Family(self.prior, self.coefficients).expose(self._light(intensity))
        return np.asarray(-exposure.sensitivity / np.maximum(exposure.gain, LEAST_GAIN)[:, None])

    def _spread(self, change: FloatArray) -> FloatArray:
        variance = np.einsum("ni,ij,nj->n", change, WIDENED * self.covariance, change)
        return np.asarray(np.sqrt(variance))


def _within_prior(covariance: FloatArray) -> FloatArray:
    """A covariance that in no direction exceeds that of the prior, 1."""
    sizes, axes = np.linalg.eigh(covariance)
    return np.asarray((axes * np.minimum(sizes, 1)) @ axes.T)
