"""A family of responses at work: what light it records, and how that follows its coefficients."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..._typing import FloatArray
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


@dataclass(frozen=True, slots=True, eq=False)
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

    @property
    def samples(self) -> FloatArray:
        """``f`` at the nodes of the prior."""
        return np.asarray(self.prior.mean + self.coefficients @ self.prior.directions)

    def record(self, light: FloatArray) -> FloatArray:
        """``f(E)`` alone."""
        samples = self.samples
        beyond, piece, share = _located(light)
        recorded = samples[piece] + share * np.diff(samples)[piece]
        last = (samples[-1] - samples[-2]) / STEPS[-1]
        return np.asarray(np.sign(light) * (recorded + last * beyond))

    def expose(self, light: FloatArray) -> Exposure:
        """``f(E)`` and its derivatives."""
        samples = self.samples
        gains = np.diff(samples) / STEPS
        beyond, piece, share = _located(light)
        sign = np.sign(light)
        gain = gains[piece]
        recorded = samples[piece] + share * STEPS[piece] * gain + gains[-1] * beyond
        lower = _columns(self.prior)[piece]
        lower += share[..., np.newaxis] * (_columns(self.prior)[piece + 1] - lower)
        lower *= sign[..., np.newaxis]
        return Exposure(sign * recorded, gain, lower)

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


@cache
def _columns(prior: ResponsePrior) -> FloatArray:
    """Directions of a prior, node by node: shape (513, n)."""
    return np.ascontiguousarray(prior.directions.T)


def _located(light: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Size of the light beyond 1; piece between nodes in which it is up to 1, share of that."""
    size = np.abs(light)
    beyond = np.maximum(size - 1, 0)
    size = np.minimum(size, 1)
    piece = np.minimum((np.sqrt(size) * LAST).astype(np.int64), LAST - 1)
    return beyond, piece, (size - NODES[piece]) / STEPS[piece]
