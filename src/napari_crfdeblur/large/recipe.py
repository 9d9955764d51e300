"""What is done with one tile: the path from linear light on, the blur undone as in the whole."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from .._typing import BoolArray, FloatArray, Image
from ..deconvolution import Deconvolver, PlaneStatistics, Swing, deconvolving, guard
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
    swing : Swing, optional
        Of the whole photo, so that the result is guarded; by default it is not.
    """

    response: Responses
    psf: PsfOrField
    method: Deconvolver
    color: bool
    statistics: tuple[PlaneStatistics, ...]
    swing: Swing | None = None

    def linearized(self, part: Image) -> Intermediates:
        """A part of the photo in linear light.

        Parameters
        ----------
        part : ndarray, shape (..., M, N) or (..., M, N, C)
            With as many more axes of length 1 before as the photo has.
        """
        sides = len(psf_shape(self.psf))
        photo: Image = part.reshape(part.shape[part.ndim - sides - self.color :])
        whole = self.psf.psfs[0, 0] if isinstance(self.psf, PsfField) else self.psf
        have = Intermediates(
            photo, axes=sides, response=self.response, psf=PsfEstimate(whole, PsfStatus.GIVEN)
        )
        options = DeblurOptions(method=self.method)
        return drain(walking(have, options, start=Stage.LINEAR, until=Stage.LINEAR))

    def restored(self, part: Image, tile: Tile) -> Image:
        """Linearize, deconvolve and re-apply a tile with its margins; only the tile is left.

        Parameters
        ----------
        part : ndarray, shape (..., M, N) or (..., M, N, C)
            Pixels of ``tile.outer``, with as many more axes of length 1 before as the photo has.
        """
        have = self.linearized(part)
        undone = {Stage.RESTORE: self._undoing(tile)}
        job = walking(have, DeblurOptions(method=self.method), start=Stage.RESTORE, replaced=undone)
        result = made(drain(job).result, "a result")
        return result.reshape(part.shape[: part.ndim - result.ndim] + result.shape)

    def _undoing(self, tile: Tile) -> Run:
        """The stage in which the blur is undone, for a tile of the whole."""

        def stage(have: Intermediates, options: DeblurOptions) -> Job[Intermediates]:  # noqa: ARG001 - as every stage
            if isinstance(self.psf, PsfField):
                sharp = self._pieced(have, self.psf, tile)
            else:
                sharp = self.deconvolved(have, self.psf)[tile.kept]
            yield from ()
            return replace(have, photo=have.photo[tile.kept], sharp_linear=sharp)

        return stage

    def _pieced(self, have: Intermediates, psfs: PsfField, tile: Tile) -> FloatArray:
        """A tile, piece by piece, of each with the PSF of its middle."""
        light, clipped, worth = made(have.linear, "linear light"), have.lamps, have.worth
        inner = (own.stop - own.start for own in tile.inner)
        sharp = np.zeros((*inner, *light.shape[2:]), dtype=light.dtype)
        for piece in pieces(psfs, tile):
            part = piece.outer
            own = None if worth is None else worth[part]
            whole = self._undone(light[part], clipped[part], own, psfs.at(*piece.center))
            weight = piece.weight[..., None] if self.color else piece.weight
            sharp[piece.inner] += weight * whole[piece.kept]
        return sharp

    def deconvolved(self, have: Intermediates, psf: FloatArray) -> FloatArray:
        """All channels of a part, deconvolved with one PSF and guarded, if that is wished."""
        return self._undone(made(have.linear, "linear light"), have.lamps, have.worth, psf)

    def _undone(
        self, light: FloatArray, clipped: BoolArray, worth: FloatArray | None, psf: FloatArray
    ) -> FloatArray:
        sharp: FloatArray = drain(
            deconvolving(
                np.ascontiguousarray(light),
                psf,
                self.method,
                clipped=clipped,
                weights=worth,
                statistics=self.statistics,
            )
        )
        if self.swing is None:
            return sharp
        return guard(light, sharp, psf.shape, clipped=clipped, whole=self.swing).sharp
