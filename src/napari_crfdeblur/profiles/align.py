"""Bringing profiles of one group onto a common origin."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import arguments
from .._typing import FloatArray, Image

LARGEST = 10.0  # gamma: far beyond that of any camera, and the dark side is still above 0


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Profiles that are to be aligned with each other.

    Parameters
    ----------
    position : ndarray, shape (M,)
        Distance along the normal, pixels, increasing.
    intensity, variance : ndarray, shape (J, M)
        Recorded intensity in [0, 1].
    sides : ndarray, shape (J, 2)
        Intensity before and after the edge.
    edge : ndarray of int, shape (J,)
        Edge of each profile, 0 to E - 1: profiles of one edge move together.
    """

    position: FloatArray
    intensity: FloatArray
    variance: FloatArray
    sides: FloatArray
    edge: Image

    def crossings(self, exponent: float, levels: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where the profiles reach the given levels, shape (J, Q), and the variance of that.

        Levels are shares of the range after ``I^exponent``, in (0, 1).
        """
        start, end = (np.maximum(self.sides, 0) ** exponent).T[:, :, None]
        share = (np.maximum(self.intensity, 0) ** exponent - start) / (end - start)
        # Where noise makes it waver, halfway between the first and the last crossing.
        upward = np.maximum.accumulate(share, axis=1)
        downward = np.minimum.accumulate(share[:, ::-1], axis=1)[:, ::-1]
        share = (upward + downward) / 2
        after = (share[:, :, None] < levels).sum(axis=1).clip(1, share.shape[1] - 1)
        left, right = (np.take_along_axis(share, after - i, axis=1) for i in (1, 0))
        step = self.position[1] - self.position[0]
        inside = np.clip((levels - left) / np.maximum(right - left, 1e-12), 0, 1)
        intensity, variance = (
            np.take_along_axis(values, after, axis=1) for values in (self.intensity, self.variance)
        )
        gain = exponent * np.maximum(intensity, 1e-3) ** (exponent - 1) / (end - start)
        slope = np.maximum(right - left, 1e-3) / step
        return self.position[after - 1] + inside * step, variance * (gain / slope) ** 2


class Alignment(ABC):
    """A way to find the shift of each edge within its group."""

    @abstractmethod
    def shifts(self, groups: Sequence[Rows]) -> list[FloatArray]:
        """Place of the origin of each edge, pixels, shape (E,), for each group."""


@dataclass(frozen=True, slots=True)
class EndPoints(Alignment):
    """The middle of the two end points, where a profile leaves its flat sides.

    Kim et al. 2012, 4.4. A response moves every point of a profile except its ends.

    Parameters
    ----------
    level : float
        Share of the contrast at which a profile counts as having left its side.
    exponent : float
        Gamma of a rough inverse response under which the shares are taken.
    """

    level: float = 0.05
    exponent: float = 1.0

    def __post_init__(self) -> None:
        arguments.number(self.level, "a level", above=0, below=0.5)
        arguments.number(self.exponent, "a gamma", above=0, most=LARGEST)

    def shifts(self, groups: Sequence[Rows]) -> list[FloatArray]:
        """Middles of the end points, averaged over the profiles of each edge."""
        found: list[FloatArray] = []
        for rows in groups:
            ends, variance = rows.crossings(self.exponent, np.array([self.level, 1 - self.level]))
            weight = 1 / (variance.sum(axis=1) + 1e-4)
            middle = np.bincount(rows.edge, weight * ends.mean(axis=1))
            found.append(middle / np.bincount(rows.edge, weight))
        return found


@dataclass(frozen=True, slots=True)
class CommonShape(Alignment):
    """Shifts under which the profiles, roughly linearized, agree from end to end.

    Level `q` is reached at ``x_jq = c_q + shift_j``: least squares over shifts and the common
    shape `c`. The gamma of the rough inverse response is the one, of a few and the same for
    all groups, under which they agree best; it serves nothing but the alignment. The origin
    is the middle between the outermost levels of the common shape.

    Parameters
    ----------
    exponents : tuple of float
        Gammas that are tried.
    levels : tuple of float
        Shares of the range, increasing, in (0, 1).
    """

    exponents: tuple[float, ...] = (1.0, 1.4, 1.8, 2.2, 2.6, 3.0)
    levels: tuple[float, ...] = (0.04, 0.08, 0.15, 0.3, 0.5, 0.7, 0.85, 0.92, 0.96)

    def __post_init__(self) -> None:
        exponents = arguments.numbers(self.exponents, "gammas", least=0, most=LARGEST)
        levels = arguments.numbers(self.levels, "levels", least=0, most=1)
        if not exponents or min(exponents) == 0:
            raise arguments.refusal("gammas above 0", self.exponents)
        if not levels or np.any(np.diff((0.0, *levels, 1.0)) <= 0):
            raise arguments.refusal("increasing levels between 0 and 1", self.levels)
        object.__setattr__(self, "exponents", exponents)
        object.__setattr__(self, "levels", levels)

    def shifts(self, groups: Sequence[Rows]) -> list[FloatArray]:
        """Shifts under the best of the exponents."""
        tried = [[self.fit(rows, p) for rows in groups] for p in self.exponents]
        misfits = [sum(misfit for _, misfit in fits) for fits in tried]
        return [shift for shift, _ in tried[int(np.argmin(misfits))]]

    def fit(self, rows: Rows, exponent: float) -> tuple[FloatArray, float]:
        """Shift of each edge, shape (E,), and the misfit, under one exponent."""
        place, variance = rows.crossings(exponent, np.asarray(self.levels))
        # Edges are not straight, nor fits exact, to better than some hundredths of a pixel.
        weight = 1 / (variance + 0.03**2)
        shift = np.zeros(int(rows.edge.max()) + 1)
        for _ in range(20):
            shape = np.average(place - shift[rows.edge, None], axis=0, weights=weight)
            residual = (place - shape) * weight
            total = np.bincount(rows.edge, weight.sum(axis=1))
            shift = np.bincount(rows.edge, residual.sum(axis=1)) / total
        misfit = place - shape - shift[rows.edge, None]
        # Bounded, so that one bad edge does not choose the exponent for all.
        loss = float(np.log1p(weight * misfit**2 / 4).sum())
        return shift + (shape[0] + shape[-1]) / 2, loss
