"""Which lines of a finished scene are clean edges, and the light on their two sides."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy import ndimage

from .._typing import FloatArray
from ..edges.base import Edge, Line
from .scenes import TrueEdge

SLIGHTEST_STEP = 0.05  # irradiance; fainter steps are no use as edges


def clean_edges(linear: FloatArray, lines: Iterable[Line], reach: float) -> list[TrueEdge]:
    """Parts of lines with a homogeneous area on either side.

    Parameters
    ----------
    linear : ndarray, shape (M, N, 3)
        The finished scene: what is painted later can hide an edge.
    lines : iterable of Line
        Lines along which the light may step, (row, column) pixels.
    reach : float
        How far the sides are homogeneous, in pixels; parts shorter than twice this are left
        out.

    Returns
    -------
    list of TrueEdge
        Edges that step by at least 0.05 in one channel.
    """
    found: list[TrueEdge] = []
    for line in lines:
        whole = Edge(line.start, line.end)
        if whole.length < 2 * reach:
            continue  # as every part of it
        stations = np.linspace(0, 1, max(2, int(whole.length / 2)))
        before, after, clean = _sides(linear, whole, stations, reach)
        for part in _runs(clean):
            piece = _piece(line, float(stations[part.start]), float(stations[part.stop - 1]))
            if piece is not None and Edge(piece.start, piece.end).length >= 2 * reach:
                levels = (np.median(side[part], axis=0).tolist() for side in (before, after))
                found.append(TrueEdge(piece, *(tuple(level) for level in levels)))
    return found


def _sides(
    linear: FloatArray, line: Edge, stations: FloatArray, reach: float
) -> tuple[FloatArray, FloatArray, Sequence[bool]]:
    """Light before and after the line, shape (S, 3), and whether both sides are even there."""
    start, end = np.array(line.start), np.array(line.end)
    along = start + stations[:, np.newaxis] * (end - start)
    # The pixels next to the line hold a mixture of both sides.
    offsets = np.linspace(1.5, reach, max(4, int(reach)))
    normal = np.array(line.normal)
    samples = [_sampled(linear, along, sign * offsets, normal) for sign in (-1, 1)]
    before, after = (np.median(side, axis=1) for side in samples)
    even = [np.ptp(side, axis=1).max(axis=-1) < 2e-3 for side in samples]
    apart = np.abs(after - before).max(axis=-1) >= SLIGHTEST_STEP
    same = np.abs(np.diff(np.stack([before, after]), axis=1)).max(axis=(0, 2)) < 2e-3
    steady = np.append(same, True) & np.append(True, same)
    return before, after, (even[0] & even[1] & apart & steady).tolist()


def _sampled(
    linear: FloatArray, along: FloatArray, offsets: FloatArray, normal: FloatArray
) -> FloatArray:
    """Nearest pixels at offsets from stations, shape (S, O, 3); NaN outside the scene."""
    points = along[:, np.newaxis] + offsets[:, np.newaxis] * normal
    row, column = (np.rint(points[..., i]).astype(int) for i in (0, 1))
    inside = (row >= 0) & (row < linear.shape[0]) & (column >= 0) & (column < linear.shape[1])
    values = linear[np.where(inside, row, 0), np.where(inside, column, 0)].astype(np.float64)
    return np.where(inside[..., np.newaxis], values, np.nan)


def _runs(clean: Sequence[bool]) -> list[slice]:
    labels, _ = ndimage.label(clean)
    return [part for (part,) in ndimage.find_objects(labels)]


def _piece(line: Line, first: float, last: float) -> Line | None:
    (r0, c0), (r1, c1) = line.start, line.end
    ends = [(r0 + t * (r1 - r0), c0 + t * (c1 - c0)) for t in (first, last)]
    return Line(ends[0], ends[1]) if last > first else None
