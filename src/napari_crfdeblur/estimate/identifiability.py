"""Whether profiles can tell the response at all: a question of geometry, not of noise.

A profile has an offset `l` and a range `w` in linear light. In each of these families, wrong
responses fit as well as the right one: the points ``(l, w)`` of all groups lie on lines
through one point ``(c, 0)``, where any power of ``|E - c|`` fits, or all ranges of a group are
equal, where any exponential does (the limit of `c` at infinity).
"""

from collections.abc import Sequence

import numpy as np

from .._typing import FloatArray
from ..errors import CrfDeblurError
from ..profiles.base import ProfileGroup
from ..response import ResponseCurve

# Least collinearity of profiles that can be relied on: of random fits below it, one in seven
# was worse than the DoRF mean.
LEAST_COLLINEARITY = 0.03
# Least range of intensity covered by an estimate that is called good.
LEAST_COVERED = 0.3
# Sides that differ less than this, in intensity, are the same: three levels of 8 bit.
SAME_SIDE = 3 / 255
# Least difference of the sides, in intensity: the paper (4.4) keeps edges of high contrast.
# What disturbs a fainter profile is large beside its range.
LEAST_CONTRAST = 0.06
# Points `c` that are tried: the range of irradiance and well beyond it on both sides.
CENTERS = np.linspace(-3, 4, 281)
ZOOMS = 4  # each is ten times finer


def comparable(groups: Sequence[ProfileGroup]) -> list[ProfileGroup]:
    """Groups of two or more profiles, if together they can determine a response.

    Raises
    ------
    CrfDeblurError
        No group has three profiles, or the profiles of each group span one common range.
    """
    usable = [g for g in contrasted(groups) if len(g) >= 2]
    if max((len(g) for g in usable), default=0) < 3:
        raise CrfDeblurError(
            "at least 3 straight edges of one orientation and of good contrast are needed to "
            "determine the response; add edges, or give the response (gamma or sRGB)"
        )
    if all(np.ptp(np.sort(g.sides, axis=1), axis=0).max() < SAME_SIDE for g in usable):
        raise CrfDeblurError(
            "all edges lie between the same two levels of brightness, which cannot determine "
            "the response; add edges between other levels, or give the response (gamma or sRGB)"
        )
    return usable


def contrasted(groups: Sequence[ProfileGroup], least: float = LEAST_CONTRAST) -> list[ProfileGroup]:
    """The profiles between sides that differ enough; groups left empty are dropped."""
    masks = [np.abs(g.sides[:, 1] - g.sides[:, 0]) >= least for g in groups]
    return [g.select(mask) for g, mask in zip(groups, masks, strict=True) if mask.any()]


def levels_apart(groups: Sequence[ProfileGroup], curve: ResponseCurve) -> float:
    """The :func:`collinearity` of profiles if the response were `curve`; 0 without profiles."""
    if not groups:
        return 0.0
    light = [curve.to_irradiance(group.sides) for group in groups]
    return collinearity(
        [sides[:, 0] for sides in light], [sides[:, 1] - sides[:, 0] for sides in light]
    )


def collinearity(offsets: Sequence[FloatArray], ranges: Sequence[FloatArray]) -> float:
    """How far the profiles are from a family that cannot tell the response.

    Parameters
    ----------
    offsets, ranges : sequence of ndarray, shape (J_i,)
        Offsets `l` and signed ranges `w` of each group, in linear light.

    Returns
    -------
    float
        Root mean square distance of the points ``(l, w)`` from the nearest such family; below
        .03 an estimate is often no better than a guess.
    """
    total = sum(o.size for o in offsets)
    at_infinity = sum(float(np.sum((w - w.mean()) ** 2)) for w in ranges)
    least, centers = at_infinity, CENTERS
    for _ in range(ZOOMS):
        each = [_off_line(o - centers[:, None], w) for o, w in zip(offsets, ranges, strict=True)]
        off = np.sum(each, axis=0)
        best = int(np.argmin(off))
        least = min(least, float(off[best]))
        step = centers[1] - centers[0]
        centers = centers[best] + np.linspace(-step, step, 21)
    return float(np.sqrt(max(0.0, least) / total))


def _off_line(x: FloatArray, y: FloatArray) -> FloatArray:
    """Sum of squared distances of points from the best line through the origin.

    The smaller eigenvalue of their moments; `x` holds a row for each origin that is tried.
    """
    xx, xy, yy = np.einsum("cj,cj->c", x, x), x @ y, y @ y
    return np.asarray((xx + yy) / 2 - np.hypot((xx - yy) / 2, xy))
