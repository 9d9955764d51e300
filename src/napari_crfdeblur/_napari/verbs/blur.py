"""Verbs of a session that find the blur: one PSF, or those of all parts."""

from collections.abc import Sequence
from pathlib import Path

from napari.layers import Image as ImageLayer

from ..._typing import FloatArray
from ...psf import PsfEstimate, PsfEstimator, PsfField, RadonFit
from .. import steps
from ..blur_files import read_blur
from ..pixels import kernel_of, unwrapped
from ..regions import Span
from ..workspace import Workspace


class BlurVerbs(Workspace):
    """Verbs of a session that find the blur: one PSF, or those of all parts."""

    def estimate_psf(
        self,
        method: PsfEstimator | RadonFit | None = None,
        *,
        region: Sequence[Span] | None = None,
        regions: int | tuple[int, int] | None = None,
    ) -> PsfEstimate:
        """Estimate the PSF in linear light; it is shown as a layer beside the photo.

        Parameters
        ----------
        method : PsfEstimator or RadonFit, optional
            By default :class:`~napari_crfdeblur.psf.Variational` of the size of the blur.
            :class:`~napari_crfdeblur.psf.RadonFit` finds it from the edges of the session alone.
        region : sequence of (start, stop), optional
            For each axis of the photo; by default the plane that is shown. Edges count wherever
            they lie.
        regions : int or (int, int), optional
            Rows and columns of parts, or parts along the longer side, each of which gets a PSF
            of its own (``state.field``), for a camera that turned; by default one PSF serves
            the whole photo. That of the whole is found, and returned, all the same.

        Raises
        ------
        CrfDeblurError
            There is no response, the picture shows too little structure, or there are no edges
            for a method that needs them.
        """
        return self.do(steps.estimating_psf(self, method, region=region, regions=regions))

    def set_psf(
        self, psf: FloatArray, *, edited: bool = False, field: PsfField | None = None
    ) -> PsfEstimate:
        """Use a PSF that is known.

        Parameters
        ----------
        psf : ndarray, shape (H, W) or (D, H, W)
            Non-negative, scaled to sum 1; its origin is the center pixel. With one of three
            dimensions, stacks are restored as volumes of their last three axes.
        edited : bool
            Whether it is an estimate changed by hand, which is said of it from then on.
        field : PsfField, optional
            PSFs of the parts of the photo, if they differ; `psf` is that of the whole.

        Raises
        ------
        CrfDeblurError
            It is no PSF, has more dimensions than the photo, or `field` is that of a picture
            of other sides.
        """
        return self.do(steps.setting_psf(self, psf, edited=edited, field=field))

    def load_psf(self, path: Path | str) -> PsfEstimate:
        """Use the PSF in a picture, a stack of pictures, an array file, or what was exported."""
        psf, field = read_blur(Path(path))
        return self.set_psf(psf, field=field)

    def use_psf_of(self, layer: ImageLayer) -> PsfEstimate:
        """Use the PSF in an image layer, as it is now."""
        return self.set_psf(kernel_of(unwrapped(layer), self.photo))
