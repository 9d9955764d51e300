"""Tiles of a picture whose blur varies: the windows of the whole, cut along the tile."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import ceil

import numpy as np

from .._typing import FloatArray
from ..deconvolution.tiles import Region, Tile
from ..deconvolution.varying import MARGIN, spans, window_count
from ..psf import PsfField


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """The part of a window that lies in a tile.

    Parameters
    ----------
    outer : tuple of slice
        What it is computed from, within the outer part of the tile.
    kept : tuple of slice
        Where in that it has weight.
    inner : tuple of slice
        The same, within the tile itself.
    weight : ndarray
        Of the pixels that are kept.
    center : (float, float)
        Where its PSF is taken, (row, column) pixels of the picture.
    """

    outer: Region
    kept: Region
    inner: Region
    weight: FloatArray
    center: tuple[float, float]


def pieces(psfs: PsfField, tile: Tile) -> Iterator[Piece]:
    """What the windows of :func:`~napari_crfdeblur.deconvolution.deconvolve_varying` are here.

    Their weights add up to 1 at every pixel of the tile; a window that is cut has the margin of
    the tile, so that both sides of the cut agree as far as those of tiles do.
    """
    axes = [
        [
            _Cut(own, wide, *span)
            for span in spans(side, window_count(side, pace), ceil(MARGIN * large))
        ]
        for side, pace, large, own, wide in zip(
            psfs.shape, psfs.pace, psfs.psfs.shape[2:], tile.inner, tile.outer, strict=True
        )
    ]
    rows, columns = ([cut for cut in each if cut.start < cut.stop] for each in axes)
    for down, across in product(rows, columns):
        weight = np.outer(down.weight, across.weight).astype(np.float32)
        both = down, across
        yield Piece(
            tuple(cut.outer for cut in both),
            tuple(cut.kept for cut in both),
            tuple(cut.inner for cut in both),
            weight,
            (down.middle, across.middle),
        )


class _Cut:
    """One axis of a piece: a window and a tile, where they overlap."""

    def __init__(
        self,
        tile: slice,
        around: slice,
        middle: float,
        window: slice,
        wide: slice,
        weight: FloatArray,
    ) -> None:
        self.middle = middle
        self.start, self.stop = max(tile.start, window.start), min(tile.stop, window.stop)
        first, last = max(around.start, wide.start), min(around.stop, wide.stop)
        self.outer = slice(first - around.start, last - around.start)
        self.kept = slice(self.start - first, self.stop - first)
        self.inner = slice(self.start - tile.start, self.stop - tile.start)
        self.weight = weight[self.start - window.start : self.stop - window.start]
