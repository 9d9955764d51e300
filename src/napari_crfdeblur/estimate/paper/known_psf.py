"""Known PSF: undone, every profile is the PSF's own edge spread (Eq. 3-4)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...profiles.base import ProfileGroup
from ...progress import Job, Progress
from ...psf.base import as_planar_psf
from ...psf.projection import project
from ..base import ResponseEstimate, ResponseFit, ResponseStatus
from ..identifiability import contrasted
from . import polynomial
from .by_edge import by_edge
from .fitting import PolynomialFit, fitting
from .mean_profile import distance_to
from .rows import PolynomialRows
from .search import Terms, search

# Step between the shifts that are tried to lay a profile on the edge spread, in pixels: an
# error of half of it is below the sub-pixel error of an edge.
SHIFT_STEP = 0.1
# Share of the edge spread beyond each of its two end points.
END_SHARE = 0.01
# Scale beyond which a profile loses its influence: so many times the median of what is left of
# all. What noise leaves of a profile differs by the inverse of its range, fivefold at most among
# those that are used well; one that is left three times as far as most is no blurred step.
APART = 3.0
# Least scale, as a share of the contrast: sides are not even and edges no steps, to a hundredth.
# Profiles that all fit better count alike.
LEAST_SCALE = 0.01
# Trust below which a profile does not count as evidence: it is left three scales or more away.
LEAST_TRUST = 0.01
ROUNDS = 8  # at most, of fitting and of measuring the scale again; most need 3 to 5
SETTLED = 0.02  # change of the scale, as a share, that ends them
MOST_REJECTED = 1 / 3  # of the profiles: the median means nothing without a clear majority
# Of the contrast, by which half of the profiles are off: twice what is left of good edges. Beyond,
# edges are no steps or the PSF is wrong; so it was on every even one of twelve photos.
MOST_MISFIT = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class KnownPsf(ResponseFit):
    """Robust least squares: ``min over g of sum_j |w_j| d_j / (1 + d_j / c^2) / sum_j |w_j|``.

    Kim et al. 2012, Eq. 3-4: ``d_j``, the mean of ``(p_j(m) - s(m))^2`` over `m`, is what is left
    of ``p_j = (g(I_j) - l_j) / w_j`` against the edge spread `s`, the cumulated projection of the
    PSF on the normal of the group, aligned by its end points. One edge suffices. Where the paper
    uses a simplex, the gradient is followed.

    The paper adds ``d_j``. Here an edge that is none adds at most ``c^2`` (Geman & McClure 1987,
    Statistical methods for tomographic image reconstruction, Bull. Int. Stat. Inst. 52). The
    scale `c` follows from the median of ``d_j`` and is measured again after every fit, from the
    DoRF mean on; profiles far beyond it are left out of the last one.

    Parameters
    ----------
    psf : ndarray, shape (H, W)
        Point spread function, non-negative.
    largest_shift : float
        Each profile may move by so many pixels to lie on `s`: the response displaces the end
        points. 0 trusts the alignment, as the paper does.
    polynomial : PolynomialFit
        Degree, weights of the penalties (lambda_1, lambda_2), resamples of the band.

    Notes
    -----
    ``diagnostics`` has `rejected`, the share of the profiles that were left out: more than a third
    leave the estimate in doubt; and `misfit`, the median of ``d_j`` of all without what noise
    leaves, its root, a share of the contrast: more than .02 leave it in doubt, too.
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
        fit = _SpreadFit(spreads, self.polynomial)
        near, scale, left = yield from fit.approaching(usable)
        kept = [1 / (1 + each / scale**2) ** 2 >= LEAST_TRUST for each in left]
        pairs = [(g, own) for g, own in zip(usable, kept, strict=True) if own.any()]
        trusted = [group.select(own) for group, own in pairs]
        # One edge suffices, so that no arrangement of them leaves a doubt.
        found = yield from fitting(
            trusted, fit.terms(scale), self.polynomial, starts=[near], least_apart=0.0
        )
        return _judged(found, 1 - float(np.concatenate(kept).mean()), fit.misfit(usable, near))

    def _spreads(self, group: ProfileGroup) -> FloatArray:
        """Edge spread at the positions of a group, a row for each shift."""
        steps = round(self.largest_shift / SHIFT_STEP)
        shifts = SHIFT_STEP * np.arange(-steps, steps + 1)
        positions = group.position + shifts[:, None] + _middle(self.psf, group.orientation)
        return project(self.psf, group.orientation, positions)


