"""Blind estimation of a PSF from the strong edges of a blurred picture, coarse to fine."""

from dataclasses import dataclass

from ..._typing import FloatArray
from ...progress import Job
from .blurred import Blurred
from .estimation import SingleSearch
from .two_phases import searching


@dataclass(frozen=True, slots=True)
class XuJia(SingleSearch):
    """Two phases: edges and PSF in turns from coarse to fine, then a sparse refinement.

    Xu & Jia (2010, Two-phase kernel estimation for robust motion deblurring, ECCV). Phase
    one alternates between the gradient `s` of the sharp picture, where it is strong, and ::

        k = argmin |k * s - D y|^2 + g |k|^2

    while weaker and weaker edges are let in; phase two lets pixels outside the support of the
    PSF pay for ``|k|`` instead. The edges come from :class:`~.edge_prediction.EdgePredictor`
    in place of the paper's shock filter and its selection by usefulness: it takes the PSF so
    far into account, and halves the median error ratio on the photos of Levin et al. (2009).

    Where the sharp picture lies cannot be known: the PSF is shifted so that its center of
    mass falls on the center pixel, to half a pixel, and padded with zeros for that if need be.
    The status follows from whether parts of the picture agree on the PSF
    (:func:`~.confidence.diagnose`).

    Parameters
    ----------
    size : int, optional
        Largest extent of the PSF in pixels, odd, at least 3; too small cuts the PSF, up to
        twice too large does little harm. Found by itself if not given.
    region : int
        Longest side in pixels of the part of the picture that is used, or three PSF sizes if
        that is more; of larger pictures the most informative square is taken
        (:class:`~.overview.Overview`).
    """

    def searching(self, blurred: Blurred, size: int) -> Job[FloatArray]:
        """Long job: a PSF of `size` x `size` pixels."""
        return searching(blurred, size)
