"""Verbs of a session that restore other photos with what is known of this one."""

from collections.abc import Sequence
from pathlib import Path

from napari.layers import Image as ImageLayer

from ...deconvolution import Deconvolver
from .. import steps
from ..steps import BatchResult
from ..workspace import Workspace


class OtherPhotosVerbs(Workspace):
    """Verbs of a session that restore other photos with what is known of this one."""

    def restore_layers(
        self, photos: Sequence[ImageLayer], method: Deconvolver | None = None
    ) -> BatchResult:
        """Restore other photos with the response and the PSF of this one, as layers.

        Parameters
        ----------
        photos : sequence of napari.layers.Image
            Photos and stacks of the same camera with the same blur.
        method : Deconvolver, optional
            As in :meth:`deconvolve`.
        """
        return self.do(steps.restoring_layers(self, photos, method))

    def restore_files(
        self,
        paths: Sequence[Path | str],
        folder: Path | str,
        method: Deconvolver | None = None,
    ) -> BatchResult:
        """Restore files with the response and the PSF of this photo.

        Parameters
        ----------
        paths : sequence of Path
            Photos of the same camera with the same blur; a bad one is passed over.
        folder : Path
            Where ``NAME-deblurred`` files are written; made if it is missing.
        method : Deconvolver, optional
            As in :meth:`deconvolve`.
        """
        return self.do(steps.restoring_files(self, paths, folder, method))
