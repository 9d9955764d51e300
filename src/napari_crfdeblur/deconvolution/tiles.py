"""Tiles: parts of a picture that are deconvolved one by one, and fit together."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import ceil, prod

from array_api_compat import array_namespace
from scipy import fft

from .. import arguments
from .._typing import BoolArray, FloatArray
from ..progress import Job, nth
from .base import Deconvolver, check_method
from .noise import PlaneStatistics, measure

SMALLEST = 1024  # side of the transform below which overheads count
LARGEST = 1 << 22  # pixels of a transform: what several threads can hold at once

Region = tuple[slice, ...]


@dataclass(frozen=True, slots=True)
class Tile:
    """A part of a picture, and the larger part that it is computed from.

    Parameters
    ----------
    inner : tuple of slice
        What the tile gives to the result; all of these together are the picture.
    outer : tuple of slice
        The same with the overlap, as far as the picture goes.
    """

    inner: Region
    outer: Region

    @property
    def kept(self) -> Region:
        """Where in the larger part the smaller one lies."""
        return tuple(
            slice(own.start - wide.start, own.stop - wide.start)
            for own, wide in zip(self.inner, self.outer, strict=True)
        )


@dataclass(frozen=True)
class Grid:
    """How a picture is cut into tiles: equal ones, but for the last of each axis.

    Parameters
    ----------
    shape : tuple of int
        Of the picture, without colors.
    steps : tuple of int
        Sides of a tile.
    overlap : tuple of int
        What is added on each side, for each axis.
    """

    shape: tuple[int, ...]
    steps: tuple[int, ...]
    overlap: tuple[int, ...]

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Number of tiles along each axis."""
        return tuple(ceil(n / step) for n, step in zip(self.shape, self.steps, strict=True))

    def __len__(self) -> int:
        return prod(self.counts)

    def __iter__(self) -> Iterator[Tile]:
        return map(self.tile, product(*map(range, self.counts)))

    def tile(self, index: tuple[int, ...]) -> Tile:
        """The tile at a place of the grid."""
        inner, outer = [], []
        for i, n, step, wide in zip(index, self.shape, self.steps, self.overlap, strict=True):
            start, stop = i * step, min((i + 1) * step, n)
            inner.append(slice(start, stop))
            outer.append(slice(max(start - wide, 0), min(stop + wide, n)))
        return Tile(tuple(inner), tuple(outer))


@dataclass(frozen=True, slots=True)
class Tiled(Deconvolver):
    """Another method, tile by tile: less memory, and less time on large pictures.

    Every tile is computed with a margin of real picture around it, of which nothing is kept: what
    a method makes of a pixel depends on its neighborhood only. What sets the strength of a
    regularization is measured once on the whole, so that the result hardly depends on the tiles.

    Parameters
    ----------
    method : Deconvolver
        What is done with each tile.
    side : int, optional
        Longest side of a transform in pixels; the tile is what remains of it after the margins.
        By default what is fastest for the overlap.
    overlap : int, optional
        Width of the margin in pixels; by default the method's reach, two sides of the PSF along
        each axis, or for Richardson-Lucy as many as its steps take.
    """

    method: Deconvolver
    side: int | None = None
    overlap: int | None = None

    def __post_init__(self) -> None:
        check_method(self.method)
        if isinstance(self.method, Tiled):
            raise ValueError("expected a method for the tiles, got one that makes tiles itself")
        if self.side is not None:
            arguments.whole(self.side, "a side in pixels", least=1, most=LARGEST)
        if self.overlap is not None:
            arguments.whole(self.overlap, "an overlap in pixels", least=0, most=LARGEST)

    def grid(self, shape: tuple[int, ...], psf_shape: tuple[int, ...]) -> Grid:
        """How a picture of `shape` is cut into tiles.

        Raises
        ------
        ValueError
            The side leaves no room for a tile between its margins.
        """
        overlap = tuple(
            ceil(self.method.reach * side) if self.overlap is None else self.overlap
            for side in psf_shape
        )
        margins = [2 * wide + side - 1 for wide, side in zip(overlap, psf_shape, strict=True)]
        sides = self._sides(shape, margins)
        steps = [_step(*each) for each in zip(shape, sides, margins, strict=True)]
        return Grid(tuple(shape), tuple(steps), overlap)

    def run(
        self,
        plane: FloatArray,
        psf: FloatArray,
        *,
        clipped: BoolArray | None = None,
        weights: FloatArray | None = None,
        statistics: PlaneStatistics | None = None,
    ) -> Job[FloatArray]:
        """Long job: deconvolve a plane or volume with a checked PSF, tile by tile."""
        grid = self.grid(tuple(plane.shape), psf.shape)
        found = statistics or measure(plane, psf, clipped)
        sharp: FloatArray = array_namespace(plane).empty_like(plane)
        for number, tile in enumerate(grid):
            own = None if clipped is None or not clipped[tile.outer].any() else clipped[tile.outer]
            worth = None if weights is None else weights[tile.outer]
            job = self.method.run(
                plane[tile.outer], psf, clipped=own, weights=worth, statistics=found
            )
            sharp[tile.inner] = (yield from nth(job, number, len(grid), "tile"))[tile.kept]
        return sharp

    def _sides(self, shape: tuple[int, ...], margins: list[int]) -> list[int]:
        """Longest side of a transform along each axis; short axes leave the others more room."""
        if self.side is not None:
            return [self.side for _ in shape]
        sides = [0 for _ in shape]
        room = LARGEST
        order = sorted(range(len(shape)), key=lambda axis: shape[axis])
        for left, axis in zip(range(len(shape), 0, -1), order, strict=True):
            margin, share = margins[axis], int(room ** (1 / left))
            best = fft.next_fast_len(max(SMALLEST, int(self.method.tile_side * margin)), real=True)
            sides[axis] = max(min(best, share), 2 * margin)
            room = max(room // min(sides[axis], shape[axis] + margin), 1)
        return sides


def _step(length: int, side: int, margin: int) -> int:
    """Side of the tiles that cut an axis evenly, none of them of more than `side` to transform."""
    if length + margin <= side:
        return length
    most = side - margin
    if most < 1:
        raise ValueError(
            f"expected a side of more than {margin} pixels, the margins of a tile, got {side}"
        )
    return ceil(length / ceil(length / most))
