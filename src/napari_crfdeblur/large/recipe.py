"""What is done with one tile: linearized, deconvolved, recorded again."""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from .._typing import BoolArray, FloatArray, Image
from ..deconvolution import Deconvolver, PlaneStatistics
from ..deconvolution.tiles import Tile
from ..errors import CrfDeblurError
from ..photo import ALPHA
from ..progress import drain
from ..psf import PsfField
from ..response import Response, clipped_pixels, linearize, reapply
from .windows import pieces

PsfOrField: TypeAlias = FloatArray | PsfField
"""A PSF of pictures or volumes, or the PSFs of all parts of a picture."""


def psf_shape(psf: PsfOrField) -> tuple[int, ...]:
    """Sides of the PSF, as many as what it blurs has axes."""
    return tuple(psf.psfs.shape[2:] if isinstance(psf, PsfField) else psf.shape)


@dataclass(frozen=True, slots=True, eq=False)
class Recipe:
    """All that is needed to restore one tile, on any machine.

    Parameters
    ----------
    curve : ResponseCurve or sequence of 3 of them
    psf : ndarray, shape (H, W) or (D, H, W), or PsfField
    method : Deconvolver
    color : bool
        Whether the last axis has channels.
    statistics : tuple of PlaneStatistics
        Of each channel of the whole photo.
    """

    curve: Response
    psf: PsfOrField
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
        sides = len(psf_shape(self.psf))
        axes = sides + self.color
        photo: Image = part.reshape(part.shape[part.ndim - axes :])
        light = in_light(photo, self.curve, self.color)
        clipped = clipped_in(photo[..., :3] if self.color else photo, self.color)
        inner = (own.stop - own.start for own in tile.inner)
        sharp = np.empty((*inner, *light.shape[sides:]), dtype=light.dtype)
        for channel, found in enumerate(self.statistics):
            own = (..., channel) if self.color else ...
            sharp[own] = self._undone(light[own], clipped[own], found, tile)
        result = _recorded(sharp, self.curve, photo.dtype, self.color)
        if self.color and photo.shape[-1] == ALPHA:
            result = np.concatenate([result, photo[tile.kept][..., 3:]], axis=-1)
        return result.reshape((1,) * (part.ndim - axes) + result.shape)

    def _undone(
        self, light: FloatArray, clipped: BoolArray, found: PlaneStatistics, tile: Tile
    ) -> FloatArray:
        """One channel of a tile, deconvolved; with the PSFs of all parts, piece by piece."""
        if not isinstance(self.psf, PsfField):
            return self._deconvolved(light, clipped, self.psf, found)[tile.kept]
        sharp = np.zeros([own.stop - own.start for own in tile.inner], dtype=light.dtype)
        for piece in pieces(self.psf, tile):
            psf = self.psf.at(*piece.center)
            whole = self._deconvolved(light[piece.outer], clipped[piece.outer], psf, found)
            sharp[piece.inner] += piece.weight * whole[piece.kept]
        return sharp

    def _deconvolved(
        self, light: FloatArray, clipped: BoolArray, psf: FloatArray, found: PlaneStatistics
    ) -> FloatArray:
        plane, mask = np.ascontiguousarray(light), np.ascontiguousarray(clipped)
        lost = mask if mask.any() else None
        return drain(self.method.run(plane, psf, clipped=lost, statistics=found))


def in_light(photo: Image, curve: Response, channels: bool) -> FloatArray:
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


def clipped_in(photo: Image, channels: bool) -> BoolArray:
    """Where the camera saturated, the shape of the part."""
    shape = (-1, *photo.shape[-2:]) if channels else (-1, photo.shape[-1])
    return clipped_pixels(photo.reshape(shape)).reshape(photo.shape)
