"""From the most probable response to an estimate: its band, how far to trust it, and why not."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..._typing import FloatArray
from ...profiles.base import ProfileGroup
from ...response import ResponseCurve, ResponsePrior, Tabulated
from ..band import BAND_SAMPLES, TWO_SIDED_95, covered_range
from ..base import Finding, ResponseEstimate, ResponseStatus
from ..identifiability import LEAST_COLLINEARITY, LEAST_COVERED, collinearity
from .posterior import ResponsePosterior
from .search import Solution

FEW = 6  # edges
BORDER = 0.05  # of intensity, over which the slope at the end of what is covered is taken
# Root mean square of the residuals in units of the noise beyond which profiles are no steps.
LARGEST_MISFIT = 10.0
# Error to expect of a good estimate, in irradiance after alignment.
GOOD_ERROR = 0.008
# Share of the prior's error to expect beyond which the edges have added too little to leave it.
NOTHING_ADDED = 0.6
# Displacement of a channel, pixels: less is allowed for, more shows as color fringes.
FAR_APART = 0.75


def judged(
    found: Solution,
    groups: Sequence[ProfileGroup],
    *,
    seen: bool,
    agree: bool,
    displaced: float,
) -> ResponseEstimate:
    """The estimate of a search; the prior where the edges add nothing to it.

    Parameters
    ----------
    found : Solution
        The search.
    groups : sequence of ProfileGroup
        The profiles it was given.
    seen : bool
        Whether the prior is of a known curve or camera, to which a photo may add little.
    agree : bool
        Whether the photos agree with each other, and with what was known of the camera.
    displaced : float
        How far a color channel lies beside the mean of all, pixels.
    """
    prior = found.problem.prior
    covered = covered_range(groups)
    before = ResponsePosterior.before(prior)
    after = ResponsePosterior.of(found)
    error, known = after.expected_error(covered), before.expected_error(covered)
    apart = _apart(found)
    doubts = {
        **_doubts(found, covered, error, apart),
        Finding.CONTRADICTION: not agree,
        Finding.MISREGISTERED: displaced > FAR_APART,
    }
    findings = tuple(finding for finding, true in doubts.items() if true)
    told = error < (1.0 if seen else NOTHING_ADDED) * known
    diagnostics = {
        "error to expect": error if told else known,
        "share of the prior's": error / known if told else 1.0,
        "collinearity": apart,
        "channel shift": displaced,
        "misfit": found.misfit,
        "evidence": found.evidence,
        "groups": len(groups),
        "profiles": sum(len(group) for group in groups),
    }
    status = _status(found, told, findings)
    return _handed_out(after if told else before, covered, status, findings, diagnostics)


def assumed(prior: ResponsePrior) -> ResponseEstimate:
    """The prior, for a photo without any edge that could say more."""
    before, everything = ResponsePosterior.before(prior), (0.0, 1.0)
    diagnostics = {
        "error to expect": before.expected_error(everything),
        "share of the prior's": 1.0,
        "groups": 0,
        "profiles": 0,
    }
    findings = (Finding.NO_EDGES,)
    found = _handed_out(before, everything, ResponseStatus.CANNOT_TELL, findings, diagnostics)
    return replace(found, covered=(0.0, 0.0))


def _handed_out(
    chosen: ResponsePosterior,
    covered: tuple[float, float],
    status: ResponseStatus,
    findings: tuple[Finding, ...],
    diagnostics: dict[str, float],
) -> ResponseEstimate:
    """The estimate that a posterior stands for, with its band."""
    steep = curve = chosen.prior.curve(chosen.coefficients)
    if status is not ResponseStatus.CANNOT_TELL:
        steep = steady_shoulder(curve, covered[1], chosen.prior.curve())
        curve = steady_toe(steep, covered[0])
    intensity = np.linspace(0, 1, BAND_SAMPLES)
    # Nobody knows whether the toe is steep or steady: the band holds both.
    centers = np.stack([each.to_irradiance(intensity) for each in (steep, curve)])
    reach = TWO_SIDED_95 * chosen.deviation(intensity, covered)
    return ResponseEstimate(
        curve=curve,
        intensity=intensity,
        lower=np.clip(centers.min(axis=0) - reach, 0, 1),
        upper=np.clip(centers.max(axis=0) + reach, 0, 1),
        covered=covered,
        status=status,
        diagnostics=diagnostics,
        findings=findings,
        posterior=chosen.narrowed,
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
    middles, slopes = _slopes(curve, curve.intensity)
    border = slopes[(middles >= low) & (middles <= low + BORDER)]
    if not border.size:
        return curve
    return _with_slopes(curve, np.where(middles < low, np.minimum(slopes, border.mean()), slopes))


def steady_shoulder(curve: Tabulated, high: float, usual: ResponseCurve) -> Tabulated:
    """The curve with an inverse that above an intensity rises no faster than is usual.

    Where no edge reaches, the estimate can end almost level. Its inverse is so steep there that
    a few pixels near white would outshine the whole photo, and ring.

    Parameters
    ----------
    curve : Tabulated
        The estimate.
    high : float
        Highest intensity that edges cover.
    usual : ResponseCurve
        From `high` on, the inverse gets steeper at most as that of this response does.
    """
    middles, slopes = _slopes(curve, curve.intensity)
    _, known = _slopes(usual, curve.intensity)
    border = (middles <= high) & (middles >= high - BORDER)
    if not border.any():
        return curve
    limit = slopes[border].mean() * np.maximum(known / known[border].mean(), 1)
    return _with_slopes(curve, np.where(middles > high, np.minimum(slopes, limit), slopes))


def _slopes(curve: ResponseCurve, intensity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middles between given intensities, and slopes of the inverse response there."""
    rises = np.diff(curve.to_irradiance(intensity))
    return (intensity[1:] + intensity[:-1]) / 2, rises / np.diff(intensity)


def _with_slopes(curve: Tabulated, slopes: FloatArray) -> Tabulated:
    light = np.concatenate([[0.0], np.cumsum(slopes * np.diff(curve.intensity))])
    return Tabulated(light / light[-1], curve.intensity)


def _status(found: Solution, told: bool, findings: tuple[Finding, ...]) -> ResponseStatus:
    if not told:
        return ResponseStatus.CANNOT_TELL
    if not found.settled:
        return ResponseStatus.NOT_CONVERGED
    return ResponseStatus.DOUBTFUL if findings else ResponseStatus.GOOD


def _doubts(
    found: Solution, covered: tuple[float, float], error: float, apart: float
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


def _apart(found: Solution) -> float:
    """Collinearity of the profiles under the most probable response."""
    pairs = zip(found.problem.groups, found.state.groups, strict=True)
    light = [own.light[group.present] for group, own in pairs]
    return collinearity([each[:, 0] for each in light], [each[:, 1] for each in light])
