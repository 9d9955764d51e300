"""What straight edges say of a PSF, as a quadratic term beside that of the picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from scipy import ndimage

from ..._typing import FloatArray
from ..blind.kernel_fit import KernelFit
from .edge_spreads import EdgeSpreads
from .method import INDEPENDENT, RadonState
from .spread_fit import FREEDOM, PsfEquations, SpreadFunction

FINEST = 40  # steps of the profiles across the PSF: more tell no more, and cost memory
MOST_NUMBERS = 2**25  # of the matrix of the edges: 256 MB, which only very wide PSFs reach

Explained: TypeAlias = tuple[RadonState, list[SpreadFunction]]
"""Profiles, each at its place, and the shapes about which the equations are linear."""
Placing: TypeAlias = Callable[[Sequence[EdgeSpreads], FloatArray], Explained]
"""How edges and a PSF of shape (S, S) are brought together."""


@dataclass(frozen=True, slots=True, eq=False)
class JointFit(KernelFit):
    """The quadratic term of the picture and that of the edges, ``1/2 |F k|^2 - f' k``.

    `solve` and `refine` minimize the sum of both; `residual` means nothing here.

    Parameters
    ----------
    transfer, energy
        Of the picture.
    correlation : ndarray, shape (S, S)
        That of the picture, and `f`.
    root : ndarray, shape (R, S * S)
        `F`.
    """

    root: FloatArray

    @classmethod
    def of_both(cls, picture: KernelFit, edges: Explained, weight: float) -> "JointFit":
        """The term of the picture, and `weight` times that of the edges."""
        state, shapes = edges
        parts = [_equations(state, number, shape) for number, shape in enumerate(shapes)]
        root = np.concatenate([part.root for part in parts])
        vector = np.asarray(sum(part.vector for part in parts)).reshape(state.psf.shape)
        correlation = picture.correlation + weight * vector
        return cls(picture.transfer, correlation, picture.energy, np.sqrt(weight) * root)

    def blurred_twice(self, psf: FloatArray) -> FloatArray:
        """Gradient of the quadratic part of both terms."""
        edges = self.root.T @ (self.root @ psf.ravel())
        return KernelFit.blurred_twice(self, psf) + edges.reshape(psf.shape)


def _equations(state: RadonState, number: int, shape: SpreadFunction) -> PsfEquations:
    placed = state.placed[number]
    return PsfEquations.of(placed, shape, placed.projection(len(state.psf)), state.evidence)


def as_measured(spreads: Sequence[EdgeSpreads], psf: FloatArray) -> Explained:
    """Each orientation about the mean of its profiles, whatever the PSF is: it may be wrong.

    The PSF says only where in its array its centroid lies, which the edges cannot know.
    """
    placed = RadonState.of(spreads, len(psf)).placed
    off = np.array(ndimage.center_of_mass(psf)) - np.array(psf.shape) // 2
    placed = tuple(replace(p, origin=p.origin - float(p.group.normal @ off)) for p in placed)
    shapes = [own.measured() for own in placed]
    return RadonState(psf, placed).reweighted(shapes), shapes


def as_weighed(spreads: Sequence[EdgeSpreads], psf: FloatArray) -> Explained:
    """Each orientation as it was measured, those that the PSF explains better counting more."""
    state, shapes = as_measured(spreads, psf)
    judged, _ = as_explained(spreads, psf)
    pairs = zip(state.placed, judged.placed, strict=True)
    return replace(state, placed=tuple(replace(p, trust=j.trust) for p, j in pairs)), shapes


def as_explained(spreads: Sequence[EdgeSpreads], psf: FloatArray) -> Explained:
    """Each orientation about the projection of the PSF: edges that contradict it hardly count."""
    first, _ = as_measured(spreads, psf)
    pairs = zip(first.placed, first.shapes(), strict=True)
    placed = tuple(own.settled(shape).recentered() for own, shape in pairs)
    state = RadonState(psf, placed)
    shapes = state.shapes()
    return state.reweighted(shapes), shapes


def edge_cost(spreads: Sequence[EdgeSpreads], psf: FloatArray) -> float:
    """What a PSF of shape (S, S) leaves of the edges: minus the logarithm of their likelihood.

    Of Student's distribution, whose weights :class:`~.spread_fit.Placed` takes.
    """
    state, shapes = as_explained(spreads, psf)
    pairs = zip(state.placed, shapes, strict=True)
    return sum(_student(own.misfit(shape), own.group.position.size) for own, shape in pairs)


def _student(misfit: FloatArray, samples: int) -> float:
    excess = np.log1p(INDEPENDENT * misfit / FREEDOM)
    return float((FREEDOM + 1) / 2 * samples * excess.sum())


def scaled_spreads(spreads: Sequence[EdgeSpreads], scale: float) -> list[EdgeSpreads]:
    """The same edges in a picture of `scale` times the sides."""
    return [replace(group, position=scale * group.position) for group in spreads]


def affordable(spreads: Sequence[EdgeSpreads], size: int) -> list[EdgeSpreads]:
    """The edges for a PSF of `size` pixels: no finer than that, and the clearest if too many."""
    thin = [_thinned(group, size) for group in spreads]
    clearest = sorted(range(len(thin)), key=lambda i: -float(thin[i].precision.sum()))
    rows = np.cumsum([thin[i].position.size for i in clearest])
    kept = set(clearest[: max(int(np.sum(rows * size**2 <= MOST_NUMBERS)), 1)])
    return [group for number, group in enumerate(thin) if number in kept]


def _thinned(group: EdgeSpreads, size: int) -> EdgeSpreads:
    every = slice(None, None, max(int(size / FINEST / group.step), 1))
    return replace(
        group,
        position=group.position[every],
        spread=group.spread[:, every],
        variance=group.variance[:, every],
    )
