"""Known PSF: undone, every profile is the PSF's own edge spread (Eq. 3-4)."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...profiles.base import ProfileGroup
from ...progress import Job, Progress
from ...psf.base import as_planar_psf
from ...psf.projection import project
from ..base import ResponseEstimate, ResponseFit
from ..identifiability import contrasted
from .by_edge import by_edge
from .fitting import PolynomialFit, fitting
from .mean_profile import distance_to
from .rows import PolynomialRows
from .search import Terms

# Step between the shifts that are tried to lay a profile on the edge spread, in pixels: an
# error of half of it is below the sub-pixel error of an edge.
SHIFT_STEP = 0.1
# Share of the edge spread beyond each of its two end points.
END_SHARE = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class KnownPsf(ResponseFit):
    """Least squares: ``min over g of sum_jm |w_j| (p_j(m) - s(m))^2 / sum_j |w_j|``.

    Kim et al. 2012, Eq. 3-4: ``p_j = (g(I_j) - l_j) / w_j`` against the edge spread `s`, the
    cumulated projection of the PSF on the normal of the group, aligned by its end points.
    One edge suffices. Where the paper uses a simplex, the gradient is followed.

    Parameters
    ----------
    psf : ndarray, shape (H, W)
        Point spread function, non-negative.
    largest_shift : float
        Each profile may move by so many pixels to lie on `s`: the response displaces the end
        points. 0 trusts the alignment, as the paper does.
    polynomial : PolynomialFit
        Degree, weights of the penalties (lambda_1, lambda_2), resamples of the band.
    """

    psf: FloatArray
    largest_shift: float = 3.0
    polynomial: PolynomialFit = field(default_factory=PolynomialFit)

    def __post_init__(self) -> None:
        arguments.number(self.largest_shift, "a shift in pixels", least=0, most=1000)
        arguments.instance(self.polynomial, PolynomialFit, "a PolynomialFit")
        psf = as_planar_psf(self.psf)
        psf.setflags(write=False)
        object.__setattr__(self, "psf", psf)

    def arranged(self, groups: Sequence[ProfileGroup]) -> tuple[ProfileGroup, ...]:
        """See :func:`~.by_edge.by_edge`."""
        return by_edge(groups)

    def run(self, groups: Sequence[ProfileGroup]) -> Job[ResponseEstimate]:
        """Long job: see :class:`ResponseFit`."""
        usable = contrasted(groups)
        if not usable:
            raise CrfDeblurError(
                "there are no profiles to compare with the PSF; "
                "add straight edges between two even areas"
            )
        spreads = {}
        for group in usable:
            yield Progress("response", 0, 1)
            spreads[_key(group)] = self._spreads(group)

        def distance(rows: PolynomialRows, coefficients: FloatArray) -> tuple[float, FloatArray]:
            candidates = spreads[_key(rows.group)]
            profiles = rows.scaled(coefficients)
            mismatch = np.sum(candidates**2, axis=1) - 2 * profiles @ candidates.T
            # The best shift is where the sum is smallest: its own change does not count.
            return distance_to(candidates[mismatch.argmin(axis=1)], rows, coefficients)

        terms = Terms(distance, *self.polynomial.weights)
        # One edge suffices, so that no arrangement of them leaves a doubt.
        return (yield from fitting(usable, terms, self.polynomial, least_apart=0.0))

    def _spreads(self, group: ProfileGroup) -> FloatArray:
        """Edge spread at the positions of a group, a row for each shift."""
        steps = round(self.largest_shift / SHIFT_STEP)
        shifts = SHIFT_STEP * np.arange(-steps, steps + 1)
        positions = group.position + shifts[:, None] + _middle(self.psf, group.orientation)
        return project(self.psf, group.orientation, positions)


def _key(group: ProfileGroup) -> tuple[float, bytes]:
    return group.orientation, group.position.tobytes()


def _middle(psf: FloatArray, orientation: float) -> float:
    """Middle between the two end points of the edge spread, in pixels from the origin."""
    reach = np.hypot(*psf.shape) / 2 + 1
    positions = np.linspace(-reach, reach, int(40 * reach))
    spread = project(psf, orientation, positions)
    return float(np.interp([END_SHARE, 1 - END_SHARE], spread, positions).mean())
