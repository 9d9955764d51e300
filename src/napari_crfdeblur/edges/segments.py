"""Straight line segments of a picture at a coarse scale.

Gradient ridges are grouped into line support regions of similar orientation, with two
overlapping partitions of the circle between which every pixel votes: Burns, Hanson and
Riseman, *Extracting Straight Lines*, PAMI 1986.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from skimage.measure import label

from .._typing import FloatArray, Image
from ..photo import full_scale, planes
from .base import Line

SECTORS = 12  # of half a circle: 15 degrees, wider than the noise of orientation at a ridge
FAINTEST = 0.03  # contrast, in units of full scale, below which no edge is looked for
NARROWEST = 8.0  # width in reduced pixels to which the widest transition is brought
MOST_PIXELS = 3e6  # of the reduced picture: bounds the time spent on a sharp, large photo


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

    row: FloatArray
    column: FloatArray
    orientation: FloatArray
    magnitude: FloatArray
    shape: tuple[int, int]


def find_segments(image: Image, blur_extent: float) -> list[Line]:
    """Line segments along the edges of a photo, at the scale of its blur, the best first.

    Parameters
    ----------
    image : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        Photo; alpha is not looked at.
    blur_extent : float
        Largest expected width of an edge, pixels.
    """
    step = reduction(image.shape[:2], blur_extent)
    small = reduce(image, step)
    width = max(blur_extent / step, 2.0)
    ridge = find_ridge(small, sigma=max(0.22 * width, 0.8), threshold=FAINTEST / width)
    if len(ridge.row) == 0:
        return []
    labels = vote(ridge)
    segments = fit_segments(ridge, labels, shortest=max(5.0, 0.6 * width))
    return [scaled(s, step) for s in segments]


def reduction(shape: tuple[int, ...], blur_extent: float) -> int:
    """Whole factor by which a photo is reduced before edges are looked for."""
    by_blur = round(blur_extent / NARROWEST)
    by_size = int(np.ceil(np.sqrt(shape[0] * shape[1] / MOST_PIXELS)))
    return int(np.clip(max(by_blur, by_size), 1, max(1, min(shape) // 16)))


def reduce(image: Image, step: int) -> FloatArray:
    """Means over squares of `step` pixels, shape (M // step, N // step, C), in [0, 1]."""
    rows, columns = image.shape[0] // step, image.shape[1] // step
    kind = {1: np.uint16, 2: np.uint32}.get(image.dtype.itemsize, np.uint32)
    if image.dtype.kind == "f":
        kind = np.float32
    means = []
    for plane in planes(image):
        plane = plane[: rows * step, : columns * step]
        tall = plane[::step].astype(kind)
        for i in range(1, step):
            tall += plane[i::step].astype(kind, copy=False)
        total = tall[:, ::step].astype(np.float32)
        for i in range(1, step):
            total += tall[:, i::step]
        means.append(total * np.float32(1 / (full_scale(image) * step**2)))
    return np.stack(means, axis=-1)


def find_ridge(picture: FloatArray, sigma: float, threshold: float) -> Ridge:
    """Ridge of the colour gradient (Di Zenzo 1986) of a smoothed picture (M, N, C)."""
    shape = picture.shape[:2]
    rr, rc, cc = (np.zeros(shape, dtype=np.float32) for _ in range(3))
    for i in range(picture.shape[2]):
        smooth = ndimage.gaussian_filter(picture[..., i], sigma, mode="nearest")
        by_row, by_column = np.gradient(smooth)
        rr += by_row**2
        rc += by_row * by_column
        cc += by_column**2
    square = (rr + cc + np.sqrt((rr - cc) ** 2 + 4 * rc**2)) / 2
    # A pixel border is left out, so that every ridge pixel has neighbours.
    r, c = np.nonzero(square[1:-1, 1:-1] > threshold**2)
    r, c = r + 1, c + 1
    angle = 0.5 * np.arctan2(2 * rc[r, c], cc[r, c] - rr[r, c]) % np.pi
    dr, dc = np.rint(np.sin(angle)).astype(int), np.rint(np.cos(angle)).astype(int)
    here = square[r, c]
    top = (here > square[r + dr, c + dc]) & (here >= square[r - dr, c - dc])
    return Ridge(r[top], c[top], angle[top], np.sqrt(here[top]), shape)


def vote(ridge: Ridge) -> FloatArray:
    """Region to which each ridge pixel belongs, shape (K,): the larger of its two."""
    chosen = np.zeros(len(ridge.row), dtype=np.int64)
    best = np.zeros(len(ridge.row), dtype=np.int64)
    first = 0
    for shift in (0.0, 0.5):
        sector = (ridge.orientation / np.pi * SECTORS + shift).astype(np.int32) % SECTORS
        grid = np.zeros(ridge.shape, dtype=np.int32)
        grid[ridge.row, ridge.column] = sector + 1
        region = label(grid, connectivity=2)[ridge.row, ridge.column]
        size = np.bincount(region)[region]
        chosen = np.where(size > best, region + first, chosen)
        best = np.maximum(size, best)
        first += int(region.max()) + 1
    return np.unique(chosen, return_inverse=True)[1]


def fit_segments(ridge: Ridge, labels: FloatArray, shortest: float) -> list[Line]:
    """Principal axes of the regions that are long and thin, the strongest first."""
    size = np.bincount(labels)
    keep = size[labels] >= shortest * 0.7  # a diagonal of n pixels has n / 1.41 of them
    labels = np.unique(labels[keep], return_inverse=True)[1]
    r, c, weight = ridge.row[keep], ridge.column[keep], ridge.magnitude[keep]
    if len(labels) == 0:
        return []
    size = np.bincount(labels)
    mr, mc = np.bincount(labels, r) / size, np.bincount(labels, c) / size
    dr, dc = r - mr[labels], c - mc[labels]
    rr, rc, cc = (np.bincount(labels, x) / size for x in (dr * dr, dr * dc, dc * dc))
    angle = 0.5 * np.arctan2(2 * rc, cc - rr)  # of the long axis
    spread = (rr + cc - np.sqrt((rr - cc) ** 2 + 4 * rc**2)) / 2
    along = dr * np.sin(angle)[labels] + dc * np.cos(angle)[labels]
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(len(size)))
    low, high = (f.reduceat(along[order], starts) for f in (np.minimum, np.maximum))
    straight = (high - low >= shortest) & (np.sqrt(np.maximum(spread, 0)) < 1.5)
    strength = (high - low) * np.bincount(labels, weight) / size
    s, k = np.sin(angle), np.cos(angle)
    return [
        Line(
            (mr[i] + low[i] * s[i], mc[i] + low[i] * k[i]),
            (mr[i] + high[i] * s[i], mc[i] + high[i] * k[i]),
        )
        for i in np.argsort(-strength, kind="stable")
        if straight[i]
    ]


def scaled(line: Line, step: int) -> Line:
    """The line in pixels of the photo; pixel centres of both are at whole numbers."""
    shift = (step - 1) / 2
    (r0, c0), (r1, c1) = line.start, line.end
    return Line(
        (float(r0 * step + shift), float(c0 * step + shift)),
        (float(r1 * step + shift), float(c1 * step + shift)),
    )
