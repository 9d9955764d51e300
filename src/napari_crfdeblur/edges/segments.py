"""Straight line segments of a picture at a coarse scale.

Gradient ridges are grouped into line support regions of similar orientation, with two
overlapping partitions of the circle between which every pixel votes: Burns, Hanson and
Riseman, *Extracting Straight Lines*, PAMI 1986.
"""

from dataclasses import dataclass
from math import hypot

import numpy as np
from scipy import ndimage
from skimage.measure import label

from .._typing import FloatArray, Image
from .base import Line
from .picture import Picture

SECTORS = 12  # of half a circle: 15 degrees, wider than the noise of orientation at a ridge
FAINTEST = 0.03  # contrast, in units of full scale, below which no edge is looked for
MOST_JOINED = 1000  # segments, the strongest, that are joined with each other


@dataclass(frozen=True, slots=True, eq=False)
class Ridge:
    """Pixels where the gradient is largest across an edge.

    Parameters
    ----------
    row, column : ndarray of int, shape (K,)
        Where, in the reduced picture.
    orientation : ndarray, shape (K,)
        Angle of the gradient in [0, pi), radians.
    magnitude : ndarray, shape (K,)
        Its size, full scales per reduced pixel.
    shape : (int, int)
        Shape of the reduced picture.
    """

    row: Image
    column: Image
    orientation: FloatArray
    magnitude: FloatArray
    shape: tuple[int, int]


def find_segments(picture: Picture, blur_extent: float) -> list[Line]:
    """Line segments along the edges of a photo, the best first, in pixels of the photo.

    Parameters
    ----------
    picture : Picture
        The photo at the scale of its blur.
    blur_extent : float
        Largest expected width of an edge, pixels of the photo.
    """
    width = max(blur_extent / picture.step, 2.0)
    ridge = find_ridge(
        picture.intensity(), sigma=max(0.22 * width, 0.8), threshold=FAINTEST / width
    )
    if len(ridge.row) == 0:
        return []
    labels = vote(ridge)
    shortest = max(5.0, 0.6 * width)
    # Beyond the strongest, a busy photo has thousands of specks.
    segments = fit_segments(ridge, labels, shortest)[:MOST_JOINED]
    return [scaled(line, picture.step) for line in join(segments, width, shortest)]


def find_ridge(picture: FloatArray, sigma: float, threshold: float) -> Ridge:
    """Ridge of the color gradient (Di Zenzo 1986) of a smoothed picture (M, N, C)."""
    shape = picture.shape[:2]
    rr, rc, cc = (np.zeros(shape, dtype=np.float32) for _ in range(3))
    for i in range(picture.shape[2]):
        smooth = ndimage.gaussian_filter(picture[..., i], sigma, mode="nearest", truncate=3)
        by_row, by_column = np.gradient(smooth)
        rr += by_row**2
        rc += by_row * by_column
        cc += by_column**2
    square = (rr + cc + np.sqrt((rr - cc) ** 2 + 4 * rc**2)) / 2
    # A pixel border is left out, so that every ridge pixel has neighbors.
    r, c = np.nonzero(square[1:-1, 1:-1] > threshold**2)
    r, c = r + 1, c + 1
    angle = 0.5 * np.arctan2(2 * rc[r, c], cc[r, c] - rr[r, c]) % np.pi
    dr, dc = np.rint(np.sin(angle)).astype(int), np.rint(np.cos(angle)).astype(int)
    here = square[r, c]
    top = (here > square[r + dr, c + dc]) & (here >= square[r - dr, c - dc])
    return Ridge(r[top], c[top], angle[top], np.sqrt(here[top]), shape)


def vote(ridge: Ridge) -> Image:
    """Region to which each ridge pixel belongs, shape (K,): the larger of its two."""
    chosen = np.zeros(len(ridge.row), dtype=np.int64)
    best = np.zeros(len(ridge.row), dtype=np.int64)
    first = 0
    for shift in (0.0, 0.5):
        sector = (ridge.orientation / np.pi * SECTORS + shift).astype(np.int32) % SECTORS
        grid = np.zeros(ridge.shape, dtype=np.int32)
        grid[ridge.row, ridge.column] = sector + 1
        region = connected(grid)[ridge.row, ridge.column]
        size = np.bincount(region)[region]
        chosen = np.where(size > best, region + first, chosen)
        best = np.maximum(size, best)
        first += int(region.max()) + 1
    return np.unique(chosen, return_inverse=True)[1]


