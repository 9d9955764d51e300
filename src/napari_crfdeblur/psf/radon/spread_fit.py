"""The PSF whose projections explain edge spreads, while each profile lies where it likes.

A profile of orientation `n` is ``o + w s(x - a)``: ``s = A k`` is the PSF's projection,
cumulated; offset `o`, range `w` and place `a` are its own. They are eliminated from the normal
equations of the PSF (variable projection): only what they cannot imitate counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..._typing import FloatArray
from ..projection import NARROWEST, project_pixel
from .edge_spreads import EdgeSpreads

SHIFT = 0.5  # standard deviation of a profile's place about that of its group, pixels
FREEDOM = 1.0  # of Student's distribution: how little a profile counts that fits badly
SETTLINGS = 3  # steps of Gauss and Newton for what is each profile's own: next to linear


@dataclass(frozen=True, slots=True, eq=False)
class SpreadFunction:
    """Edge spread of a group at its positions, and its slope along the normal, shapes (M,)."""

    spread: FloatArray
    slope: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """Edge spread of each of N pixels of a PSF, and its slope, shapes (M, N)."""

    spread: FloatArray
    slope: FloatArray

    def shape(self, psf: FloatArray) -> SpreadFunction:
        """Edge spread of a whole PSF, shape (N,)."""
        return SpreadFunction(self.spread @ psf, self.slope @ psf)


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Profiles of one orientation, with what is their own.

    Parameters
    ----------
    group : EdgeSpreads
        The profiles.
    origin : float
        Where the edge lies, pixels.
    own : ndarray, shape (J, 3)
        Offset, range, and shift from the origin in pixels, of each profile.
    trust : ndarray, shape (J,)
        Weight of each profile.
    """

    group: EdgeSpreads
    origin: float
    own: FloatArray
    trust: FloatArray

    @classmethod
    def of(cls, group: EdgeSpreads) -> "Placed":
        """Every profile as it was measured, its group about its middle."""
        count = len(group.spread)
        return cls(group, group.middle, np.tile([0.0, 1.0, 0.0], (count, 1)), np.ones(count))

    def projection(self, size: int) -> "Projection":
        """What each pixel of a PSF of `size` x `size` does to the profiles."""
        normal = self.group.normal
        pixels = np.indices((size, size)).reshape(2, -1) - size // 2
        distances = (self.group.position - self.origin)[:, np.newaxis] - normal @ pixels
        return Projection(project_pixel(distances, normal), pixel_density(distances, normal))

    def measured(self) -> SpreadFunction:
        """The mean of the profiles: a shape to begin with."""
        mean = self.group.mean
        return SpreadFunction(mean, np.gradient(mean, self.group.step))

    def residual(self, shape: SpreadFunction) -> FloatArray:
        """What a shape leaves of the profiles, shape (J, M)."""
        offset, scale, shift = self.own.T[..., np.newaxis]
        fitted = offset + scale * (shape.spread - shift * shape.slope)
        return np.asarray(self.group.spread - fitted)

    def misfit(self, shape: SpreadFunction) -> FloatArray:
        """Mean square of what a shape leaves of each profile, in variances, shape (J,)."""
        return np.asarray(np.mean(self.residual(shape) ** 2 / self.group.variance, axis=1))

    def value(self, shape: SpreadFunction, evidence: float) -> float:
        """Half the weighted sum of squares, with that of what is each profile's own."""
        off = self._off()
        own = np.einsum("ji,jik,jk->j", off, self._own_precision(), off)
        samples = self.group.position.size
        return float(evidence * self.trust @ (samples * self.misfit(shape) + own)) / 2

    def settled(self, shape: SpreadFunction) -> "Placed":
        """Every profile where the shape fits it best."""
        placed, weight = self, 1 / self.group.variance
        for _ in range(SETTLINGS):
            basis, square = placed.own_basis(shape)
            score = np.einsum("jmi,jm->ji", basis, weight * placed.residual(shape))
            score -= np.einsum("jik,jk->ji", placed._own_precision(), placed._off())
            step = np.linalg.solve(square, score[..., np.newaxis])[..., 0]
            placed = replace(placed, own=placed.own + step)
        return placed

    def own_basis(self, shape: SpreadFunction) -> tuple[FloatArray, FloatArray]:
        """Derivatives by a profile's own unknowns, (J, M, 3), and their normal matrix."""
        scale, shift = self.own[:, 1:2], self.own[:, 2:]
        moved = shape.spread - shift * shape.slope
        basis = np.stack([np.ones_like(moved), moved, -scale * shape.slope], axis=-1)
        weight = 1 / self.group.variance
        square = basis.transpose(0, 2, 1) @ (weight[..., np.newaxis] * basis)
        return basis, square + self._own_precision()

    def recentered(self) -> "Placed":
        """The origin moved to the mean of the shifts."""
        mean = np.average(self.own[:, 2], weights=self.group.precision * self.trust)
        own = self.own - [0.0, 0.0, mean]
        return replace(self, origin=self.origin + float(mean), own=own)

    def reweighted(self, shape: SpreadFunction, evidence: float) -> "Placed":
        """Profiles that fit badly count less."""
        trust = (FREEDOM + 1) / (FREEDOM + evidence * self.misfit(shape))
        return replace(self, trust=trust)

    def _off(self) -> FloatArray:
        """Distance of each profile's own from what was measured, shape (J, 3)."""
        return self.own - [0.0, 1.0, 0.0]

    def _own_precision(self) -> FloatArray:
        """Inverse covariance of a profile's own: both its sides were measured."""
        before, after = 1 / self.group.ends_variance.T
        precision = np.zeros((len(before), 3, 3))
        precision[:, 0, 0] = before + after
        precision[:, 0, 1] = precision[:, 1, 0] = precision[:, 1, 1] = after
        precision[:, 2, 2] = 1 / SHIFT**2
        return precision


