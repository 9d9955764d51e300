"""From the most probable response to an estimate: its band, how far to trust it, and why not."""

from collections.abc import Sequence

import numpy as np

from ...profiles.base import ProfileGroup
from ...response import Tabulated
from ..band import BAND_SAMPLES, TWO_SIDED_95, covered_range
from ..base import Finding, ResponseEstimate, ResponseStatus
from ..identifiability import LEAST_COLLINEARITY, LEAST_COVERED, collinearity
from .posterior import Posterior
from .search import Found

FEW = 6  # edges
BORDER = 0.05  # of intensity, over which the slope at the end of what is covered is taken
# Root mean square of the residuals in units of the noise beyond which profiles are no steps.
LARGEST_MISFIT = 10.0
# Error to expect of a good estimate, in irradiance after alignment.
GOOD_ERROR = 0.006
# Share of the prior's error to expect beyond which the edges have added too little to leave it.
NOTHING_ADDED = 0.75


def judged(
    found: Found, groups: Sequence[ProfileGroup], *, seen: bool, agree: bool
) -> ResponseEstimate:
    """The estimate of a search; the prior where the edges add nothing to it.

    Parameters
    ----------
    found : Found
        The search.
    groups : sequence of ProfileGroup
        The profiles it was given.
    seen : bool
        Whether the prior is of a known curve or camera, to which a photo may add little.
    agree : bool
        Whether the photos agree with each other, and with what was known of the camera.
    """
    prior = found.problem.prior
    covered = covered_range(groups)
    before = Posterior.before(prior)
    after = Posterior.of(found)
    error, known = after.expected_error(covered), before.expected_error(covered)
    apart = _apart(found)
    doubts = {**_doubts(found, covered, error, apart), Finding.CONTRADICTION: not agree}
    findings = tuple(finding for finding, true in doubts.items() if true)
    told = error < (1.0 if seen else NOTHING_ADDED) * known
    status = _status(found, told, findings)
    chosen = after if told else before
    intensity = np.linspace(0, 1, BAND_SAMPLES)
    curve = prior.curve(chosen.coefficients)
    if told:
        curve = steady_toe(curve, covered[0])
    center, deviation = curve.to_irradiance(intensity), chosen.deviation(intensity)
    return ResponseEstimate(
        curve=curve,
        intensity=intensity,
        lower=np.clip(center - TWO_SIDED_95 * deviation, 0, 1),
        upper=np.clip(center + TWO_SIDED_95 * deviation, 0, 1),
        covered=covered,
        status=status,
        diagnostics={
            "error to expect": error if told else known,
            "share of the prior's": error / known if told else 1.0,
            "collinearity": apart,
            "misfit": found.misfit,
            "evidence": found.evidence,
            "groups": len(groups),
            "profiles": sum(len(group) for group in groups),
        },
        findings=findings,
        posterior=prior.narrowed(chosen.coefficients, chosen.covariance),
    )


def steady_toe(curve: Tabulated, low: float) -> Tabulated:
    """The curve with an inverse that is nowhere steeper below an intensity than just above it.

    Edges tell an inverse response up to an offset, which shows where none of them reaches: in
    the darkest tones. There a steep inverse would turn noise into light. Above, the curve stays
    the same but for an affine change, which no deconvolution notices.

    Parameters
    ----------
    curve : Tabulated
        The estimate.
    low : float
        Lowest intensity that edges cover.
    """
    slopes = np.diff(curve.irradiance) / np.diff(curve.intensity)
    middles = (curve.intensity[1:] + curve.intensity[:-1]) / 2
    border = slopes[(middles >= low) & (middles <= low + BORDER)]
    if not border.size:
        return curve
    slopes = np.where(middles < low, np.minimum(slopes, border.mean()), slopes)
    light = np.concatenate([[0.0], np.cumsum(slopes * np.diff(curve.intensity))])
    return Tabulated(light / light[-1], curve.intensity)


def _status(found: Found, told: bool, findings: tuple[Finding, ...]) -> ResponseStatus:
    if not told:
        return ResponseStatus.CANNOT_TELL
    if not found.settled:
        return ResponseStatus.NOT_CONVERGED
    return ResponseStatus.DOUBTFUL if findings else ResponseStatus.GOOD


def _doubts(
    found: Found, covered: tuple[float, float], error: float, apart: float
) -> dict[Finding, bool]:
    """What speaks against a response, and whether it is so."""
    known = any(expected is not None for expected in found.problem.expected)
    return {
        Finding.FEW_EDGES: sum(len(g.edges) for g in found.problem.groups) < FEW and not known,
        Finding.NARROW: covered[1] - covered[0] < LEAST_COVERED,
        Finding.ALIKE: apart < LEAST_COLLINEARITY and not known,
        Finding.MISFIT: found.misfit > LARGEST_MISFIT,
        Finding.UNSURE: error > GOOD_ERROR,
    }


def _apart(found: Found) -> float:
    """Collinearity of the profiles under the most probable response."""
    pairs = zip(found.problem.groups, found.state.groups, strict=True)
    light = [own.light[group.present] for group, own in pairs]
    return collinearity([each[:, 0] for each in light], [each[:, 1] for each in light])
