"""A family of responses at work: what light it records, and how that follows its coefficients."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ..._typing import FloatArray, Image
from ...response.prior import NODES, ResponsePrior

LAST = NODES.size - 1
STEPS = np.diff(NODES)
# Between every eighth node the curve must rise by this share of its mean rise there, or pay.
RISING = np.arange(0, NODES.size, 8)
LEAST_RISE = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Exposure:
    """What a response makes of light of any shape.

    Parameters
    ----------
    intensity : ndarray
        ``f(E)``.
    gain : ndarray, shape of `intensity`
        ``df / dE``.
    sensitivity : ndarray, shape (..., n)
        ``df / dc_i``.
    """

    intensity: FloatArray
    gain: FloatArray
    sensitivity: FloatArray


@dataclass(frozen=True, eq=False)
class Family:
    """The response of a prior at given coefficients, for any light.

    Below 0 it goes on as ``f(-E) = -f(E)``, above 1 along its last slope, so that the estimate
    of a side may leave the range while it is searched.

    Parameters
    ----------
    prior : ResponsePrior
    coefficients : ndarray, shape (n,)
        In standard deviations; the curve need not rise.
    """

    prior: ResponsePrior
    coefficients: FloatArray

    @cached_property
    def samples(self) -> FloatArray:
        """``f`` at the nodes of the prior."""
        return np.asarray(self.prior.mean + self.coefficients @ self.prior.directions)

    @cached_property
    def _rises(self) -> FloatArray:
        """Steps of ``f`` from node to node."""
        return np.diff(self.samples)

    def record(self, light: FloatArray) -> FloatArray:
        """``f(E)`` alone."""
        piece, share = _located(light)
        share *= self._rises[piece]
        share += self.samples[piece]
        share *= np.sign(light)
        return share

    def expose(self, light: FloatArray) -> Exposure:
        """``f(E)`` and its derivatives."""
        piece, share = _located(light)
        sign = np.sign(light)
        columns, steps = _columns(self.prior)
        sensitivity = columns[piece] + share[..., np.newaxis] * steps[piece]
        return Exposure(
            intensity=sign * (self.samples[piece] + share * self._rises[piece]),
            gain=(self._rises / STEPS)[piece],
            sensitivity=sign[..., np.newaxis] * sensitivity,
        )

    def undo(self, intensity: FloatArray) -> FloatArray:
        """Light that the rising curve next to this one records as the given intensity."""
        rising = np.maximum.accumulate(self.samples) + 1e-9 * NODES
        return np.interp(intensity, rising, NODES)

    def penalty(self, weight: float) -> tuple[float, FloatArray, FloatArray]:
        """Half the squares of what the curve falls short of rising, gradient and Hessian."""
        scale = (RISING.size - 1) / LEAST_RISE * np.sqrt(weight)
        rises = np.diff(self.samples[RISING])
        short = np.minimum(rises * scale - np.sqrt(weight), 0)
        change = np.diff(self.prior.directions[:, RISING])[:, short < 0] * scale
        return 0.5 * float(short @ short), change @ short[short < 0], change @ change.T


@lru_cache(maxsize=8)
def _columns(prior: ResponsePrior) -> tuple[FloatArray, FloatArray]:
    """Directions of a prior, node by node, shape (513, n), and their steps between nodes."""
    columns = np.ascontiguousarray(prior.directions.T)
    return columns, np.diff(columns, axis=0)


def _located(light: FloatArray) -> tuple[Image, FloatArray]:
    """Piece between nodes where the size of the light lies, and share of it: above 1 beyond 1."""
    size = np.abs(light)
    piece = np.minimum((np.sqrt(size) * LAST).astype(np.int64), LAST - 1)
    return piece, (size - NODES[piece]) / STEPS[piece]
