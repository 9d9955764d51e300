"""The PSF from the picture and its straight edges together."""

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...progress import Job
from ..base import Evidence, PsfEstimate
from ..blind.estimation import BlindEstimator, estimating_blindly
from .coverage import measure_coverage
from .edge_spreads import EdgeSpreads, clear_spreads
from .edge_term import as_explained
from .map_search import searching_with_edges
from .method import STRONGEST


@dataclass(frozen=True, slots=True)
class RadonMap(BlindEstimator):
    """Picture and PSF in turns, where the PSF has to explain straight edges, too: RadonMAP.

    Cho, Paris, Horn & Freeman (2011, Blur kernel estimation using the Radon transform, CVPR),
    the most probable picture and PSF. Each fit of the PSF `k` minimizes ::

        1/2 |k * s - D y|^2 + weight v/2 sum_jx u_jx (r_j(x) - o_j - w_j (A_n k)(x - a_j))^2
            + g/2 |k|^2

    with the gradient `s` of the sharp picture as it is known by then, and the profiles `r` as
    :class:`~.method.RadonFit` compares them with the projections ``A_n k``. `u` are inverse
    variances; `v`, the mean square that the PSF leaves of the gradients of the picture, puts
    both in one unit. `s`, the pyramid and the sparse end are those of
    :class:`~..blind.xu_jia.XuJia`, in place of the paper's deconvolved and filtered picture.

    A few edges can lead the coarse levels astray, and so can the picture. So the search is made
    with and without the edges in its first phase, and of both PSFs the more probable one is kept.

    Where the photo has no usable edge, as in the parts of a field, this is ``XuJia``:
    ``diagnostics["profiles"]`` is 0 then.

    Parameters
    ----------
    size : int, optional
        Largest extent of the PSF in pixels, odd, at least 3; found in the picture if not given.
    region : int
        Longest side in pixels of the part of the picture that is used, or three PSF sizes if
        that is more. Edges count wherever they lie.
    weight : float
        Of the edges, 0 or more; 1 is what the variances say.

    Notes
    -----
    It needs the picture, and of the profiles of :class:`~..base.Evidence` what there are, with
    their response. The ``diagnostics`` are those of :func:`~..blind.confidence.diagnose`, from
    which the status follows; `profiles`, their number; and if there are any, those of
    :func:`~.coverage.measure_coverage`.
    """

    needs_edges: ClassVar[bool] = True

    weight: float = 1.0

    def __post_init__(self) -> None:
        BlindEstimator.__post_init__(self)
        arguments.number(self.weight, "a weight of edges", least=0, most=STRONGEST)

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: estimate the PSF from a linear picture, and profiles of a known response.

        Raises
        ------
        CrfDeblurError
            The picture shows too little structure.
        ValueError
            No picture; or profiles, but no response of theirs.
        """
        spreads = _spreads(evidence)
        search = partial(searching_with_edges, spreads=spreads, weight=self.weight)
        found = yield from estimating_blindly(
            evidence.picture, evidence.clipped, search, size=self.size, region=self.region
        )
        figures = found.diagnostics | {"profiles": float(sum(len(s.spread) for s in spreads))}
        if spreads:
            state, shapes = as_explained(spreads, _square(found.psf))
            figures |= measure_coverage(state.placed, shapes)
        return replace(found, diagnostics=figures)


def _spreads(evidence: Evidence) -> tuple[EdgeSpreads, ...]:
    """The profiles in linear light, as far as there are any of contrast."""
    if not evidence.groups:
        return ()
    if evidence.response is None:
        raise ValueError("expected the response of the profiles as evidence, got none")
    return clear_spreads(evidence.groups, evidence.response)


def _square(psf: FloatArray) -> FloatArray:
    """The PSF in a square array, about the same center."""
    return np.pad(psf, [((max(psf.shape) - side) // 2,) * 2 for side in psf.shape])
