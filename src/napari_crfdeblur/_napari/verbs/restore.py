"""Verbs of a session that make new pictures of the photo."""

from collections.abc import Sequence
from pathlib import Path

from napari.layers import Image as ImageLayer

from ...deconvolution import Deconvolver
from ...pipeline import DeblurOptions
from ...response import Response, ResponseCurve
from .. import outputs, steps
from ..regions import Span
from ..workspace import Workspace


class RestoreVerbs(Workspace):
    """Verbs of a session that make new pictures of the photo."""

    def linearize(self, *, region: Sequence[Span] | None = None) -> ImageLayer:
        """Undo the response: the photo in linear light, as a layer.

        Parameters
        ----------
        region : sequence of (start, stop), optional
            For each axis of the photo; by default all of it, every slice of a stack.
        """
        return self.do(steps.linearizing(self, region=region))

    def deconvolve(self, method: Deconvolver | None = None) -> ImageLayer:
        """Undo the blur of the linear photo, as a layer.

        Parameters
        ----------
        method : Deconvolver, optional
            By default :class:`~napari_crfdeblur.deconvolution.LocalShrinkage`.
        """
        return self.do(steps.deconvolving(self, method))

    def reapply(self) -> ImageLayer:
        """Apply the response again: the deblurred photo in its own numbers, as a layer."""
        return self.do(steps.reapplying(self))

    def restore(
        self, method: Deconvolver | None = None, *, region: Sequence[Span] | None = None
    ) -> ImageLayer:
        """Linearize, deconvolve and re-apply; returns the layer of the deblurred photo."""
        return self.do(steps.restoring(self, method, region=region))

    def restore_into(
        self, path: Path | str, method: Deconvolver | None = None, *, overwrite: bool = False
    ) -> ImageLayer:
        """Restore the photo into a file, tile by tile, and show it from there.

        For photos and stacks, dask arrays among them, whose results do not fit into memory.

        Parameters
        ----------
        path : Path
            A BigTIFF of tiles (``.tif``) or a folder of zarr (``.zarr``); it appears under this
            name when it is complete.
        method : Deconvolver, optional
            As in :meth:`deconvolve`.
        overwrite : bool
            Whether a file that is there already is replaced.

        Raises
        ------
        CrfDeblurError
            The file is there, or cannot be written.
        """
        return self.do(steps.restoring_into(self, path, method, overwrite=overwrite))

    def compare_with(
        self,
        curve: ResponseCurve | None = None,
        method: Deconvolver | None = None,
        *,
        region: Sequence[Span] | None = None,
    ) -> ImageLayer:
        """Restore the photo with another response, gamma 2.2 by default, and the same PSF."""
        return self.do(steps.comparing(self, curve, method, region=region))

    def preview(
        self, method: Deconvolver | None = None, *, curve: Response | None = None
    ) -> ImageLayer:
        """Restore what the canvas shows, and show it in place of the last preview."""
        return self.do(steps.previewing(self, method, curve=curve))

    def deblur(self, options: DeblurOptions | None = None) -> ImageLayer:
        """Do the whole path; edges that the session already has are used.

        Parameters
        ----------
        options : DeblurOptions, optional
            What is known, and the methods for the rest.
        """
        return self.do(steps.deblurring(self, options))

    def flip(self) -> None:
        """Show the photo instead of its restored version, or the other way round."""
        photo, restored = self.required_pair()
        before = outputs.shown(self, photo) == "photo"
        for layer, kind in outputs.made_of(self, photo).items():
            if kind != outputs.PSF and layer is not restored:
                layer.visible = False  # what lies between them
        photo.visible, restored.visible = True, before
