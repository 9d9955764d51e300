"""The stage from a linear image and its PSF to a sharper linear image: verb and method."""

from abc import ABC, abstractmethod

import numpy as np

from .._typing import FloatArray
from ..errors import CrfDeblurError
from ..progress import Job, drain
from ..psf.base import as_psf


class Deconvolver(ABC):
    """A method to undo the blur of one plane."""

    __slots__ = ()

    @abstractmethod
    def run(self, plane: FloatArray, psf: FloatArray) -> Job[FloatArray]:
        """Long job: deconvolve a plane of shape (M, N) with a checked PSF.

        The plane is float32 or float64 and is not modified; the result has its shape and
        kind. Borders are handled, so that they do not ring.
        """


def deconvolving(linear: FloatArray, psf: FloatArray, method: Deconvolver) -> Job[FloatArray]:
    """Job of :func:`deconvolve`: reports progress, can be stopped."""
    linear = np.asarray(linear)
    if linear.ndim not in (2, 3) or linear.size == 0:
        raise ValueError(f"expected an image (M, N) or (M, N, C), got {linear.shape}")
    if linear.dtype not in (np.float32, np.float64):
        raise ValueError(f"expected a linear image of float32 or float64, got {linear.dtype}")
    psf = as_psf(psf)
    if psf.shape[0] > linear.shape[0] or psf.shape[1] > linear.shape[1]:
        raise CrfDeblurError(
            f"the PSF, {psf.shape[1]} x {psf.shape[0]} pixels, is larger than the image, "
            f"{linear.shape[1]} x {linear.shape[0]}; give a smaller PSF or a larger image"
        )
    if not np.isfinite(linear).all():
        raise CrfDeblurError(
            "the image has pixels that are not finite (NaN or infinity); replace them first"
        )
    if linear.ndim == 2:
        return (yield from method.run(linear, psf))
    sharp = np.empty_like(linear)
    for channel in range(linear.shape[2]):
        plane = np.ascontiguousarray(linear[..., channel])
        sharp[..., channel] = yield from method.run(plane, psf)
    return sharp


def deconvolve(linear: FloatArray, psf: FloatArray, method: Deconvolver) -> FloatArray:
    """Undo the blur of a linear image.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C)
        Relative irradiance, float32 or float64; channels are restored one by one.
    psf : ndarray, shape (H, W)
        Point spread function, non-negative; scaled to sum 1, origin at ``side // 2``.
    method : Deconvolver
        For example :class:`~napari_crfdeblur.deconvolution.HyperLaplacian`.

    Returns
    -------
    ndarray
        The shape and kind of `linear`; values can leave [0, 1].

    Raises
    ------
    CrfDeblurError
        A PSF that is no PSF or larger than the image; an image that is not finite.
    """
    return drain(deconvolving(linear, psf, method))
