"""An estimate that follows its profiles while they change."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..._typing import FloatArray
from ...profiles.base import ProfileGroup
from ..base import Finding, ResponseEstimate
from ..identifiability import contrasted
from .evidence import edge_groups
from .noise_model import NoiseModel
from .refit import refound
from .search import Solution
from .verdict import assumed, judged

# Least difference of the sides, in intensity. What disturbs the edges of real pictures does not
# fade with their contrast; on such, a threshold of .1 to .15 errs least.
LEAST_CONTRAST = 0.12


@dataclass(frozen=True, slots=True, eq=False)
class LiveFit:
    """An estimate, and what it takes to go on from it when some of the profiles change.

    What follows is the minimum next to the last one, and its evidence is the last one. A full
    estimate looks for others, too, and may find one that lies elsewhere.

    Parameters
    ----------
    estimate : ResponseEstimate
        Of the profiles as they are.
    found : Solution or None
        Its solution; None if no edge is of any use, and the prior is the estimate.
    noise : NoiseModel
        How much a sample counts.
    psf : ndarray, shape (H, W), or None
        If it is known.
    seen : bool
        Whether the prior is of a known curve or camera.
    """

    estimate: ResponseEstimate
    found: Solution | None
    noise: NoiseModel
    psf: FloatArray | None
    seen: bool

    def refit(self, groups: Sequence[ProfileGroup]) -> "LiveFit | None":
        """The estimate from other profiles, in a tenth of the time of a full one or less.

        Status and findings are those of the new profiles, but for what takes more than a step:
        whether photos contradict each other, whether the search has converged and how far the
        color channels lie apart are as they were.

        Parameters
        ----------
        groups : sequence of ProfileGroup
            All profiles as they are now.

        Returns
        -------
        LiveFit or None
            None if most of the profiles are new, so that a full estimate is needed.
        """
        if self.found is None:
            return None
        usable = contrasted(groups, LEAST_CONTRAST)
        if not usable:
            return replace(self, found=None, estimate=assumed(self.found.problem.prior))
        found = refound(self.found, edge_groups(usable), self.noise, self.psf)
        if found is None:
            return None
        estimate = judged(
            found,
            usable,
            seen=self.seen,
            agree=Finding.CONTRADICTION not in self.estimate.findings,
            displaced=self.estimate.diagnostics["channel shift"],
        )
        return replace(self, found=found, estimate=estimate)
