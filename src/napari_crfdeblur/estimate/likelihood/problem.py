"""The posterior of a response given profiles: its value, and its normal equations.

Minimized is half of ::

    sum_ecm u_ecm (I_ecm - f(E_ecm))^2 + |c|^2 + sum_e a_e' P a_e + penalty(c)

over the response, shapes, sides and shifts. Residuals are those of the recorded intensity,
so that no change of variables enters. Every edge has unknowns of its own, every group a shape:
they are eliminated one after the other (Schur complements), down to the few coefficients `c`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..._typing import FloatArray
from ...response.prior import ResponsePrior
from .evidence import EdgeGroup
from .family import Family
from .model import GroupState, State, predict

MONOTONE_WEIGHT = 1.0  # a curve that is level where it should rise costs half a unit a step
# Added to the diagonals of what is eliminated, far below what any profile says: a shape that no
# profile shows stays where it is.
RIDGE = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """What is known of the shape of a group beforehand.

    Parameters
    ----------
    shape : ndarray, shape (M,)
        Edge spread.
    precision : float
        Inverse variance of the true shape around it; 0 if nothing is known.
    """

    shape: FloatArray
    precision: float


@dataclass(frozen=True, slots=True)
class Shift:
    """How far profiles lie beside their places, as standard deviations in pixels.

    Parameters
    ----------
    edge : float
        Of an edge, with all its channels.
    channel : float
        Of one channel of an edge besides: lenses and sensors do not register channels exactly.
    """

    edge: float
    channel: float

    def precision(self, channels: int) -> FloatArray:
        """Inverse covariance `P` of the shifts of the channels of an edge, shape (C, C)."""
        return _precision(self.edge, self.channel, channels)


@lru_cache(maxsize=64)
def _precision(edge: float, channel: float, channels: int) -> FloatArray:
    precision = np.linalg.inv(channel**2 * np.eye(channels) + edge**2)
    precision.setflags(write=False)
    return precision


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Profiles, how much each sample counts, and what is known beforehand.

    Parameters
    ----------
    prior : ResponsePrior
        Of the response.
    groups : sequence of EdgeGroup
        The profiles.
    weights : sequence of ndarray, shape (E, C, M + 2)
        `u` of each group: inverse variance of each sample, 0 where there is none.
    shift : Shift
        How far profiles lie beside their places.
    expected : sequence of Expected or None
        Shape of each group, if the PSF is known.
    """

    prior: ResponsePrior
    groups: Sequence[EdgeGroup]
    weights: Sequence[FloatArray]
    shift: Shift
    expected: Sequence[Expected | None]

    def family(self, state: State) -> Family:
        """The response of a state."""
        return Family(self.prior, state.coefficients)

    def misfits(self, state: State) -> list[FloatArray]:
        """Weighted sum of squared residuals of each edge, shape (E,), for each group."""
        family = self.family(state)
        found = []
        for group, weight, own in zip(self.groups, self.weights, state.groups, strict=True):
            residual = group.intensity - family.record(predict(group, own).light)
            found.append(np.einsum("ecm,ecm,ecm->e", weight, residual, residual))
        return found

    def value(self, state: State) -> float:
        """What is minimized."""
        total = float(state.coefficients @ state.coefficients)
        total += sum(float(misfit.sum()) for misfit in self.misfits(state))
        for own, known in zip(state.groups, self.expected, strict=True):
            precision = self.shift.precision(own.shift.shape[1])
            total += float(np.einsum("ec,cd,ed->", own.shift, precision, own.shift))
            if known is not None:
                total += known.precision * float(np.sum((own.shape - known.shape) ** 2))
        return total / 2 + self.family(state).penalty(MONOTONE_WEIGHT)[0]

    def normal(self, state: State) -> "Normal":
        """Normal equations about a state, reduced to the coefficients."""
        family = self.family(state)
        _, slope, curvature = family.penalty(MONOTONE_WEIGHT)
        parts = [
            self._reduced(family, group, weight, own, known)
            for group, weight, own, known in zip(
                self.groups, self.weights, state.groups, self.expected, strict=True
            )
        ]
        hessian = np.eye(self.prior.size) + curvature + sum(p.hessian for p in parts)
        gradient = state.coefficients + slope + sum(p.gradient for p in parts)
        return Normal(hessian, gradient, tuple(parts))

    def _reduced(
        self,
        family: Family,
        group: EdgeGroup,
        weight: FloatArray,
        own: GroupState,
        known: Expected | None,
    ) -> "GroupNormal":
        """Normal equations of one group without its edges' own unknowns and its shape."""
        found = predict(group, own)
        exposure = family.expose(found.light)
        root = np.sqrt(weight)
        edges, channels, samples = weight.shape
        size, count = self.prior.size, own.shape.size
        residual = (exposure.intensity - group.intensity) * root
        gain = exposure.gain * root
        by_response = exposure.sensitivity * root[..., np.newaxis]
        by_spread = gain * own.light[..., 1:]
        # An edge's own unknowns: l, w and shift of each channel.
        own_size = 3 * channels
        by_own = np.zeros((edges, channels, samples, own_size))
        for c in range(channels):
            by_own[:, c, :, 3 * c] = gain[:, c]
            by_own[:, c, :, 3 * c + 1] = gain[:, c] * found.spread[:, c]
            by_own[:, c, :, 3 * c + 2] = by_spread[:, c] * found.slope
        flat = by_own.reshape(edges, -1, own_size).transpose(0, 2, 1)
        # Only sample m of a profile follows the shape at m.
        spread_part = by_spread[..., :count]
        cross = np.einsum("ecml,ecm->elm", by_own[:, :, :count], spread_part)
        precision = self.shift.precision(channels)
        square = flat @ flat.transpose(0, 2, 1)
        square[:, range(own_size), range(own_size)] += RIDGE
        square[:, 2::3, 2::3] += precision
        slope = (flat @ residual.reshape(edges, -1, 1))[..., 0]
        slope[:, 2::3] += own.shift @ precision
        others = np.concatenate(
            [flat @ by_response.reshape(edges, -1, size), cross, slope[..., np.newaxis]], axis=2
        )
        solved = np.linalg.inv(square) @ others
        # What every edge says of the response and of the shape, its own unknowns gone.
        scores = np.concatenate(
            [
                np.einsum("ecmn,ecm->en", by_response, residual),
                np.einsum("ecm,ecm->em", spread_part, residual[..., :count]),
            ],
            axis=1,
        ) - np.einsum("elp,el->ep", others[..., :-1], solved[..., -1])
        width = size + count
        full = -others[..., :-1].reshape(-1, width).T @ solved[..., :-1].reshape(-1, width)
        rows = by_response.reshape(-1, size)
        full[:size, :size] += rows.T @ rows
        mixed = np.einsum("ecmn,ecm->nm", by_response[:, :, :count], spread_part)
        full[:size, size:] += mixed
        full[size:, :size] += mixed.T
        full[range(size, width), range(size, width)] += np.einsum(
            "ecm,ecm->m", spread_part, spread_part
        )
        gradient = scores.sum(axis=0)
        full[range(size, width), range(size, width)] += RIDGE
        if known is not None:
            full[range(size, width), range(size, width)] += known.precision
            gradient[size:] += known.precision * (own.shape - known.shape)
        shape_solved = np.linalg.solve(
            full[size:, size:], np.column_stack([full[size:, :size], gradient[size:]])
        )
        return GroupNormal(
            hessian=full[:size, :size] - full[:size, size:] @ shape_solved[:, :-1],
            gradient=gradient[:size] - full[:size, size:] @ shape_solved[:, -1],
            scores=scores[:, :size] - scores[:, size:] @ shape_solved[:, :-1],
            shape=shape_solved,
            own=solved,
        )


