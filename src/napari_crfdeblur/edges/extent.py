"""A guess of how wide the blurred edges of a photo are."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from .._typing import Image
from ..photo import check_image
from ..progress import Job, drain
from .base import Edge
from .detect import finding
from .picture import Picture

SCALES = (6.0, 12.0, 24.0, 48.0, 80.0)  # widths that are tried, pixels
FALLBACK = 20.0  # pixels: what to look for in a photo in which no edge is good at any scale
MOST_PIXELS = 1.2e6  # of a view: of a larger one, the middle is looked at
WIDTH = 20.0  # pixels of a view
RESOLVED = 8.0  # the same, from which on a width is known well enough
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
    photo = Picture.of(image)
    views = [View.of(photo, scale) for scale in SCALES if scale < min(photo.shape) / 3]
    found = []
    for view in views:
        found.append((yield from view.looking()))
    evidence = [
        view.weight * sum(e.length * e.contrast for e in edges)
        for view, edges in zip(views, found, strict=True)
    ]
    most = max(evidence, default=0.0)
    if most == 0:
        return FALLBACK
    trusted = [(v, w) for v, w, e in zip(views, found, evidence, strict=True) if e >= SHARE * most]
    widths = [(view.picture.step, typical_width(edges)) for view, edges in trusted]
    # What is narrow in one view is measured in a closer one.
    measured = [step * w for step, w in widths if step == 1 or w >= RESOLVED]
    return MARGIN * max(measured or [min(step * w for step, w in widths)])


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A photo as it shows edges of one width best.

    Parameters
    ----------
    picture : Picture
        Its middle, or all of it, in which such an edge is :data:`WIDTH` pixels wide.
    scale : float
        The width, pixels of the photo.
    weight : float
        How many times the photo is larger, in pixels squared times steps.
    """

    picture: Picture
    scale: float
    weight: float

    @classmethod
    def of(cls, photo: Picture, scale: float) -> "View":
        """The view for one width, of few enough pixels for a guess."""
        step = max(1, int(scale / WIDTH))
        share = min(1.0, sqrt(MOST_PIXELS / photo.planes[0].size) * step)
        picture = photo.middle(share).reduced(step)
        return cls(picture, scale, step / share**2)

    def looking(self) -> Job[list[Edge]]:
        """Long job: the good edges, in pixels of the view."""
        step = self.picture.step
        picture = replace(self.picture, step=1)
        stage = "width of the edges"
        edges = yield from finding(picture, self.scale / step, stage, STRONGEST)
        return [edge for edge in edges if edge.good]


def typical_width(edges: Sequence[Edge]) -> float:
    """Width that 9 tenths of the edges, by length and contrast, do not exceed."""
    width = np.array([edge.width for edge in edges])
    weight = np.array([edge.length * edge.contrast for edge in edges])
    order = np.argsort(width, kind="stable")
    share = np.cumsum(weight[order]) / weight.sum()
    return float(width[order][np.searchsorted(share, 0.9)])
