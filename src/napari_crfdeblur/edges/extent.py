"""A guess of how wide the blurred edges of a photo are."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi, prod, sqrt

import numpy as np

from .._typing import FloatArray, Image
from ..progress import Job, drain
from .base import Edge, Point
from .detect import distinct, finding
from .picture import Picture, check_view

SCALES = (64.0, 24.0, 8.0)  # widths that are tried, pixels
FALLBACK = 20.0  # pixels: what to look for in a photo in which no edge is good at any scale
MOST_PIXELS = 1.2e6  # of a view: of a larger one, the middle is looked at
WIDTH = 20.0  # pixels of a view
RESOLVED = 8.0  # the same, from which on a width is known well enough
STRONGEST = 60  # segments that are looked at for each scale
SECTORS = 4  # of half a circle, in each of which a width is measured
SHARE = 0.1  # of the most evidence, with which a sector is taken seriously
MARGIN = 1.15  # for what hides in the noise at both ends of an edge


def estimate_blur_extent(image: Image) -> float:
    """Width of the widest blurred edges of a photo, pixels, with a little margin.

    Edges are looked for at several scales. A blur makes all sharp edges of one orientation
    equally wide, and what is soft by itself is wider: the median tells (by length and
    contrast). The orientation with the widest counts, since a motion blur leaves some edges
    sharp.

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
    check_view(image)
    photo = Picture.of(image)
    found: dict[Edge, View] = {}
    for scale in SCALES:
        if scale < min(photo.shape) / 3:
            view = View.of(photo, scale)
            found.update(dict.fromkeys((yield from view.looking()), view))
    if not found:
        return FALLBACK
    # What is narrow in one view is measured in a closer one, if it is seen there.
    resolved = [edge for edge, view in found.items() if view.resolves(edge)] or list(found)
    # Of an edge that is good at several scales, the widest: at others a part of it was seen.
    edges = distinct(resolved, [0.5 * edge.width for edge in resolved])
    weight = np.array([found[edge].weight * edge.length * edge.contrast for edge in edges])
    return MARGIN * widest(edges, weight)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A photo as it shows edges of one width best.

    Parameters
    ----------
    picture : Picture
        Its middle, or all of it, in which such an edge is :data:`WIDTH` pixels wide.
    scale : float
        The width, pixels of the photo.
    corner : (float, float)
        Center of the first pixel of the picture, (row, column) pixels of the photo.
    weight : float
        How many times the photo is larger.
    """

    picture: Picture
    scale: float
    corner: Point
    weight: float

    @classmethod
    def of(cls, photo: Picture, scale: float) -> "View":
        """The view for one width, of few enough pixels for a guess."""
        step = max(1, int(scale / WIDTH))
        share = min(1.0, sqrt(MOST_PIXELS / prod(photo.shape)) * step)
        picture = photo.middle(share).reduced(step)
        row, column = (round((1 - share) / 2 * n) + (step - 1) / 2 for n in photo.shape)
        return cls(picture, scale, (row, column), share**-2)

    def looking(self) -> Job[list[Edge]]:
        """Long job: the good edges, in pixels of the photo."""
        step = self.picture.step
        picture = replace(self.picture, step=1)
        stage = "width of the edges"
        edges = yield from finding(picture, self.scale / step, stage, STRONGEST)
        return [self.in_photo(edge) for edge in edges if edge.good]

    def resolves(self, edge: Edge) -> bool:
        """Whether the width of an edge is known well enough in this view."""
        return self.picture.step == 1 or edge.width >= RESOLVED * self.picture.step

    def in_photo(self, edge: Edge) -> Edge:
        """An edge of the view, in pixels of the photo."""
        step, (row, column) = self.picture.step, self.corner
        start, end = ((row + step * r, column + step * c) for r, c in (edge.start, edge.end))
        return replace(edge, start=start, end=end, width=step * edge.width)


def widest(edges: Sequence[Edge], weight: FloatArray) -> float:
    """Width of edges by their orientation: the largest of those that enough edges show."""
    width = np.array([edge.width for edge in edges])
    angle = np.array([edge.orientation for edge in edges])
    order = np.argsort(width, kind="stable")
    found = []
    for middle in np.arange(SECTORS) * pi / SECTORS:
        # A sector and half of each of its neighbors, so that none is cut apart.
        apart = np.abs((angle[order] - middle + pi / 2) % pi - pi / 2)
        own = order[apart <= pi / SECTORS]
        if len(own):
            share = np.cumsum(weight[own])
            median = width[own][np.searchsorted(share, 0.5 * share[-1])]
            found.append((float(share[-1]), float(median)))
    most = max(evidence for evidence, _ in found)
    return max(median for evidence, median in found if evidence >= SHARE * most)
