"""Photos larger than memory, restored tile by tile: dask arrays in, dask arrays out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from .._typing import BoolArray, FloatArray, Image
from ..deconvolution import Deconvolver, PlaneStatistics, Tiled, measure
from ..deconvolution.tiles import Grid, Region, Tile
from ..errors import CrfDeblurError
from ..linear import Response, clipped_pixels, linearize, reapply
from ..photo import ALPHA
from ..progress import drain
from ..psf import as_psf
from .sources import KINDS, Source, open_source

if TYPE_CHECKING:
    from dask.array import Array

Large: TypeAlias = "Source | Path | Image | Array"
"""A photo or a stack: a file, an open one, an array of numpy or of dask."""

PATCH, PATCHES = 256, 64  # sides and number of the parts from which a photo is known


@dataclass(frozen=True, slots=True, eq=False)
class Recipe:
    """All that is needed to restore one tile, on any machine.

    Parameters
    ----------
    curve : ResponseCurve or sequence of 3 of them
    psf : ndarray, shape (H, W) or (D, H, W)
    method : Deconvolver
    color : bool
        Whether the last axis has channels.
    statistics : tuple of PlaneStatistics
        Of each channel of the whole photo.
    """

    curve: Response
    psf: FloatArray
    method: Deconvolver
    color: bool
    statistics: tuple[PlaneStatistics, ...]

    def restored(self, part: Image, tile: Tile) -> Image:
        """Linearize, deconvolve and re-apply a tile with its margins; only the tile is left.

        Parameters
        ----------
        part : ndarray, shape (..., M, N) or (..., M, N, C)
            Pixels of ``tile.outer``, with as many more axes of length 1 before as the photo has.
        """
        axes = self.psf.ndim + self.color
        photo: Image = part.reshape(part.shape[part.ndim - axes :])
        light = _light(photo, self.curve, self.color)
        clipped = _clipped(photo[..., :3] if self.color else photo, self.color)
        sides = (own.stop - own.start for own in tile.inner)
        sharp = np.empty((*sides, *light.shape[self.psf.ndim :]), dtype=light.dtype)
        for channel, found in enumerate(self.statistics):
            own = (..., channel) if self.color else ...
            plane, mask = np.ascontiguousarray(light[own]), np.ascontiguousarray(clipped[own])
            job = self.method.run(
                plane, self.psf, clipped=mask if mask.any() else None, statistics=found
            )
            sharp[own] = drain(job)[tile.kept]
        result = _recorded(sharp, self.curve, photo.dtype, self.color)
        if self.color and photo.shape[-1] == ALPHA:
            result = np.concatenate([result, photo[tile.kept][..., 3:]], axis=-1)
        return result.reshape((1,) * (part.ndim - axes) + result.shape)


def restore_large(
    photo: Large,
    curve: Response,
    psf: FloatArray,
    method: Deconvolver,
    *,
    channels: bool | None = None,
    statistics: Sequence[PlaneStatistics] | None = None,
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
    psf : ndarray, shape (H, W) or (D, H, W)
        Point spread function, non-negative; scaled to sum 1.
    method : Deconvolver
        Used in tiles; :class:`~napari_crfdeblur.deconvolution.Tiled` says which.
    channels : bool, optional
        Whether the last axis has the colors; by default if it has a length of 3 or 4.
    statistics : sequence of PlaneStatistics, optional
        Noise and contrast of each channel; by default they are measured, at once, on a sample.

    Returns
    -------
    dask array, the shape and kind of `photo`
        One chunk for each tile. The values do not depend on where and in which order they are
        computed.

    Raises
    ------
    CrfDeblurError
        A file or PSF that is none, a PSF larger than the photo; later, when a tile is computed,
        pixels that are not finite or outside [0, 1], or a file that has changed.
    """
    photo = open_source(photo) if isinstance(photo, Path) else photo
    psf = as_psf(psf)
    if channels is None:
        channels = photo.color if isinstance(photo, Source) else _has_colors(photo)
    _check(photo, psf, channels)
    tiled = method if isinstance(method, Tiled) else Tiled(method)
    lead = len(photo.shape) - psf.ndim - channels
    grid = tiled.grid(tuple(photo.shape[lead : lead + psf.ndim]), psf.shape)
    statistics = statistics or measure_large(photo, curve, channels=channels)
    recipe = Recipe(curve, psf, tiled.method, channels, tuple(statistics))
    plan = _Plan(tuple(photo.shape), lead, grid)
    return (
        _from_source(photo, recipe, plan)
        if isinstance(photo, Source)
        else (_from_array(photo, recipe, plan))
    )


