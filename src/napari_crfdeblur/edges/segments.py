"""Straight line segments of a picture at a coarse scale.

Gradient ridges are grouped into line support regions of similar orientation, with two
overlapping partitions of the circle between which every pixel votes: Burns, Hanson and
Riseman, *Extracting Straight Lines*, PAMI 1986.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from skimage.measure import label

from .._typing import FloatArray, Image
from .base import Line
from .picture import Picture

SECTORS = 12  # of half a circle: 15 degrees, wider than the noise of orientation at a ridge
FAINTEST = 0.03  # contrast, in units of full scale, below which no edge is looked for
BAND = 64  # rows that are looked at at once: they fit into the caches
JOINED = 4  # times as many segments as are wanted, the strongest, are joined with each other


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


def find_segments(picture: Picture, blur_extent: float, most: int) -> list[Line]:
    """Line segments along the edges of a photo, the best first, in pixels of the photo.

    Parameters
    ----------
    picture : Picture
        The photo at the scale of its blur.
    blur_extent : float
        Largest expected width of an edge, pixels of the photo.
    most : int
        How many are wanted.
    """
    width = max(blur_extent / picture.step, 2.0)
    if min(picture.shape) < 3:
        return []
    ridge = find_ridge(picture.planes(), sigma=max(0.22 * width, 0.8), threshold=FAINTEST / width)
    if len(ridge.row) == 0:
        return []
    labels = vote(ridge)
    shortest = max(5.0, 0.6 * width)
    # Beyond the strongest, a busy photo has thousands of specks.
    segments = fit_segments(ridge, labels, shortest)[: JOINED * most]
    joined = join(segments, width, shortest)[:most]
    return [in_photo(line, picture.step) for line in joined]


def find_ridge(planes: Sequence[FloatArray], sigma: float, threshold: float) -> Ridge:
    """Ridge of the color gradient (Di Zenzo 1986) of a smoothed picture, channel by channel.

    A pixel border is left out, so that every ridge pixel has neighbors.
    """
    rows, columns = planes[0].shape
    smooth = [gaussian_smoothed(plane, sigma) for plane in planes]
    found = []
    for first in range(1, rows - 1, BAND):
        # Tensors of a row more on both sides, from the slopes between one more still.
        band = slice(first - 1, min(first + BAND, rows - 1) + 3)
        r, c, angle, magnitude = ridge_of(color_tensor([p[band] for p in smooth]), threshold)
        found.append((r + first, c + 1, angle, magnitude))
    row, column, angle, magnitude = (np.concatenate(x) for x in zip(*found, strict=True))
    return Ridge(row, column, angle, magnitude, (rows, columns))


def gaussian_smoothed(plane: FloatArray, sigma: float) -> FloatArray:
    """A plane (M, N), continued beyond its borders, under a Gaussian, shape (M + 2, N + 2)."""
    radius = round(3 * sigma)
    weights = np.exp(-0.5 * (np.arange(radius + 1) / sigma) ** 2).astype(plane.dtype)
    weights /= weights[0] + 2 * weights[1:].sum()
    wide = np.pad(plane, radius + 1, mode="edge")
    found = np.empty((plane.shape[0] + 2, plane.shape[1] + 2), dtype=plane.dtype)
    for first in range(0, len(found), BAND):
        rows = wide[first : first + BAND + 2 * radius]
        tall = symmetric_sum(rows, weights)
        found[first : first + BAND] = symmetric_sum(tall.T, weights).T
    return found


def symmetric_sum(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Weighted sums over 2 R + 1 rows, with the weights of the middle, its neighbors, and so on.

    Values of shape (M + 2 R, N), sums of shape (M, N).
    """
    radius = len(weights) - 1
    size = len(values) - 2 * radius
    total: FloatArray = values[radius : radius + size] * weights[0]
    pair = np.empty_like(total)
    for i in range(1, radius + 1):
        np.add(values[radius - i :][:size], values[radius + i :][:size], out=pair)
        pair *= weights[i]
        total += pair
    return total


def color_tensor(planes: Sequence[FloatArray]) -> FloatArray:
    """Sums over planes (M + 2, N + 2) of ``rr + cc``, ``cc - rr``, ``2 rc``, shape (3, M, N).

    `r` and `c` are the differences of the neighbors above and below, left and right: twice the
    slopes. With a gradient of size `g` and angle `a`, the second and third are ``root cos(2 a)``
    and ``root sin(2 a)``, and ``rr + cc + root = 8 g**2``.
    """
    rows, columns = planes[0].shape
    tensor = np.zeros((3, rows - 2, columns - 2), dtype=planes[0].dtype)
    r, c, product = np.empty_like(tensor)
    for plane in planes:
        np.subtract(plane[2:, 1:-1], plane[:-2, 1:-1], out=r)
        np.subtract(plane[1:-1, 2:], plane[1:-1, :-2], out=c)
        tensor[2] += np.multiply(r, c, out=product)
        r *= r
        c *= c
        tensor[0] += r
        tensor[0] += c
        tensor[1] += c
        tensor[1] -= r
    tensor[2] *= 2
    return tensor


def ridge_of(tensor: FloatArray, threshold: float) -> tuple[Image, Image, FloatArray, FloatArray]:
    """Row, column, orientation and magnitude of the ridge pixels, the border left out."""
    double_cos, double_sin = tensor[1, 1:-1, 1:-1], tensor[2, 1:-1, 1:-1]
    root = np.sqrt(tensor[1] ** 2 + tensor[2] ** 2)
    square = tensor[0] + root
    here, limit = square[1:-1, 1:-1], 0.5 * root[1:-1, 1:-1]
    # Of the 8 neighbors, those nearest to the direction of the gradient: within 30 degrees of an
    # axis, where cos(2 a) is beyond one half, those on the axis, else those across the corner.
    flat, steep = double_cos >= limit, double_cos <= -limit
    corner, falls = ~(flat | steep), double_sin < 0
    top = flat & (here > square[1:-1, 2:]) & (here >= square[1:-1, :-2])
    top |= steep & (here > square[2:, 1:-1]) & (here >= square[:-2, 1:-1])
    top |= corner & ~falls & (here > square[2:, 2:]) & (here >= square[:-2, :-2])
    top |= corner & falls & (here > square[2:, :-2]) & (here >= square[:-2, 2:])
    top &= here > 8 * threshold**2
    row, column = np.nonzero(top)
    angle = 0.5 * np.arctan2(double_sin[top], double_cos[top]) % np.pi
    return row, column, angle, np.sqrt(here[top] / 8)


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
    return numbered(chosen)


def numbered(labels: Image) -> Image:
    """The labels as numbers from 0 without gaps, in the same order."""
    used = np.bincount(labels) > 0
    numbers: Image = (np.cumsum(used) - 1)[labels]
    return numbers


def connected(grid: Image) -> Image:
    """Number of the 8-connected region of equal, positive values to which each pixel belongs."""
    regions: Image = label(grid, connectivity=2)
    return regions


def fit_segments(ridge: Ridge, labels: Image, shortest: float) -> FloatArray:
    """Principal axes of the regions that are thin, the strongest first, shape (K, 2, 2)."""
    keep = np.bincount(labels)[labels] >= max(0.35 * shortest, 3)
    if not keep.any():
        return np.empty((0, 2, 2))
    labels = numbered(labels[keep])
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


def in_photo(line: FloatArray, step: int) -> Line:
    """The line in pixels of the photo; pixel centers of both are at whole numbers."""
    (r0, c0), (r1, c1) = (line * step + (step - 1) / 2).tolist()
    return Line((r0, c0), (r1, c1))
