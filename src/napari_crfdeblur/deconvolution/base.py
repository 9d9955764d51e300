"""The stage from a linear image and its PSF to a sharper linear image: verb and method."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from .. import arguments, arrays
from .._typing import BoolArray, FloatArray
from ..errors import CrfDeblurError
from ..progress import Job, drain
from ..psf.base import as_psf
from .noise import PlaneStatistics, checked_statistics
from .weights import checked_weights, guessed, of_plane


class Deconvolver(ABC):
    """A method to undo the blur of one plane, or of one volume."""

    __slots__ = ()

    # Side of a tile, in pixels that it loses at its ends: `1 + 2 / e` is fastest where the time
    # for a pixel grows as `side ** e`. Once a transform outgrows the caches `e` is .3; that the
    # border of each tile is continued, which costs more the smaller it is, leaves .18.
    tile_side: ClassVar[float] = 12.0

    @property
    def reach(self) -> float:
        """Sides of the PSF around a tile beyond which the picture changes it by less than noise."""
        return 2.0

    @abstractmethod
    def run(
        self,
        plane: FloatArray,
        psf: FloatArray,
        *,
        clipped: BoolArray | None = None,
        weights: FloatArray | None = None,
        statistics: PlaneStatistics | None = None,
    ) -> Job[FloatArray]:
        """Long job: deconvolve a plane (M, N) or a volume (Z, M, N).

        Borders are handled, so that they do not ring.

        Parameters
        ----------
        plane : ndarray, shape (M, N) or (Z, M, N)
            float32 or float64, not modified; the result has its shape and kind.
        psf : ndarray, shape (H, W) or (D, H, W)
            Made by :func:`~napari_crfdeblur.psf.as_psf`, no larger than the plane.
        clipped : ndarray of bool, the shape of `plane`, optional
            True where the camera saturated: there the blurred light is at least `plane`.
        weights : ndarray, the shape and kind of `plane`, optional
            What each pixel is worth, from 0, not recorded, to 1, recorded to within the noise.
        statistics : PlaneStatistics, optional
            Noise and contrast of the whole picture, of which `plane` may be a part; by
            default they are measured on `plane`.
        """


def deconvolving(
    linear: FloatArray,
    psf: FloatArray,
    method: Deconvolver,
    *,
    clipped: BoolArray | None = None,
    weights: FloatArray | None = None,
    statistics: Sequence[PlaneStatistics] | None = None,
) -> Job[FloatArray]:
    """Job of :func:`deconvolve`: reports progress, can be stopped."""
    linear = arguments.array(linear, "a linear image of float32 or float64")
    psf = as_psf(psf)
    check_method(method)
    _check_image(linear, psf)
    clipped, weights = _checked(clipped, linear), checked_weights(weights, linear)
    count = linear.shape[-1] if linear.ndim > psf.ndim else 1
    found: Sequence[PlaneStatistics | None] = [None] * count
    if statistics is not None:
        found = checked_statistics(statistics, linear, psf.ndim)
    if linear.ndim == psf.ndim:
        plane = linear if weights is None else guessed(linear, weights)
        return (
            yield from method.run(plane, psf, clipped=clipped, weights=weights, statistics=found[0])
        )
    sharp: FloatArray = arrays.empty_like(linear)
    for channel in range(linear.shape[-1]):
        plane = arrays.contiguous(linear[..., channel])
        own = None if clipped is None else _checked(clipped[..., channel], plane)
        worth = None if weights is None else of_plane(weights[..., channel])
        plane = plane if worth is None else guessed(plane, worth)
        sharp[..., channel] = yield from method.run(
            plane, psf, clipped=own, weights=worth, statistics=found[channel]
        )
    return sharp


def _checked(clipped: BoolArray | None, linear: FloatArray) -> BoolArray | None:
    """Clipped pixels as they can be worked with; None if there are none."""
    if clipped is None:
        return None
    clipped = arguments.array(clipped, "clipped pixels as bool")
    if clipped.shape != linear.shape or arrays.dtype_name(clipped) != "bool":
        raise ValueError(
            f"expected clipped pixels as bool of shape {tuple(linear.shape)}, "
            f"got {arrays.dtype_name(clipped)} of shape {tuple(clipped.shape)}"
        )
    return arrays.contiguous(clipped) if bool(arrays.namespace(clipped).any(clipped)) else None


def deconvolving_slices(
    stack: FloatArray,
    psf: FloatArray,
    method: Deconvolver,
    *,
    clipped: BoolArray | None = None,
    weights: FloatArray | None = None,
) -> Job[FloatArray]:
    """Job of :func:`deconvolve_slices`: reports progress, can be stopped."""
    stack = arguments.array(stack, "a stack of float32 or float64")
    if stack.ndim not in (3, 4) or stack.shape[0] == 0:
        raise ValueError(f"expected a stack (Z, M, N) or (Z, M, N, C), got {tuple(stack.shape)}")
    if clipped is not None:
        clipped = arguments.array(clipped, "clipped pixels as bool")
    if clipped is not None and clipped.shape != stack.shape:
        raise ValueError(
            f"expected clipped pixels of shape {tuple(stack.shape)}, got {tuple(clipped.shape)}"
        )
    weights = checked_weights(weights, stack)
    sharp: FloatArray = arrays.empty_like(stack)
    for z in range(stack.shape[0]):
        own = None if clipped is None else clipped[z, ...]
        worth = None if weights is None else weights[z, ...]
        sharp[z, ...] = yield from deconvolving(
            stack[z, ...], psf, method, clipped=own, weights=worth
        )
    return sharp


def deconvolve_slices(
    stack: FloatArray,
    psf: FloatArray,
    method: Deconvolver,
    *,
    clipped: BoolArray | None = None,
    weights: FloatArray | None = None,
) -> FloatArray:
    """Undo the same blur in every slice of a stack, one by one.

    Parameters
    ----------
    stack : ndarray, shape (Z, M, N) or (Z, M, N, C)
        Relative irradiance, float32 or float64.
    psf : ndarray, shape (H, W)
        Point spread function within a slice, as for :func:`deconvolve`; with one of three
        dimensions, hand the whole stack to that.
    method : Deconvolver
        For example :class:`~napari_crfdeblur.deconvolution.RichardsonLucy`.
    clipped : ndarray of bool, the shape of `stack`, optional
        True where the camera saturated.
    weights : ndarray, the shape of `stack`, optional
        What each pixel is worth, as for :func:`deconvolve`.

    Returns
    -------
    ndarray
        The shape and kind of `stack`.

    Raises
    ------
    CrfDeblurError
        As :func:`deconvolve`.
    """
    return drain(deconvolving_slices(stack, psf, method, clipped=clipped, weights=weights))


def _check_image(linear: FloatArray, psf: FloatArray) -> None:
    axes = psf.ndim
    if axes == 3 and linear.ndim == 2:
        raise CrfDeblurError(
            f"the PSF has 3 dimensions, {_size(psf.shape)}, but the image has 2; "
            "give a PSF with rows and columns, or a volume"
        )
    if linear.ndim not in (axes, axes + 1) or 0 in linear.shape:
        shapes = "(M, N) or (M, N, C)" if axes == 2 else "(Z, M, N) or (Z, M, N, C)"
        raise ValueError(
            f"expected an image {shapes} for a PSF of {axes} dimensions, got {tuple(linear.shape)}"
        )
    if arrays.dtype_name(linear) not in ("float32", "float64"):
        raise ValueError(f"expected a linear image of float32 or float64, got {linear.dtype}")
    if any(large > side for large, side in zip(psf.shape, linear.shape[:axes], strict=True)):
        raise CrfDeblurError(
            f"the PSF, {_size(psf.shape)} pixels, is larger than the image, "
            f"{_size(linear.shape[:axes])}; give a smaller PSF or a larger image"
        )
    arguments.check_pixels(linear)


def check_method(method: Deconvolver) -> None:
    """Raise ValueError unless this is a method of deconvolution."""
    arguments.instance(method, Deconvolver, "a method of deconvolution, such as Wiener(),")


def _size(shape: tuple[int, ...]) -> str:
    """Sides as a user gives them: width first."""
    return " x ".join(str(side) for side in reversed(shape))


def deconvolve(
    linear: FloatArray,
    psf: FloatArray,
    method: Deconvolver,
    *,
    clipped: BoolArray | None = None,
    weights: FloatArray | None = None,
    statistics: Sequence[PlaneStatistics] | None = None,
) -> FloatArray:
    """Undo the blur of a linear image or volume.

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, C); (Z, M, N) or (Z, M, N, C) for a 3-D PSF
        Relative irradiance, float32 or float64; channels are restored one by one. An array of
        numpy, or of torch or cupy, on whose device it is worked on.
    psf : ndarray, shape (H, W) or (D, H, W)
        Point spread function, non-negative; scaled to sum 1, origin at ``side // 2``.
    method : Deconvolver
        For example :class:`~napari_crfdeblur.deconvolution.HyperLaplacian`.
    clipped : ndarray of bool, the shape of `linear`, optional
        True where the camera saturated, so that the recorded light is only a lower bound.
    weights : ndarray, the shape of `linear`, optional
        What each pixel is worth: the inverse of its variance in any unit, 0 or more; 0 where
        nothing was recorded, as of dust or a dead pixel. By default all are alike.
    statistics : sequence of PlaneStatistics, optional
        Of each channel (:func:`~.noise.measure_channels`); by default the method measures them.

    Returns
    -------
    ndarray
        The shape and kind of `linear`; values can leave [0, 1].

    Raises
    ------
    CrfDeblurError
        A PSF that is no PSF or larger than the image; an image that is not finite, or has values
        above 1e9; weights that are all zero.
    """
    return drain(
        deconvolving(linear, psf, method, clipped=clipped, weights=weights, statistics=statistics)
    )
