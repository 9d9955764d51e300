"""The part of a large photo from which its response and blur are found."""

from itertools import product

import numpy as np

from .._typing import Image
from ..deconvolution.tiles import Region
from ..photo import luminance
from .sources import Source

ROWS, COLUMNS = 3000, 4000  # of the part: as much as is worth the time
SLICES = 8  # of a stack that are looked at
PATCH, GRID = 128, 4  # side of the patches by which a part is judged; their rows and columns


def informative_region(source: Source, rows: int = ROWS, columns: int = COLUMNS) -> Region:
    """The part of a photo, or of a slice of a stack, with the most detail.

    Parts of `rows` by `columns` pixels that cover the whole are compared by a few patches of
    each: what counts is the change of brightness along rows or along columns, whichever is less,
    since edges of one direction alone tell neither response nor blur.

    Returns
    -------
    tuple of slice
        One for every axis of the source; of length 1 for those of a stack.
    """
    axes = 3 if source.color else 2
    stack, plane = source.shape[:-axes], source.shape[-axes:]
    slices = list(np.ndindex(*stack))
    chosen = [slices[i * len(slices) // SLICES] for i in range(SLICES)]
    parts = [
        (*(slice(i, i + 1) for i in index), *inner, *(slice(0, side) for side in plane[2:]))
        for index in dict.fromkeys(chosen)
        for inner in product(_spans(plane[0], rows), _spans(plane[1], columns))
    ]
    return parts[0] if len(parts) == 1 else max(parts, key=lambda part: _detail(source, part))


def read_part(source: Source, region: Region) -> Image:
    """Pixels of a part of one slice, without the axes of the stack."""
    axes = 3 if source.color else 2
    pixels = source.read(region)
    return pixels.reshape(pixels.shape[-axes:])


def _spans(length: int, side: int) -> list[slice]:
    """Equal parts, as few as cover an axis; they overlap a little."""
    side = min(side, length)
    count = -(-length // side)
    starts = np.linspace(0, length - side, count).astype(int)
    return [slice(int(start), int(start) + side) for start in starts]


def _detail(source: Source, part: Region) -> float:
    axes = 3 if source.color else 2
    *stack, rows, columns = part[: len(part) - axes + 2]
    ends = part[len(part) - axes + 2 :]
    steps = np.zeros(2)
    for inner in product(_places(rows), _places(columns)):
        patch = luminance(read_part(source, (*stack, *inner, *ends)))
        steps += [np.abs(np.diff(patch, axis=axis)).mean() for axis in (0, 1)]
    return float(steps.min())


def _places(span: slice) -> list[slice]:
    side = min(PATCH, span.stop - span.start)
    starts = np.linspace(span.start, span.stop - side, GRID).astype(int)
    return [slice(int(start), int(start) + side) for start in np.unique(starts)]
