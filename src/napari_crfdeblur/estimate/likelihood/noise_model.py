"""How much a sample of a profile counts: its noise, what no model explains, and bad edges."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from .evidence import EdgeGroup

LARGEST = 1e6  # squares of it and of its inverse keep within floats


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Variance of a sample around the model, in recorded intensity.

    Its measured variance (read and photon noise, rounding) plus what the model does not
    explain: a floor, and a share of the contrast of its profile for sides that are not quite
    even and edges that are not quite steps.

    Parameters
    ----------
    floor : float
        Standard deviation of what is left of any profile, in intensity.
    mismatch : float
        Standard deviation of what is left of a profile, as a share of its contrast.
    freedom : float
        Degrees of freedom of Student's distribution of whole edges: with few, an edge that
        fits badly hardly counts.
    """

    floor: float = 1e-3
    mismatch: float = 0.0
    freedom: float = 1.0

    def __post_init__(self) -> None:
        arguments.number(self.floor, "a positive floor", least=1e-9, most=LARGEST)
        arguments.number(self.mismatch, "a mismatch", least=0, most=LARGEST)
        arguments.number(self.freedom, "a positive freedom", least=1e-9, most=LARGEST)

    def weights(self, groups: Sequence[EdgeGroup], evidence: float = 1.0) -> list[FloatArray]:
        """Inverse variance of each sample, shape (E, C, M + 2), for each group.

        `evidence` is the share of the samples that count as independent.
        """
        return [self._weights(group, evidence) for group in groups]

    def _weights(self, group: EdgeGroup, evidence: float) -> FloatArray:
        contrast = (group.intensity[..., -1:] - group.intensity[..., -2:-1]) * self.mismatch
        variance = group.variance + self.floor**2 + contrast**2
        return np.where(group.present[..., np.newaxis], evidence / variance, 0.0)

    def trust(self, group: EdgeGroup, misfit: FloatArray) -> FloatArray:
        """Weight of each edge, shape (E,), given its sum of squared residuals over variances."""
        return np.asarray((self.freedom + 1) / (self.freedom + misfit / group.samples))
