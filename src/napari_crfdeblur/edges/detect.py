"""Finding straight edges in a blurred photo."""

from collections.abc import Sequence

import numpy as np

from .._typing import FloatArray, Image
from ..progress import Job, Progress, drain
from .base import Edge
from .locate import CaptureRange
from .picture import Picture, check_view
from .refine import check_extent, refine
from .scales import Scales
from .segments import find_segments
from .strip import Frame

MOST_SEGMENTS = 250  # the strongest ones are refined: bounds the time on a busy photo
TOGETHER = 16  # segments that are refined at once: their strips fit into the caches
SAME_ANGLE = np.deg2rad(3)
SAME_OVERLAP = 0.3  # of the shorter edge


def find_edges(image: Image, *, blur_extent: float) -> tuple[Edge, ...]:
    """Straight edges of a photo, blurred over up to `blur_extent` pixels.

    Line segments found at a coarse scale are located to a fraction of a pixel at full
    resolution, trimmed to the part that looks like a blurred step, and checked.

    Parameters
    ----------
    image : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        Photo, uint8, uint16 or float in [0, 1].
    blur_extent : float
        Largest expected width of an edge, pixels; see :func:`estimate_blur_extent`.

    Returns
    -------
    tuple of Edge
        Good edges first, the longest first; then those that cannot be used, with the reason.
        Empty if the photo shows no straight edge.
    """
    return drain(finding_edges(image, blur_extent=blur_extent))


def finding_edges(image: Image, *, blur_extent: float) -> Job[tuple[Edge, ...]]:
    """Job of :func:`find_edges`: reports progress, can be stopped."""
    check_view(image)
    check_extent(blur_extent, image.shape)
    return (yield from finding(Picture.of(image), blur_extent, "edges", MOST_SEGMENTS))


def finding(photo: Picture, blur_extent: float, stage: str, most: int) -> Job[tuple[Edge, ...]]:
    """Long job: the distinct edges along the `most` best segments, the good ones first."""
    yield Progress(stage, 0, 1)
    scales = Scales.to_find(photo, blur_extent)
    lines = find_segments(scales.coarse, blur_extent, most)
    search = CaptureRange(0.25 * blur_extent + scales.coarse.step, blur_extent)
    found: list[Edge] = []
    for first in range(0, len(lines), TOGETHER):
        frames = [Frame.of(line) for line in lines[first : first + TOGETHER]]
        for number, edges in enumerate(refine(scales, frames, search), first):
            yield Progress(stage, number, len(lines))
            found += edges
    found.sort(key=lambda e: (not e.good, -e.length))
    return distinct(found, [0.5 * blur_extent] * len(found))


def distinct(edges: Sequence[Edge], reach: Sequence[float]) -> tuple[Edge, ...]:
    """Edges without those that repeat an earlier one, nearer to it than its reach in pixels."""
    kept: list[int] = []
    ends = np.array([(edge.start, edge.end) for edge in edges])
    for i in range(len(edges)):
        if not repeats(ends[i], ends[kept], np.array([reach[k] for k in kept])):
            kept.append(i)
    return tuple(edges[i] for i in kept)


def repeats(line: FloatArray, others: FloatArray, reach: FloatArray) -> bool:
    """Whether a line (2, 2) lies along one of the others (K, 2, 2), within its reach (K,)."""
    if len(others) == 0:
        return False
    axis = others[:, 1] - others[:, 0]
    length = np.linalg.norm(axis, axis=1)
    axis = axis / length[:, None]
    own = line[1] - line[0]
    own_length = np.linalg.norm(own)
    parallel = np.abs(axis @ own) / own_length >= np.cos(SAME_ANGLE)
    offset = line[None] - others[:, :1]
    t = np.sort(np.einsum("kij,kj->ki", offset, axis), axis=1)
    d = offset[..., 0] * axis[:, None, 1] - offset[..., 1] * axis[:, None, 0]
    common = np.minimum(t[:, 1], length) - np.maximum(t[:, 0], 0)
    close = np.abs(d.mean(axis=1)) < reach
    return bool(np.any(parallel & close & (common > SAME_OVERLAP * np.minimum(length, own_length))))
