"""What is known of the response after the fit: its spread, and the error to expect."""

from dataclasses import dataclass

import numpy as np

from ..._typing import FloatArray
from ...response.prior import ResponsePrior
from .family import Family
from .search import Found

SAMPLES = 129  # intensities at which the error to expect is judged
# Slope of the response, as a share of its mean, below which the irradiance is not resolved.
LEAST_GAIN = 0.02
# By how much the variance is larger than computed: no camera is drawn from a normal
# distribution, nor is its response a sum of a few curves.
WIDENED = 2.5


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Coefficients of the response as a normal distribution.

    Parameters
    ----------
    prior : ResponsePrior
        The family.
    coefficients : ndarray, shape (n,)
        Most probable ones.
    covariance : ndarray, shape (n, n)
    """

    prior: ResponsePrior
    coefficients: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, found: Found) -> "Posterior":
        """Inverse Hessian, and the scatter of the edges: what the model expects and what is.

        The first knows no wrong model, the second no direction of which no edge speaks. Their
        sum is widened as the truth of simulated and real responses demands, but not beyond
        the prior.
        """
        inverse = np.linalg.inv(found.normal.hessian)
        scores = found.normal.scores
        scatter = inverse @ (scores.T @ scores) @ inverse
        sizes, axes = np.linalg.eigh(WIDENED * (inverse + scatter))
        covariance = (axes * np.minimum(sizes, 1)) @ axes.T
        return cls(found.problem.prior, found.state.coefficients, covariance)

    @classmethod
    def before(cls, prior: ResponsePrior) -> "Posterior":
        """The prior itself."""
        return cls(prior, np.zeros(prior.size), np.eye(prior.size))

    def irradiance_map(self, intensity: FloatArray) -> FloatArray:
        """Change of the irradiance at given intensities with each coefficient, (N, n)."""
        family = Family(self.prior, self.coefficients)
        exposure = family.expose(self.prior.curve(self.coefficients).to_irradiance(intensity))
        return np.asarray(-exposure.sensitivity / np.maximum(exposure.gain, LEAST_GAIN)[:, None])

    def deviation(self, intensity: FloatArray) -> FloatArray:
        """Standard deviation of the irradiance at given intensities, shape (N,)."""
        change = self.irradiance_map(intensity)
        return np.asarray(np.sqrt(np.einsum("ni,ij,nj->n", change, self.covariance, change)))

    def expected_error(self, covered: tuple[float, float]) -> float:
        """Root mean square irradiance error to expect, after the best affine alignment."""
        intensity = np.linspace(*covered, SAMPLES)
        irradiance = self.prior.curve(self.coefficients).to_irradiance(intensity)
        aligned = np.linalg.qr(np.stack([np.ones(SAMPLES), irradiance], axis=1)).Q
        change = self.irradiance_map(intensity)
        change = change - aligned @ (aligned.T @ change)
        return float(np.sqrt(np.einsum("ni,ij,nj->", change, self.covariance, change) / SAMPLES))
