"""A guess of how wide the blurred edges of a photo are."""

from collections.abc import Sequence

import numpy as np

from .._typing import Image
from ..photo import check_image
from ..progress import Job, Progress, drain
from .base import Edge
from .detect import following
from .refine import readable
from .segments import find_segments, reduce

SCALES = (6.0, 12.0, 24.0, 48.0, 80.0)  # widths that are tried, pixels
FALLBACK = 20.0  # pixels: what to look for in a photo in which no edge is good at any scale
MOST_PIXELS = 2e6  # a larger photo is judged on a reduced one, and on its middle
WELL_MEASURED = 6.0  # reduced pixels: a smaller width is measured in the middle of the photo
STRONGEST = 60  # segments that are looked at for each scale
SHARE = 0.4  # of the most evidence, with which a scale is taken seriously
MARGIN = 1.15  # for what hides in the noise at both ends of an edge


def estimate_blur_extent(image: Image) -> float:
    """Width of the widest blurred edges of a photo, pixels, with a little margin.

    Edges are looked for at several scales. Of those that show enough good edges (by length
    and contrast), the one with the widest tells: a motion blur leaves some edges sharp.

    Parameters
    ----------
    image : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        Photo, uint8, uint16 or float in [0, 1].

    Returns
    -------
    float
        A guess for `blur_extent` of :func:`find_edges`; 20 if no good edge is found.
    """
    return drain(estimating_blur_extent(image))


def estimating_blur_extent(image: Image) -> Job[float]:
    """Job of :func:`estimate_blur_extent`: reports progress, can be stopped."""
    check_image(image)
    yield Progress("width of the edges", 0, 1)
    image = readable(image)
    step = int(np.ceil(np.sqrt(image.shape[0] * image.shape[1] / MOST_PIXELS)))
    if step == 1:
        return (yield from widest(image, SCALES)) or FALLBACK
    small = reduce(image, step)
    small = small[..., 0] if image.ndim == 2 else small
    extent = step * ((yield from widest(small, SCALES)) or 0.0)
    if extent >= WELL_MEASURED * step:
        return extent
    return (yield from widest(middle(image, step), SCALES)) or extent or FALLBACK


def middle(image: Image, step: int) -> Image:
    """The middle of a photo, one `step`-th of its height and width."""
    rows, columns = image.shape[0] // step, image.shape[1] // step
    first, left = (image.shape[0] - rows) // 2, (image.shape[1] - columns) // 2
    return image[first : first + rows, left : left + columns]


def widest(image: Image, scales: Sequence[float]) -> Job[float | None]:
    """Long job: largest width at the scales with enough evidence, pixels.

    None without good edges.
    """
    found = []
    for scale in scales:
        if scale < min(image.shape[:2]) / 3:
            yield Progress("width of the edges", 0, STRONGEST)
            lines = find_segments(image, scale)[:STRONGEST]
            edges = yield from following(image, lines, scale, "width of the edges")
            found.append([edge for edge in edges if edge.good])
    evidence = [sum(e.length * e.contrast for e in edges) for edges in found]
    most = max(evidence, default=0.0)
    if most == 0:
        return None
    trusted = [edges for edges, e in zip(found, evidence, strict=True) if e >= SHARE * most]
    return MARGIN * max(typical_width(edges) for edges in trusted)


def typical_width(edges: Sequence[Edge]) -> float:
    """Width that 9 tenths of the edges, by length and contrast, do not exceed."""
    width = np.array([edge.width for edge in edges])
    weight = np.array([edge.length * edge.contrast for edge in edges])
    order = np.argsort(width, kind="stable")
    share = np.cumsum(weight[order]) / weight.sum()
    return float(width[order][np.searchsorted(share, 0.9)])