def pixel_density(distances: FloatArray, normal: FloatArray) -> FloatArray:
    """Slope of :func:`~.projection.project_pixel`: a unit square projected on a line."""
    half, other = np.sort(np.maximum(np.abs(normal), NARROWEST) / 2)
    return np.asarray(
        np.clip((half + other - np.abs(distances)) / (2 * half), 0.0, 1.0) / (2 * other)
    )


@dataclass(frozen=True, slots=True, eq=False)
class PsfEquations:
    """Normal equations ``F' F k = b`` of a PSF of N pixels, from one orientation.

    Parameters
    ----------
    root : ndarray, shape (M, N)
        `F`.
    vector : ndarray, shape (N,)
        `b`.
    """

    root: FloatArray
    vector: FloatArray

    @classmethod
    def of(
        cls, placed: Placed, shape: SpreadFunction, projection: Projection, evidence: float
    ) -> "PsfEquations":
        """About a shape to which the profiles are settled, what is their own eliminated."""
        weight = evidence * placed.trust[:, np.newaxis] / placed.group.variance
        scale, shift = placed.own[:, 1], placed.own[:, 2]
        basis, square = placed.own_basis(shape)
        weighted = basis / placed.group.variance[..., np.newaxis]
        imitated = weighted @ np.linalg.solve(square, weighted.transpose(0, 2, 1))
        share = evidence * placed.trust * scale**2
        matrix = np.diag(scale**2 @ weight) - np.tensordot(share, imitated, axes=1)
        residual = weight * placed.residual(shape)
        vector = projection.spread.T @ (scale @ residual + matrix @ shape.spread)
        vector -= projection.slope.T @ ((scale * shift) @ residual)
        values, vectors = np.linalg.eigh(matrix)
        root = (vectors * np.sqrt(np.maximum(values, 0.0))).T
        return cls(root @ projection.spread, vector)


def normal_equations(parts: Sequence[PsfEquations]) -> tuple[FloatArray, FloatArray]:
    """Matrix and vector of all orientations together."""
    root = np.concatenate([part.root for part in parts])
    return root.T @ root, np.asarray(sum(part.vector for part in parts))
