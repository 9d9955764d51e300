"""What is done with one tile: the path from linear light on, the blur undone as in the whole."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from .._typing import BoolArray, FloatArray, Image
from ..deconvolution import Deconvolver, PlaneStatistics
from ..deconvolution.tiles import Tile
from ..estimate import Responses
from ..pipeline import DeblurOptions, Intermediates, Stage, walking
from ..pipeline.intermediates import made
from ..pipeline.path import Run
from ..progress import Job, drain
from ..psf import PsfEstimate, PsfField, PsfStatus
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
    response : Responses
        Of all channels, or of each.
    psf : ndarray, shape (H, W) or (D, H, W), or PsfField
    method : Deconvolver
    color : bool
        Whether the last axis has channels.
    statistics : tuple of PlaneStatistics
        Of each channel of the whole photo.
    """

    response: Responses
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
        whole = self.psf.psfs[0, 0] if isinstance(self.psf, PsfField) else self.psf
        have = Intermediates(
            photo, axes=sides, response=self.response, psf=PsfEstimate(whole, PsfStatus.GIVEN)
        )
        options = DeblurOptions(method=self.method)
        undone = {Stage.RESTORE: self._undoing(tile)}
        job = walking(have, options, start=Stage.LINEAR, replaced=undone)
        result = made(drain(job).result, "a result")
        return result.reshape((1,) * (part.ndim - axes) + result.shape)

    def _undoing(self, tile: Tile) -> Run:
        """The stage in which the blur is undone, for a tile of the whole."""

        def stage(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:  # noqa: ARG001 - as every stage
            light, clipped = made(have.linear, "linear light"), have.clipped
            inner = (own.stop - own.start for own in tile.inner)
            sharp = np.empty((*inner, *light.shape[have.axes :]), dtype=light.dtype)
            for channel, found in enumerate(self.statistics):
                own = (..., channel) if self.color else ...
                sharp[own] = self._undone(light[own], clipped[own], found, tile)
            yield from ()
            return replace(have, photo=have.photo[tile.kept], sharp_linear=sharp)

        return stage

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
