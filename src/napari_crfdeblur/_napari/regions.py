"""Parts of a photo: planes of a stack, what the canvas shows, spans of the axes."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from napari.components import ViewerModel
from napari.layers import Image as ImageLayer

from ..arguments import refusal, whole
from ..deconvolution.tiles import Region
from ..pipeline import PhotoStack
from .pixels import source_of

Pairs: TypeAlias = tuple[tuple[int, int], ...]
"""A region as numbers that can be stored: start and stop of each axis."""

AxisSpan: TypeAlias = slice | tuple[int, int]
"""One axis of a region, in either form."""


def region_from_spans(source: PhotoStack, spans: Sequence[AxisSpan]) -> Region:
    """A region given by start and stop of each axis.

    Raises
    ------
    ValueError
        Not one span for each axis, or empty, or outside the data.
    """
    if not isinstance(spans, Sequence):
        raise refusal("a start and a stop for each axis", spans)
    pairs_ = [_ends(span) for span in spans]
    if len(pairs_) != len(source.shape):
        raise ValueError(f"expected {len(source.shape)} spans, got {len(pairs_)}")
    for (start, stop), side in zip(pairs_, source.shape, strict=True):
        if not 0 <= start < stop <= side:
            raise ValueError(f"expected a span within 0 and {side}, got {start} to {stop}")
    return tuple(slice(start, stop) for start, stop in pairs_)


def plane_at(source: PhotoStack, index: Sequence[int]) -> Region:
    """The plane of a stack at an index over all axes but rows and columns."""
    if not isinstance(index, Sequence):
        raise refusal("the index of a slice, one number for each axis", index)
    numbers = [whole(i, "the index of a slice") for i in index]
    stack = [(number, number + 1) for number in numbers]
    return region_from_spans(source, [*stack, *pairs(source.whole[-2:])])


def _ends(span: AxisSpan) -> tuple[int, int]:
    ends = (span.start, span.stop) if isinstance(span, slice) else span
    if not isinstance(ends, Sequence) or len(ends) != 2:
        raise refusal("a start and a stop", span)
    return whole(ends[0], "the start of a span"), whole(ends[1], "the stop of a span")


def pairs(region: Region) -> Pairs:
    """A region as numbers that can be stored."""
    return tuple((int(axis.start), int(axis.stop)) for axis in region)


def stack_index(plane: Region) -> tuple[int, ...]:
    """Index of a plane over all axes but rows and columns; empty for a single picture."""
    return tuple(int(axis.start) for axis in plane[:-2])


def shown_plane(viewer: ViewerModel, layer: ImageLayer) -> Region:
    """The plane of a stack that the viewer shows, all rows and columns."""
    source = source_of(layer, white=1.0)
    point = np.rint(layer.world_to_data(viewer.dims.point)[-len(source.shape) :])
    index = np.clip(point, 0, np.array(source.shape) - 1).astype(int)[:-2]
    return (*(slice(int(i), int(i) + 1) for i in index), *source.whole[-2:])


def visible_part(viewer: ViewerModel, layer: ImageLayer, largest: int) -> Region:
    """What the canvas shows of the plane, at most `largest` rows and columns about its middle."""
    *stack, rows, columns = shown_plane(viewer, layer)
    # Corners are given for the level that is drawn; what counts is the finest.
    ratio = layer.downsample_factors[layer.data_level] if layer.multiscale else np.ones(layer.ndim)
    corners = np.array([[0, 0], [rows.stop, columns.stop]])
    drawn = np.asarray(layer.corner_pixels)
    # Nothing has been drawn yet, or pixels with other axes.
    if drawn.shape[1] == layer.ndim and np.all(drawn[1, -2:] > drawn[0, -2:]):
        corners = (drawn * ratio)[:, -2:].astype(int)
    sides = []
    for low, high, side in zip(*corners, (rows, columns), strict=True):
        low, high = max(int(low), 0), min(int(high) + 1, side.stop)
        middle = (low + high) // 2
        low = max(low, middle - largest // 2)
        sides.append(slice(low, min(high, low + largest)))
    return (*stack, *sides)