def connected(grid: Image) -> Image:
    """Number of the 8-connected region of equal, positive values to which each pixel belongs."""
    regions: Image = label(grid, connectivity=2)
    return regions


def fit_segments(ridge: Ridge, labels: Image, shortest: float) -> FloatArray:
    """Principal axes of the regions that are thin, the strongest first, shape (K, 2, 2)."""
    keep = np.bincount(labels)[labels] >= max(0.35 * shortest, 3)
    if not keep.any():
        return np.empty((0, 2, 2))
    labels = np.unique(labels[keep], return_inverse=True)[1]
    points = np.stack([ridge.row[keep], ridge.column[keep]]).astype(np.float64)
    size = np.bincount(labels)
    mean = np.stack([np.bincount(labels, p) / size for p in points])
    r, c = points - mean[:, labels]
    rr, rc, cc = (np.bincount(labels, x) / size for x in (r * r, r * c, c * c))
    angle = 0.5 * np.arctan2(2 * rc, cc - rr)  # of the long axis
    axis = np.stack([np.sin(angle), np.cos(angle)])
    first, last = bounds(r * axis[0, labels] + c * axis[1, labels], labels)
    spread = np.maximum(rr + cc - np.sqrt((rr - cc) ** 2 + 4 * rc**2), 0) / 2
    # Wider than a ridge is, it is a bend or a crossing.
    thin = (np.sqrt(spread) < 1.5) & (last > first)
    strength = (last - first) * np.bincount(labels, ridge.magnitude[keep]) / size
    best = np.argsort(-strength, kind="stable")
    lines = np.stack([(mean + t * axis).T for t in (first, last)], axis=1)
    return np.asarray(lines[best[thin[best]]])


def bounds(values: FloatArray, labels: Image) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest of the values with each label, all labels being used."""
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(labels.max() + 1))
    ordered = values[order]
    return np.minimum.reduceat(ordered, starts), np.maximum.reduceat(ordered, starts)


def join(lines: FloatArray, gap: float, shortest: float) -> FloatArray:
    """Segments joined across gaps where they lie on one line, and long enough, (K, 2, 2).

    The strongest first; each takes up those that continue it, until there is none.
    """
    joined = []
    while len(lines):
        line, lines = lines[0], lines[1:]
        while len(more := continuing(line, lines, gap)):
            points = np.concatenate([line[None], lines[more]]).reshape(-1, 2)
            along = (points - line[0]) @ (line[1] - line[0])
            line = points[[along.argmin(), along.argmax()]]
            lines = np.delete(lines, more, axis=0)
        joined.append(line)
    found = np.array(joined).reshape(-1, 2, 2)
    length = np.linalg.norm(found[:, 1] - found[:, 0], axis=1)
    return found[np.argsort(-length, kind="stable")][: np.count_nonzero(length >= shortest)]


def continuing(line: FloatArray, others: FloatArray, gap: float) -> Image:
    """Indices of those of the segments (K, 2, 2) that continue a line (2, 2)."""
    (r0, c0), (r1, c1) = line.tolist()
    length = hypot(r1 - r0, c1 - c0)
    dr, dc = (r1 - r0) / length, (c1 - c0) / length
    r, c = others[:, :, 0] - r0, others[:, :, 1] - c0
    # The ends of noisy segments are off by a pixel.
    beside = np.flatnonzero((np.abs(r * dc - c * dr) < 1.5).all(axis=1))
    if len(beside) == 0:
        return beside
    along = np.sort(r[beside] * dr + c[beside] * dc, axis=1)
    beyond = np.maximum(along[:, 0] - length, -along[:, 1])
    # A short line does not point far.
    found: Image = beside[beyond < min(gap, length)]
    return found


def scaled(line: FloatArray, step: int) -> Line:
    """The line in pixels of the photo; pixel centers of both are at whole numbers."""
    (r0, c0), (r1, c1) = (line * step + (step - 1) / 2).tolist()
    return Line((r0, c0), (r1, c1))
