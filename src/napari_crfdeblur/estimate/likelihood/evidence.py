"""Profiles as evidence: by edge, the channels of one edge side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..._typing import BoolArray, FloatArray, Image
from ...profiles.base import ProfileGroup


@dataclass(frozen=True, slots=True, eq=False)
class EdgeGroup:
    """Profiles of one orientation, as E edges of up to C channels.

    Parameters
    ----------
    group : ProfileGroup
        Where they come from.
    intensity, variance : ndarray, shape (E, C, M + 2)
        The M samples of each profile, then its two sides.
    present : ndarray of bool, shape (E, C)
        Which channels of an edge there are.
    edges : ndarray of int, shape (E, 2)
        Number of the photo and of the edge in it.
    """

    group: ProfileGroup
    intensity: FloatArray
    variance: FloatArray
    present: BoolArray
    edges: Image

    @classmethod
    def of(cls, group: ProfileGroup) -> "EdgeGroup":
        """The profiles of a group, by edge."""
        sources = np.array([(source.image, source.edge) for source in group.sources])
        edges, edge = np.unique(sources, axis=0, return_inverse=True)
        edge = edge.ravel()
        order = np.argsort(edge, kind="stable")
        count = np.bincount(edge)
        slot = np.empty_like(edge)
        slot[order] = np.arange(edge.size) - np.repeat(np.cumsum(count) - count, count)
        shape = len(edges), int(count.max()), group.position.size + 2
        intensity, variance = np.full(shape, 0.5), np.ones(shape)
        intensity[edge, slot] = np.concatenate([group.intensity, group.sides], axis=1)
        variance[edge, slot] = np.concatenate([group.variance, group.sides_variance], axis=1)
        present = np.zeros(shape[:2], dtype=bool)
        present[edge, slot] = True
        return cls(group, intensity, variance, present, edges)

    @property
    def position(self) -> FloatArray:
        """Distance along the normal, pixels, shape (M,)."""
        return self.group.position

    @property
    def step(self) -> float:
        """Spacing of the samples, pixels."""
        return float(self.position[1] - self.position[0])

    @property
    def samples(self) -> FloatArray:
        """Number of samples of each edge, sides included, shape (E,)."""
        return np.asarray(self.present.sum(axis=1) * float(self.intensity.shape[2]))

    def select(self, edges: Image) -> "EdgeGroup":
        """Only some of the edges, by their numbers here."""
        return EdgeGroup(
            self.group,
            self.intensity[edges],
            self.variance[edges],
            self.present[edges],
            self.edges[edges],
        )


def edge_groups(groups: Sequence[ProfileGroup]) -> tuple[EdgeGroup, ...]:
    """Every group by edge."""
    return tuple(EdgeGroup.of(group) for group in groups)
