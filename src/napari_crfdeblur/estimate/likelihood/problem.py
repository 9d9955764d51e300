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
from .model import GroupState, ModelState, predict

MONOTONE_WEIGHT = 1.0  # a curve that is level where it should rise costs half a unit a step
# Added to the diagonals of what is eliminated, far below what any profile says: a shape that no
# profile shows stays where it is.
RIDGE = 1e-3
# Of the step of what was eliminated: it is of first order, and can lead far astray.
SHARES = np.array([1.0, 0.25, 0.0])


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

    def family(self, state: ModelState) -> Family:
        """The response of a state."""
        return Family(self.prior, state.coefficients)

    def misfits(self, state: ModelState) -> list[FloatArray]:
        """Weighted sum of squared residuals of each edge, shape (E,), for each group."""
        family = self.family(state)
        parts = zip(self.groups, self.weights, state.groups, strict=True)
        return [_misfit(family, *part) for part in parts]

    def value(self, state: ModelState) -> float:
        """What is minimized."""
        family = self.family(state)
        parts = zip(self.groups, self.weights, self.expected, state.groups, strict=True)
        return _improbable(family) + sum(float(self._costs(family, *part)) for part in parts)

    def lowest(
        self, normal: "NormalEquations", state: ModelState, change: FloatArray
    ) -> tuple[ModelState, float]:
        """The state after a change of the coefficients, and its value.

        Of its own step, each group takes as much as suits it best: groups depend on each other
        by the coefficients only, and the few that their step would lead astray shall not hold
        up all others.
        """
        family = Family(self.prior, state.coefficients + change)
        total, found = _improbable(family), []
        for group, weight, known, own, part in zip(
            self.groups, self.weights, self.expected, state.groups, normal.groups, strict=True
        ):
            moved = part.moved(own, change, SHARES)
            costs = self._costs(family, group, weight, known, moved)
            best = int(np.argmin(costs))
            total += float(costs[best])
            found.append(moved.at(best))
        return ModelState(family.coefficients, tuple(found)), total

    def _costs(
        self,
        family: Family,
        group: EdgeGroup,
        weight: FloatArray,
        known: Expected | None,
        own: GroupState,
    ) -> FloatArray:
        """What one group adds to the value; shape (...) for several states side by side."""
        bound = own.shift @ self.shift.precision(own.shift.shape[-1])
        total = np.einsum("...ec,...ec->...", bound, own.shift)
        total = total + _misfit(family, group, weight, own).sum(axis=-1)
        if known is not None:
            total = total + known.precision * np.sum((own.shape - known.shape) ** 2, axis=-1)
        return np.asarray(total / 2)

    def normal(self, state: ModelState) -> "NormalEquations":
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
        return NormalEquations(hessian, gradient, tuple(parts))

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
        size, count, own_size = self.prior.size, own.shape.size, 3 * channels
        residual = (exposure.intensity - group.intensity) * root
        by_response = exposure.sensitivity * root[..., np.newaxis]
        # A profile's own unknowns, l, w and shift, in turn.
        by_own = np.empty((edges, channels, 3, samples))
        gain = np.multiply(exposure.gain, root, out=by_own[:, :, 0])
        by_spread = gain * own.light[..., 1:]
        np.multiply(gain, found.spread, out=by_own[:, :, 1])
        np.multiply(by_spread, found.slope, out=by_own[:, :, 2])
        # Only sample m of a profile follows the shape at m.
        spread_part = by_spread[..., :count]
        precision = self.shift.precision(channels)
        blocks = np.zeros((edges, channels, 3, channels, 3))
        each = np.arange(channels)
        blocks[:, each, :, each] = (by_own @ by_own.swapaxes(2, 3)).swapaxes(0, 1)
        blocks[:, :, 2, :, 2] += precision
        square = blocks.reshape(edges, own_size, own_size)
        square[:, range(own_size), range(own_size)] += RIDGE
        sides = np.empty((edges, channels, 3, size + count + 1))
        np.matmul(by_own, by_response, out=sides[..., :size])
        np.multiply(by_own[..., :count], spread_part[:, :, np.newaxis], out=sides[..., size:-1])
        sides[..., -1] = (by_own @ residual[..., np.newaxis])[..., 0]
        sides[:, :, 2, -1] += own.shift @ precision
        others = sides.reshape(edges, own_size, -1)
        solved = np.linalg.inv(square) @ others
        # What every edge says of the response and of the shape, its own unknowns gone.
        of_edge = by_response.reshape(edges, -1, size)
        scores = (
            np.concatenate(
                [
                    (residual.reshape(edges, 1, -1) @ of_edge)[:, 0],
                    np.einsum("ecm,ecm->em", spread_part, residual[..., :count]),
                ],
                axis=1,
            )
            - (solved[:, np.newaxis, :, -1] @ others[..., :-1])[:, 0]
        )
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

    def moved(self, state: GroupState, change: FloatArray, share: float | FloatArray) -> GroupState:
        """The state after a change of the coefficients and `share` of the group's own step.

        With several shares, shape (K,), their states side by side.
        """
        size = change.size
        shape = -np.multiply.outer(share, self.shape[:, -1]) - self.shape[:, :-1] @ change
        own = -np.multiply.outer(share, self.own[..., -1]) - self.own[..., :size] @ change
        own -= _along(self.own[..., size:-1], shape)
        own = own.reshape(*np.shape(share), *state.shift.shape, 3)
        return GroupState(
            state.shape + shape, state.light + own[..., :2], state.shift + own[..., 2]
        )


@dataclass(frozen=True, slots=True, eq=False)
class NormalEquations:
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

    def change(self, damping: float, share: float) -> FloatArray:
        """A share of a damped Gauss-Newton step of the coefficients."""
        damped = self.hessian + damping * np.diag(np.diag(self.hessian))
        return np.asarray(-share * np.linalg.solve(damped, self.gradient))

    def step(self, state: ModelState, damping: float, share: float) -> ModelState:
        """The state after a share of a damped Gauss-Newton step (Levenberg and Marquardt).

        Damped are the coefficients; the share shortens the step of all that was eliminated, too.
        """
        change = self.change(damping, share)
        parts = zip(self.groups, state.groups, strict=True)
        moved = tuple(part.moved(own, change, share) for part, own in parts)
        return ModelState(state.coefficients + change, moved)

    @property
    def scores(self) -> FloatArray:
        """Share of every edge of all groups in the gradient, shape (sum of E, n)."""
        return np.concatenate([part.scores for part in self.groups])


def _misfit(family: Family, group: EdgeGroup, weight: FloatArray, own: GroupState) -> FloatArray:
    """Weighted sum of squared residuals of each edge, shape (..., E)."""
    residual = family.record(predict(group, own).light)
    residual -= group.intensity
    residual *= residual
    residual *= weight
    return np.asarray(residual.reshape(*residual.shape[:-2], -1).sum(axis=-1))


def _along(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Products of matrices (E, L, M) with vectors (M,) or (K, M), shape (E, L) or (K, E, L)."""
    products = matrices @ vectors.T
    return np.asarray(np.moveaxis(products, -1, 0) if vectors.ndim > 1 else products)


def _improbable(family: Family) -> float:
    """What the coefficients alone add to the value."""
    own = float(family.coefficients @ family.coefficients) / 2
    return own + family.penalty(MONOTONE_WEIGHT)[0]