@dataclass(frozen=True, slots=True)
class _SpreadFit:
    """Edge spreads of the PSF, a row for each shift, and how a response is fitted to them."""

    spreads: dict[tuple[float, bytes], FloatArray]
    polynomial: PolynomialFit

    def terms(self, scale: float) -> Terms:
        """The terms of the objective, with a scale of what is left of a profile."""

        def distance(rows: PolynomialRows, coefficients: FloatArray) -> tuple[float, FloatArray]:
            # The best shift is where the sum is smallest: its own change does not count.
            return distance_to(self._nearest(rows, coefficients), rows, coefficients, scale)

        return Terms(distance, *self.polynomial.weights)

    def approaching(
        self, groups: Sequence[ProfileGroup]
    ) -> Job[tuple[FloatArray, float, list[FloatArray]]]:
        """Long job: coefficients, the scale that belongs to them, and ``d_j`` of each group."""
        rows = [PolynomialRows(group, self.polynomial.degree) for group in groups]
        found = polynomial.dorf_mean_coefficients(self.polynomial.degree)
        left = [self._left(own, found) for own in rows]
        scale = _scale(left)
        for done in range(ROUNDS):
            yield Progress("response", done, ROUNDS)
            found = search(self.terms(scale).objective(rows), found).coefficients
            left, before = [self._left(own, found) for own in rows], scale
            scale = _scale(left)
            if abs(scale - before) <= SETTLED * before:
                break
        return found, scale, left

    def misfit(self, groups: Sequence[ProfileGroup], coefficients: FloatArray) -> float:
        """Median of what is left of a profile but for its noise, a share of the contrast."""
        excess, slope = [], np.polynomial.polynomial.polyder(coefficients)
        for group in groups:
            rows = PolynomialRows(group, self.polynomial.degree)
            gain = np.polynomial.polynomial.polyval(group.intensity, slope)
            noise = np.mean(group.variance * gain**2, axis=1) / rows.ranges(coefficients) ** 2
            excess.append(self._left(rows, coefficients) - noise)
        return float(np.sqrt(max(np.median(np.concatenate(excess)), 0.0)))

    def _nearest(self, rows: PolynomialRows, coefficients: FloatArray) -> FloatArray:
        """The edge spread of each profile, shifted to where it is nearest, shape (J, M)."""
        candidates = self.spreads[_key(rows.group)]
        profiles = rows.scaled(coefficients)
        mismatch = np.sum(candidates**2, axis=1) - 2 * profiles @ candidates.T
        return np.asarray(candidates[mismatch.argmin(axis=1)])

    def _left(self, rows: PolynomialRows, coefficients: FloatArray) -> FloatArray:
        """``d_j`` of a group, shape (J,)."""
        off = rows.scaled(coefficients) - self._nearest(rows, coefficients)
        return np.asarray(np.mean(off**2, axis=1))


def _scale(left: Sequence[FloatArray]) -> float:
    return max(APART * float(np.sqrt(np.median(np.concatenate(left)))), LEAST_SCALE)


def _judged(found: ResponseEstimate, rejected: float, misfit: float) -> ResponseEstimate:
    """An estimate, in doubt if many profiles were left out, or half of them fit badly."""
    status, bad = found.status, rejected > MOST_REJECTED or misfit > MOST_MISFIT
    if status is ResponseStatus.GOOD and bad:
        status = ResponseStatus.DOUBTFUL
    figures = {"rejected": rejected, "misfit": misfit}
    return replace(found, status=status, diagnostics=found.diagnostics | figures)


def _key(group: ProfileGroup) -> tuple[float, bytes]:
    return group.orientation, group.position.tobytes()


def _middle(psf: FloatArray, orientation: float) -> float:
    """Middle between the two end points of the edge spread, in pixels from the origin."""
    reach = np.hypot(*psf.shape) / 2 + 1
    positions = np.linspace(-reach, reach, int(40 * reach))
    spread = project(psf, orientation, positions)
    return float(np.interp([END_SHARE, 1 - END_SHARE], spread, positions).mean())
