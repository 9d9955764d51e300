"""The PSF from straight edges alone: each orientation shows one of its projections."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy import ndimage

from ... import arguments
from ..._typing import FloatArray
from ...progress import Job, Progress
from ..base import Evidence, PsfEstimate, PsfEstimator, centered, cleared
from .coverage import coverage_status, measure_coverage
from .edge_spreads import EdgeSpreads, linearized
from .nonnegative import nonnegative_minimum
from .spread_fit import Placed, Projection, PsfEquations, SpreadFunction, normal_equations

STEPS = 12  # at most; most fits need 6 to 10
SETTLED = 0.01  # share of the PSF that still moves when the search ends
LENGTHS = 0.5 ** np.arange(6)  # of a step, that are tried
INDEPENDENT = 0.3  # share of the samples: those of a pixel or two err together
UNIT_SUM = 10.0  # weight of the sum of the PSF, as a multiple of what the profiles say of a pixel
RIDGE = 1e-3  # weight of the PSF's square beside that of its gradient
SPARSE_FROM = 2  # steps after which it is known where the PSF is faint
LEAST = 0.02  # of the peak: keeps the weight of what is faint finite
NOISE = 0.02  # of the PSF's peak, below which it is cleared
FAINT = 0.02  # of a transition at either end, that its width leaves out
WIDEST = 0.9  # share of the profiles that the automatic size holds
ROOM = 1.15  # for what hides in the noise at both ends of an edge
SMALLEST, LARGEST = 5, 61  # automatic size, pixels
MOST = 127  # size, pixels: the equations have its fourth power of numbers
STRONGEST = 1e9  # weight of a prior, beside which no profile counts


@dataclass(frozen=True, slots=True)
class RadonFit(PsfEstimator):
    """Least squares between the projections of one PSF and edge spreads of all orientations.

    Cho, Paris, Horn & Freeman (2011, Blur kernel estimation using the Radon transform, CVPR),
    with edges alone, sec. 3: an edge with normal `n` is blurred to the projection of the PSF
    `k` on `n`, cumulated. Minimized over ``k >= 0``, ``sum k = 1`` is ::

        1/2 sum_jx u_jx (r_j(x) - o_j - w_j (A_n k)(x - a_j))^2
            + smoothness S^2/2 |grad k|^2 + sparsity S/4 sum k |k / max k|^(1/2)

    where `r` are the profiles in linear light, from 0 on one side to 1 on the other, and `S`
    is the size. Offset `o`, range `w` and place `a` of each profile are free, as far as its
    two sides and the other profiles of its orientation permit; `u` are inverse variances, of
    which edges that fit badly keep little (Student's distribution), and which are scaled to
    how well the profiles fit on the whole. ``A_n`` is exact for square pixels
    (:func:`~.projection.project`). The paper's offsets and ranges are those measured, and its
    prior is one for sparse gradients and values.

    The PSF is determined only where there are orientations: a gap of the angle `g` leaves its
    Fourier transform unknown in a wedge of that angle, filled by sign, smoothness and sparsity.

    Parameters
    ----------
    size : int, optional
        Largest extent of the PSF in pixels, odd, at least 3; by default a little more than
        the widest of the blurred edges.
    smoothness : float
        Weight of the gradient; 0 or more.
    sparsity : float
        Weight of faint pixels; 0 or more.

    Notes
    -----
    The picture itself is not needed, only the profiles of :class:`~..base.Evidence` and their
    response: several orientations, well spread. The PSF is centered on its centroid to a pixel.
    The ``diagnostics`` are those of :func:`~.coverage.measure_coverage`, and ``halves``: the
    cosine between the PSFs that every other orientation gives, and those between.
    """

    needs_picture: ClassVar[bool] = False
    needs_edges: ClassVar[bool] = True

    size: int | None = None
    smoothness: float = 2.0
    sparsity: float = 3.0

    def __post_init__(self) -> None:
        if self.size is not None:
            arguments.odd(self.size, "PSF size", most=MOST)
        arguments.number(self.smoothness, "a smoothness", least=0, most=STRONGEST)
        arguments.number(self.sparsity, "a sparsity", least=0, most=STRONGEST)

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: estimate the PSF from profiles of a known response.

        Raises
        ------
        CrfDeblurError
            No profile has contrast in linear light.
        ValueError
            No response, or several, but none for the channel of a profile.
        """
        yield Progress("PSF from edges", 0, STEPS)
        if evidence.response is None:
            raise ValueError("expected the response of the profiles as evidence, got none")
        spreads = linearized(evidence.groups, evidence.response)
        size = self.size or suited_size(spreads)
        state = RadonState.of(spreads, size)
        for done in range(STEPS):
            yield Progress("PSF from edges", done, STEPS)
            before = state.psf
            state = self._improved(state, done)
            if done > SPARSE_FROM and np.abs(state.psf - before).sum() <= SETTLED:
                break
            state = state.recentered()
        figures = measure_coverage(state.placed, state.shapes())
        figures["halves"] = self._agreement(state)
        yield Progress("PSF from edges", STEPS, STEPS)
        return PsfEstimate(centered(cleared(state.psf, NOISE)), coverage_status(figures), figures)

    def _improved(self, state: "RadonState", done: int) -> "RadonState":
        """One step of Gauss and Newton, as far as it leads down."""
        projections = state.projections()
        start = np.asarray(state.psf.ravel())
        measured = [placed.measured() for placed in state.placed]
        shapes = [own.shape(start) for own in projections] if done else measured
        state = state.reweighted(shapes)
        prior = self._prior(state.psf, sparse=done >= SPARSE_FROM)
        goal = minimum(state.equations(shapes, projections), prior, start)
        if done == 0:
            return state.moved(goal, projections)

        def value(psf: FloatArray) -> float:
            return state.moved(psf, projections).value(projections) + float(psf @ prior @ psf) / 2

        now = value(start)
        tries = (start + length * (goal - start) for length in LENGTHS)
        better = (tried for tried in tries if value(tried) < now)
        return state.moved(next(better, start), projections)

    def _agreement(self, state: "RadonState") -> float:
        """Cosine between the PSFs that every other orientation gives, and those between."""
        projections = state.projections()
        parts = state.equations(state.shapes(), projections)
        order = np.argsort([placed.group.orientation for placed in state.placed])
        if len(order) < 2:
            return 0.0
        prior = self._prior(state.psf, sparse=False)
        halves = [
            minimum([parts[i] for i in order[first::2]], prior, state.psf.ravel())
            for first in (0, 1)
        ]
        norms = float(np.linalg.norm(halves[0]) * np.linalg.norm(halves[1]))
        return float(halves[0] @ halves[1]) / norms

    def _prior(self, psf: FloatArray, *, sparse: bool) -> FloatArray:
        """Matrix of the quadratic function that stands for smoothness and sparsity."""
        size = len(psf)
        prior = self.smoothness * size**2 * roughness(size)
        weight = np.full(size**2, RIDGE * size**2)
        if sparse:
            peak = psf.max()
            share = np.maximum(psf.ravel() / peak, LEAST)
            weight += self.sparsity * size / (2 * peak * np.sqrt(share))
        prior[np.diag_indices_from(prior)] += weight
        return prior


@dataclass(frozen=True, slots=True, eq=False)
class RadonState:
    """A PSF, shape (S, S), the profiles that it explains, and how much they count."""

    psf: FloatArray
    placed: tuple[Placed, ...]
    evidence: float = 1.0

    @classmethod
    def of(cls, spreads: Sequence[EdgeSpreads], size: int) -> "RadonState":
        """Where the search starts: nothing known of the PSF."""
        return cls(np.full((size, size), size**-2.0), tuple(Placed.of(s) for s in spreads))

    def projections(self) -> list[Projection]:
        """What each pixel of the PSF does to the profiles of each orientation."""
        return [placed.projection(len(self.psf)) for placed in self.placed]

    def shapes(self) -> list[SpreadFunction]:
        """What the whole PSF does to them."""
        return [own.shape(self.psf.ravel()) for own in self.projections()]

    def equations(
        self, shapes: Sequence[SpreadFunction], projections: Sequence[Projection]
    ) -> list[PsfEquations]:
        """Normal equations of the PSF from each orientation, about the given shapes."""
        triples = zip(self.placed, shapes, projections, strict=True)
        return [PsfEquations.of(*triple, self.evidence) for triple in triples]

    def reweighted(self, shapes: Sequence[SpreadFunction]) -> "RadonState":
        """Profiles settled to the shapes, and weighted by how well they fit."""
        pairs = list(zip(self.placed, shapes, strict=True))
        settled = [(placed.settled(shape), shape) for placed, shape in pairs]
        misfits = np.concatenate([placed.misfit(shape) for placed, shape in settled])
        evidence = INDEPENDENT / max(1.0, float(np.median(misfits)))
        weighed = tuple(placed.reweighted(shape, evidence) for placed, shape in settled)
        return replace(self, placed=weighed, evidence=evidence)

    def moved(self, psf: FloatArray, projections: Sequence[Projection]) -> "RadonState":
        """Another PSF, shape (S * S,), with the profiles settled to it."""
        pairs = zip(self.placed, projections, strict=True)
        settled = tuple(placed.settled(own.shape(psf)) for placed, own in pairs)
        return replace(self, psf=psf.reshape(self.psf.shape), placed=settled)

    def value(self, projections: Sequence[Projection]) -> float:
        """What is minimized, but for what is asked of the PSF itself."""
        psf = self.psf.ravel()
        pairs = zip(self.placed, projections, strict=True)
        return sum(placed.value(own.shape(psf), self.evidence) for placed, own in pairs)

    def recentered(self) -> "RadonState":
        """The PSF's centroid on its center pixel, and the edges' origins moved along."""
        off = np.rint(ndimage.center_of_mass(self.psf)) - np.array(self.psf.shape) // 2
        psf = ndimage.shift(self.psf, -off, order=0)
        centred = [placed.recentered() for placed in self.placed]
        placed = tuple(
            replace(own, origin=own.origin + float(own.group.normal @ off)) for own in centred
        )
        return replace(self, psf=psf / psf.sum(), placed=placed)


def minimum(parts: Sequence[PsfEquations], prior: FloatArray, start: FloatArray) -> FloatArray:
    """The PSF, not negative and of sum 1, that fits some orientations and the prior best."""
    matrix, vector = normal_equations(parts)
    one = UNIT_SUM * np.trace(matrix) / len(matrix)
    psf = nonnegative_minimum(matrix + prior + one, vector + one, start)
    return np.asarray(psf / psf.sum())


def suited_size(spreads: Sequence[EdgeSpreads]) -> int:
    """Odd size of a PSF that is a little wider than all but the widest edges."""
    widths = np.concatenate([np.full(len(s.spread), s.width(FAINT)) for s in spreads])
    widest = float(np.quantile(widths, WIDEST))
    return int(np.clip(2 * round(ROOM * widest / 2 + 1) + 1, SMALLEST, LARGEST))


def roughness(size: int) -> FloatArray:
    """Matrix of ``|grad k|^2`` for a PSF of `size` x `size`, zero around it."""
    second = 2 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1)
    return np.kron(second, np.eye(size)) + np.kron(np.eye(size), second)
