"""Photos larger than memory, restored tile by tile: dask arrays in, dask arrays out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from .. import arguments
from .._typing import Image
from ..deconvolution import Deconvolver, PlaneStatistics, Tiled
from ..deconvolution.base import check_method
from ..deconvolution.tiles import Grid, Region, Tile
from ..errors import CrfDeblurError
from ..estimate import given_responses
from ..photo import ALPHA
from ..psf import PsfField, as_psf
from ..response import Response
from .recipe import PsfOrField, Recipe, psf_shape
from .sources import KINDS, Source, open_source
from .statistics import check_source, measure_large
from .swing import measure_swing

if TYPE_CHECKING:
    from dask.array import Array

Large: TypeAlias = "Source | Path | Image | Array"
"""A photo or a stack: a file, an open one, an array of numpy or of dask."""


def restore_large(
    photo: Large,
    curve: Response,
    psf: PsfOrField,
    method: Deconvolver,
    *,
    channels: bool | None = None,
    statistics: Sequence[PlaneStatistics] | None = None,
    guard: bool = False,
) -> "Array":
    """Restore a photo or a stack of photos that need not fit into memory.

    Every tile is linearized, deconvolved and recorded again when it is asked for. A file is read
    tile by tile, too, so that memory holds only the tiles that are worked on.

    Parameters
    ----------
    photo : Path, Source, ndarray or dask array, shape (..., M, N) or (..., M, N, 3 or 4)
        uint8, uint16, or float in [0, 1]. Slices of a stack are restored one by one, or, with
        a PSF of three dimensions, as volumes (Z, M, N).
    curve : ResponseCurve or sequence of 3 of them
        Response of all channels, or of each.
    psf : ndarray, shape (H, W) or (D, H, W), or PsfField
        Point spread function, non-negative; scaled to sum 1. Or those of all parts of a picture
        of this shape, as for :func:`~napari_crfdeblur.deconvolution.deconvolve_varying`.
    method : Deconvolver
        Used in tiles; :class:`~napari_crfdeblur.deconvolution.Tiled` says which.
    channels : bool, optional
        Whether the last axis has the colors; by default if it has a length of 3 or 4.
    statistics : sequence of PlaneStatistics, optional
        Of each channel, as :func:`measure_large` finds them; by default they are measured, at
        once, on a sample.
    guard : bool
        Whether the result gives way to the photo where it is impossible
        (:func:`~napari_crfdeblur.deconvolution.guard`); some parts are restored at once for it.

    Returns
    -------
    dask array, the shape and kind of `photo`
        One chunk for each tile. The values do not depend on where and in which order they are
        computed.

    Raises
    ------
    CrfDeblurError
        A file or PSF that is none, a PSF larger than the photo or of more dimensions; later, when
        a tile is computed, pixels that are not finite or outside [0, 1], or a file that has
        changed.
    """
    photo = open_source(photo) if isinstance(photo, Path) else photo
    check_source(photo, curve)
    psf = psf if isinstance(psf, PsfField) else as_psf(arguments.addable(psf, "a PSF"))
    check_method(method)
    if statistics is not None:
        arguments.instances(statistics, PlaneStatistics, "statistics of each channel")
    arguments.instance(guard, bool, "whether the result is guarded")
    arguments.instance(channels, (bool, NoneType), "whether the last axis has the colors, or None")
    if channels is None:
        channels = photo.color if isinstance(photo, Source) else _has_colors(photo)
    plane = check_blur(photo, psf, channels)
    tiled = method if isinstance(method, Tiled) else Tiled(method)
    grid = tiled.grid(plane, psf_shape(psf))
    statistics = statistics or measure_large(photo, curve, channels=channels, psf=psf)
    recipe = Recipe(given_responses(curve), psf, tiled.method, channels, tuple(statistics))
    if guard:
        recipe = replace(recipe, swing=measure_swing(photo, recipe))
    lead = len(photo.shape) - len(plane) - channels
    plan = _Plan(tuple(photo.shape), lead, grid)
    if isinstance(photo, Source):
        return _from_source(photo, recipe, plan)
    return _from_array(photo, recipe, plan)


def check_blur(photo: "Source | Image | Array", psf: PsfOrField, channels: bool) -> tuple[int, ...]:
    """Sides of the pictures or volumes that a PSF blurs, checked to be those of the photo.

    Raises
    ------
    ValueError
        Not a photo or a stack, or the PSFs of a picture of another shape.
    CrfDeblurError
        The PSF is larger than the photo, or has more dimensions.
    """
    shape, sides = tuple(photo.shape), psf_shape(psf)
    if photo.dtype not in KINDS:
        raise ValueError(f"expected an image of uint8, uint16 or float, got {photo.dtype}")
    plane = shape[: len(shape) - channels][-len(sides) :]
    if len(plane) == 2 < len(sides):
        raise CrfDeblurError(
            "the PSF has three dimensions, but the photo is a single picture; give a stack, or a "
            "PSF with rows and columns"
        )
    if len(plane) < len(sides) or 0 in shape or (channels and shape[-1] not in (3, ALPHA)):
        raise ValueError(f"expected a photo or stack for a PSF of {len(sides)} axes, got {shape}")
    if isinstance(psf, PsfField) and psf.shape != plane:
        raise ValueError(f"expected a photo of {psf.shape} as the PSFs, got {plane}")
    if any(large > side for large, side in zip(sides, plane, strict=True)):
        sizes = [" x ".join(map(str, reversed(each))) for each in (sides, plane)]
        raise CrfDeblurError(
            f"the PSF, {sizes[0]} pixels, is larger than the image, {sizes[1]}; "
            "give a smaller PSF or a larger image"
        )
    return plane


@dataclass(frozen=True, slots=True)
class _Plan:
    """Chunks of the result, and what each of them is computed from."""

    shape: tuple[int, ...]
    lead: int
    grid: Grid

    @property
    def chunks(self) -> tuple[tuple[int, ...], ...]:
        sides: list[tuple[int, ...]] = [(1,) * side for side in self.shape[: self.lead]]
        for side, step in zip(self.grid.shape, self.grid.steps, strict=True):
            sides.append(tuple(min(step, side - start) for start in range(0, side, step)))
        return (*sides, *((side,) for side in self._channels))

    def tile(self, block: tuple[int, ...]) -> Tile:
        return self.grid.tile(block[self.lead : self.lead + len(self.grid.shape)])

    def outer(self, block: tuple[int, ...]) -> Region:
        stack = tuple(slice(i, i + 1) for i in block[: self.lead])
        return (*stack, *self.tile(block).outer, *(slice(0, side) for side in self._channels))

    @property
    def _channels(self) -> tuple[int, ...]:
        return self.shape[self.lead + len(self.grid.shape) :]


def _from_source(photo: Source, recipe: Recipe, plan: _Plan) -> "Array":
    import dask.array as da

    def block(block_id: tuple[int, ...]) -> Image:
        return recipe.restored(photo.read(plan.outer(block_id)), plan.tile(block_id))

    result: Array = da.map_blocks(block, chunks=plan.chunks, dtype=photo.dtype, meta=_meta(photo))
    return result


def _from_array(photo: "Image | Array", recipe: Recipe, plan: _Plan) -> "Array":
    import dask.array as da

    lazy = photo if isinstance(photo, da.Array) else da.from_array(photo, chunks=plan.chunks)
    chunks = plan.chunks
    blocks = np.empty([len(each) for each in chunks], dtype=object)
    for number in np.ndindex(blocks.shape):
        part = lazy[plan.outer(number)].rechunk(-1)
        own = tuple((each[i],) for each, i in zip(chunks, number, strict=True))
        blocks[number] = part.map_blocks(
            recipe.restored,
            tile=plan.tile(number),
            chunks=own,
            dtype=photo.dtype,
            meta=_meta(photo),
        )
    result: Array = da.block(blocks.tolist())
    return result


def _meta(photo: Any) -> Image:
    return np.empty((0,) * len(photo.shape), dtype=photo.dtype)


def _has_colors(photo: "Image | Array") -> bool:
    return len(photo.shape) > 2 and photo.shape[-1] in (3, ALPHA)