@dataclass(frozen=True, slots=True, eq=False)
class GroupNormal:
    """What one group says of the coefficients, and how its unknowns follow them.

    Parameters
    ----------
    hessian, gradient : ndarray, shapes (n, n) and (n,)
        Of the coefficients, all else eliminated.
    scores : ndarray, shape (E, n)
        Share of each edge in the gradient.
    shape : ndarray, shape (M, n + 1)
        How the shape follows the coefficients, and its own step.
    own : ndarray, shape (E, L, n + M + 1)
        How an edge's own unknowns follow coefficients and shape, and their own step.
    """

    hessian: FloatArray
    gradient: FloatArray
    scores: FloatArray
    shape: FloatArray
    own: FloatArray

    def moved(self, state: GroupState, change: FloatArray, share: float) -> GroupState:
        """The state after `share` of the step that goes with a change of the coefficients."""
        shape = -(self.shape[:, -1] + self.shape[:, :-1] @ change)
        all_changes = np.concatenate([change, shape])
        own = -share * (self.own[..., -1] + self.own[..., :-1] @ all_changes)
        shape = share * shape
        own = own.reshape(*state.shift.shape, 3)
        return GroupState(
            state.shape + shape, state.light + own[..., :2], state.shift + own[..., 2]
        )


@dataclass(frozen=True, slots=True, eq=False)
class Normal:
    """Normal equations of the coefficients.

    Parameters
    ----------
    hessian, gradient : ndarray, shapes (n, n) and (n,)
        Prior and penalty included.
    groups : tuple of GroupNormal
    """

    hessian: FloatArray
    gradient: FloatArray
    groups: tuple[GroupNormal, ...]

    def step(self, state: State, damping: float, share: float) -> State:
        """The state after a share of a damped Gauss-Newton step (Levenberg and Marquardt).

        Damped are the coefficients; the share shortens the step of all that was eliminated, too.
        """
        damped = self.hessian + damping * np.diag(np.diag(self.hessian))
        change = -np.linalg.solve(damped, self.gradient)
        parts = zip(self.groups, state.groups, strict=True)
        moved = tuple(part.moved(own, change, share) for part, own in parts)
        return State(state.coefficients + share * change, moved)

    @property
    def scores(self) -> FloatArray:
        """Share of every edge of all groups in the gradient, shape (sum of E, n)."""
        return np.concatenate([part.scores for part in self.groups])
