"""Small isolated bright things on darker ground, where the streaks of lamps can be."""

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from scipy import ndimage

from ..._typing import BoolArray, FloatArray
from .cutout import CONNECTED, SMOOTHING, Cutout, cut_out

Bounds: TypeAlias = tuple[slice, slice]
Peak: TypeAlias = tuple[int, int]

STEP = 1.6  # between levels of light; a thing is taken at the faintest at which it is alone
LEAST_LEVEL = 0.003  # relative irradiance: 10 of 255 levels in sRGB, where noise and JPEG end
CONTRAST = 2.5  # of a peak to the level at which it is alone: else half of a streak is below
LARGEST = 5  # of them fit into the shorter side of a picture
WIDEST = 151  # pixels of a streak, however large the picture is
SMALLEST = 3  # pixels of the longer side: less is a dead pixel, which no lens has spread
MARGIN = 0.35  # of the longer side of a thing, in which the ground is seen around it, and
LEAST_MARGIN = 5  # pixels
INSIDE = 2  # pixels between a thing and the border of the picture
MOST_THINGS = 80  # that are cut out, the brightest; a few hundred would take a second

STANDING_OUT = 20.0  # standard deviations of the ground: noise is then a twentieth of the PSF
ALONE = 1.0  # of its light, at most, in another thing in its box
WHOLE = 0.06  # of its peak, at most, on the border of its box


def isolated_things(
    linear: FloatArray, clipped: BoolArray | None, largest: int | None = None
) -> list[tuple[FloatArray, Cutout]]:
    """Things that may be streaks, brightest first: their (row, column), and what they show.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C)
    clipped : ndarray of bool, the shape of `linear`, optional
    largest : int, optional
        Longest side of a thing in pixels.
    """
    gray = linear if linear.ndim == 2 else linear.max(axis=2)
    smooth = ndimage.gaussian_filter(gray, SMOOTHING)
    boxes: dict[Peak, list[Bounds]] = {}
    for peak, box in _boxes(smooth, min(largest or WIDEST, min(gray.shape) // LARGEST)):
        boxes.setdefault(peak, []).append(box)
    brightest = sorted(boxes, key=lambda peak: -smooth[peak])[:MOST_THINGS]
    found = []
    for peak in brightest:
        tried = ((box, _cut(linear, clipped, box, peak)) for box in boxes[peak])
        first = next((each for each in tried if _is_alone(each[1])), None)
        if first is not None:
            box, thing = first
            corner = np.array([side.start for side in box])
            found.append((corner + ndimage.center_of_mass(thing.light), thing))
    return found


def _cut(linear: FloatArray, clipped: BoolArray | None, box: Bounds, peak: Peak) -> Cutout:
    inside = peak[0] - box[0].start, peak[1] - box[1].start
    return cut_out(linear[box], None if clipped is None else clipped[box], inside)


def _is_alone(thing: Cutout) -> bool:
    return thing.peak >= STANDING_OUT and thing.second <= ALONE and thing.cut <= WHOLE


def _boxes(smooth: FloatArray, most: int) -> Iterator[tuple[Peak, Bounds]]:
    """Boxes around things above some level, from the lowest level up, and where they peak."""
    level, top = LEAST_LEVEL, float(smooth.max())
    while level * CONTRAST < top:
        labels, _ = ndimage.label(smooth > level, CONNECTED)
        spans = ndimage.find_objects(labels)
        for number in np.unique(labels[smooth > CONTRAST * level]):
            span = spans[number - 1]
            longest = max(side.stop - side.start for side in span)
            if number and SMALLEST <= longest <= most and _is_inside(span, smooth.shape):
                inner = np.where(labels[span] == number, smooth[span], 0)
                row, column = np.unravel_index(int(inner.argmax()), inner.shape)
                peak = span[0].start + int(row), span[1].start + int(column)
                yield peak, _around(span, longest, smooth.shape)
        level *= STEP


def _is_inside(span: Bounds, shape: tuple[int, ...]) -> bool:
    ends = zip(span, shape, strict=True)
    return all(own.start >= INSIDE and own.stop <= side - INSIDE for own, side in ends)


def _around(span: Bounds, longest: int, shape: tuple[int, ...]) -> Bounds:
    """A box with a margin, within the picture."""
    margin = max(LEAST_MARGIN, round(MARGIN * longest))
    rows, columns = (
        slice(max(own.start - margin, 0), min(own.stop + margin, side))
        for own, side in zip(span, shape, strict=True)
    )
    return rows, columns