def measure_large(
    photo: "Source | Image | Array", curve: Response, *, channels: bool
) -> tuple[PlaneStatistics, ...]:
    """Noise and contrast of each channel in linear light.

    Of photos of more than four megapixels, from patches spread evenly over all of it.
    """
    patches = [_light(part, curve, channels) for part in _patches(photo, channels)]
    width = min(part.shape[1] for part in patches)
    light = np.concatenate([part[:, :width] for part in patches])
    planes = np.moveaxis(light, -1, 0) if channels else [light]
    if not np.isfinite(light).all():
        raise CrfDeblurError(
            "the image has pixels that are not finite (NaN or infinity); replace them first"
        )
    return tuple(measure(np.ascontiguousarray(plane)) for plane in planes)


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


def _patches(photo: "Source | Image | Array", channels: bool) -> Iterator[Image]:
    """The slices of a small photo, or patches of a large one."""
    plane = 3 if channels else 2
    *stack, rows, columns = photo.shape[: len(photo.shape) - channels]
    ends = tuple(slice(0, side) for side in photo.shape[len(photo.shape) - channels :])
    if prod((*stack, rows, columns)) <= PATCHES * PATCH**2:
        for index in np.ndindex(*stack):
            here = (*(slice(i, i + 1) for i in index), slice(0, rows), slice(0, columns), *ends)
            yield _read(photo, here).reshape(photo.shape[-plane:])
        return
    slices = np.unique(np.linspace(0, prod(stack) - 1, min(prod(stack), PATCHES)).round())
    places = list(product(_starts(rows, len(slices)), _starts(columns, len(slices))))
    for number in slices.astype(int):
        index = np.unravel_index(number, stack) if stack else ()
        for top, left in places:
            inner = slice(top, min(top + PATCH, rows)), slice(left, min(left + PATCH, columns))
            here = (*(slice(int(i), int(i) + 1) for i in index), *inner, *ends)
            part = _read(photo, here)
            yield part.reshape(part.shape[len(index) :])


def _starts(length: int, slices: int) -> list[int]:
    """Where patches begin along an axis: at most 8 of them, less if there are many slices."""
    count = min(-(-length // PATCH), max(1, round((PATCHES / slices) ** 0.5)))
    return [int(s) for s in np.linspace(0, max(length - PATCH, 0), count)]


def _read(photo: "Source | Image | Array", region: Region) -> Image:
    return photo.read(region) if isinstance(photo, Source) else np.asarray(photo[region])


def _light(photo: Image, curve: Response, channels: bool) -> FloatArray:
    """A part in linear light, shape (M, N) or (M, N, 3), or with slices before."""
    seen = photo[..., :3] if channels else photo
    low, high = seen.min(), seen.max()
    if not (np.isfinite(low) and np.isfinite(high)):
        raise CrfDeblurError(
            "the image has pixels that are not finite (NaN or infinity); replace them first"
        )
    if photo.dtype.kind == "f" and not (low >= 0 and high <= 1):
        raise CrfDeblurError(
            f"the image has values from {low:.4g} to {high:.4g}; "
            "divide a floating-point image by its full scale, so that it lies in [0, 1]"
        )
    if not channels:
        return linearize(photo.reshape(-1, photo.shape[-1]), curve).reshape(photo.shape)
    return linearize(seen.reshape(-1, *seen.shape[-2:]), curve).reshape(seen.shape)


def _recorded(sharp: FloatArray, curve: Response, dtype: np.dtype[Any], channels: bool) -> Image:
    shape = (-1, *sharp.shape[-2:]) if channels else (-1, sharp.shape[-1])
    return reapply(sharp.reshape(shape), curve, dtype).reshape(sharp.shape)


def _clipped(photo: Image, channels: bool) -> BoolArray:
    shape = (-1, *photo.shape[-2:]) if channels else (-1, photo.shape[-1])
    return clipped_pixels(photo.reshape(shape)).reshape(photo.shape)


def _has_colors(photo: "Image | Array") -> bool:
    return len(photo.shape) > 2 and photo.shape[-1] in (3, ALPHA)


def _check(photo: "Source | Image | Array", psf: FloatArray, channels: bool) -> None:
    shape = tuple(photo.shape)
    if photo.dtype not in KINDS:
        raise ValueError(f"expected an image of uint8, uint16 or float, got {photo.dtype}")
    lead = len(shape) - psf.ndim - channels
    if lead < 0 or 0 in shape or (channels and shape[-1] not in (3, ALPHA)):
        raise ValueError(f"expected a photo or stack for a PSF of {psf.ndim} axes, got {shape}")
    plane = shape[lead : lead + psf.ndim]
    if any(large > side for large, side in zip(psf.shape, plane, strict=True)):
        sizes = [" x ".join(map(str, reversed(each))) for each in (psf.shape, plane)]
        raise CrfDeblurError(
            f"the PSF, {sizes[0]} pixels, is larger than the image, {sizes[1]}; "
            "give a smaller PSF or a larger image"
        )
