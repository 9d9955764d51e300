"""Pictures continued beyond what was recorded, so that circular deconvolution does not ring.

A blurred photo depends on the scene up to half a PSF outside its frame, where nothing was
recorded. Circular convolution instead assumes that the picture repeats. Both agree once the
gap between one side of the picture and the repeated opposite side holds what the blur would
have recorded there; that is estimated here from the picture itself.
"""

from collections.abc import Sequence

import numpy as np

from . import arrays
from ._typing import BoolArray, FloatArray
from .fourier import (
    Sides,
    convolving,
    correlating,
    fast_shape,
    forward,
    gradient_power,
    inverse,
    laplacian_power,
    otf,
    power,
)
from .progress import Job, Progress, drain

SMOOTHNESS = 0.02  # of the gap: a flat optimum for noise of .003 to .03 of full scale
STEPS = 10  # of conjugate gradients: two fewer lose .01 dB at noise .01, .04 dB at .002
REACH = 2  # PSF sides from the border beyond which the picture does not affect the gap


def periodic_shape(shape: Sides, psf_shape: Sides) -> Sides:
    """Shape that holds a picture and a gap of one PSF side less one, and transforms fast."""
    sides = (side + own - 1 for side, own in zip(shape, psf_shape, strict=True))
    return fast_shape(type(shape)(sides))


def frame(shape: tuple[int, ...]) -> tuple[slice, ...]:
    """Where a picture of this shape lies in its periodic continuation."""
    return tuple(slice(side) for side in shape)


def extend(plane: FloatArray, psf: FloatArray) -> FloatArray:
    """Continue a blurred plane to a periodic one that is consistent with its blur.

    The values `u` in the gap solve ``u = [k * x]``, where `x` minimizes
    ``|k * x - y|^2 + w |D x|^2`` for the plane `y` that has `u` in its gap: a symmetric linear
    system, as for the unknown border of Reeves (2005, Fast image restoration without boundary
    artifacts, IEEE TIP 14). Only the neighborhood of the border takes part in it, so that the
    cost at 12 megapixels is that of about one transform of the whole.

    Parameters
    ----------
    plane : ndarray, shape (M, N) or (Z, M, N)
        Blurred plane or volume, any unit; not modified.
    psf : ndarray, shape (H, W) or (D, H, W)
        Point spread function, sum 1, origin at ``side // 2``.

    Returns
    -------
    ndarray, shape :func:`periodic_shape`
        `plane` at ``[:M, :N]``, in its unit and kind, and the gap behind it.
    """
    return drain(extending(plane, psf, Progress("border", 0, 1)))


def extending(plane: FloatArray, psf: FloatArray, at: Progress) -> Job[FloatArray]:
    """Job of :func:`extend`, as a part of another: reports `at` again and again."""
    extended: FloatArray = arrays.zeros(periodic_shape(plane.shape, psf.shape), plane)
    extended[frame(plane.shape)] = plane
    for axis, known in enumerate(plane.shape):
        beside = (slice(None),) * (axis + 1) + frame(plane.shape[axis + 1 :])
        _bridge(_first(extended[beside], axis), known)
    yield at
    gaps = [axis for axis, side in enumerate(extended.shape) if side > plane.shape[axis]]
    heights = {
        axis: _band_height(plane.shape[axis], extended.shape[axis], psf.shape[axis])
        for axis in gaps
    }
    if all(height < extended.shape[axis] for axis, height in heights.items()):
        for axis, height in heights.items():
            moved, own = _first(extended, axis), np.moveaxis(psf, axis, 0)
            yield from _filling_rows(moved, _moved(plane.shape, axis), own, height, at)
    else:
        yield from _predicting(extended, _outside(extended, plane.shape), psf, at)
    return extended


def _first(array: FloatArray, axis: int) -> FloatArray:
    """View with an axis moved to the front."""
    view: FloatArray = arrays.namespace(array).moveaxis(array, axis, 0)
    return view


def _moved(shape: tuple[int, ...], axis: int) -> tuple[int, ...]:
    return (shape[axis], *shape[:axis], *shape[axis + 1 :])


def _outside(extended: FloatArray, shape: tuple[int, ...]) -> BoolArray:
    """True in the gap."""
    gap: BoolArray = extended == extended
    gap[frame(shape)] = False
    return gap


def _bridge(picture: FloatArray, start: int, stop: int | None = None) -> None:
    """Fill the rows from `start` to `stop` linearly, from the row before to the row after."""
    stop = picture.shape[0] if stop is None else stop
    share = np.linspace(0, 1, stop - start + 2)[1:-1].reshape(-1, *[1] * (picture.ndim - 1))
    share = arrays.like(share, picture)
    before, after = picture[start - 1, ...], picture[stop % picture.shape[0], ...]
    picture[start:stop, ...] = (1 - share) * before + share * after


def _band_height(known: int, whole: int, side: int) -> int:
    """Rows of a band around the gap behind row `known`, with a second gap where it is cut."""
    return fast_shape((2 * REACH * side + whole - known + side - 1,))[0]


def _filling_rows(
    extended: FloatArray, known: tuple[int, ...], psf: FloatArray, height: int, at: Progress
) -> Job[None]:
    """Job: predict the rows of the gap, below the first ``known[0]``, from a band of `height`."""
    near, gap = REACH * psf.shape[0], extended.shape[0] - known[0]
    band: FloatArray = arrays.zeros((height, *extended.shape[1:]), extended)
    band[:near, ...] = extended[:near, ...]
    band[height - near - gap :, ...] = extended[extended.shape[0] - near - gap :, ...]
    _bridge(band, near, height - near - gap)
    unknown: BoolArray = band == band
    unknown[(slice(near), *frame(known[1:]))] = False
    unknown[(slice(height - near - gap, height - gap), *frame(known[1:]))] = False
    yield from _predicting(band, unknown, psf, at)
    extended[known[0] :, ...] = band[height - gap :, ...]


def _predicting(
    picture: FloatArray, unknown: BoolArray, psf: FloatArray, at: Progress
) -> Job[None]:
    """Job: solve ``u = [A y]`` for the unknown pixels, in place, by conjugate gradients.

    `A` is blur after deconvolution, ``|K|^2 / (|K|^2 + w |D|^2)``; `y` contains `u`.
    """
    smoothing = _blur_of_deblurred(psf, picture)
    free: FloatArray = arrays.namespace(picture).astype(unknown, picture.dtype)
    yield at

    def predicted(values: FloatArray) -> FloatArray:
        return inverse(smoothing * forward(values), picture.shape) * free

    residual = predicted(picture) - picture * free
    yield at
    # what remains at single precision; a constant picture is there at once
    negligible = (1e-6 * arrays.norm(picture)) ** 2
    direction, energy = arrays.copy(residual), arrays.dot(residual, residual)
    for _ in range(STEPS):
        if energy <= negligible:
            return
        image = direction - predicted(direction)
        step = energy / arrays.dot(direction, image)
        picture += step * direction
        residual -= step * image
        previous, energy = energy, arrays.dot(residual, residual)
        direction *= energy / previous
        direction += residual
        yield at


def _blur_of_deblurred(psf: FloatArray, picture: FloatArray) -> FloatArray:
    smoothing = power(otf(psf, picture.shape, picture))
    laplacian = laplacian_power(gradient_power(picture.shape, picture))
    smoothing /= smoothing + SMOOTHNESS * laplacian
    return smoothing


class Band:
    """The gap behind one side of a picture, and as much around it as blur carries into it.

    What the blur of a scene would record in the gap, and what the gap says about the scene,
    cost the transforms of a band instead of those of the whole.

    Parameters
    ----------
    axis : int
        Side: the gap is behind the last row, column or plane.
    known : tuple of int
        Shape of the picture. Of the corners of the gap, where several sides meet, each belongs
        to the first axis.
    whole : ndarray
        The periodic continuation, or another of its shape and kind.
    psf : ndarray
        Point spread function.
    """

    def __init__(
        self, axis: int, known: tuple[int, ...], whole: FloatArray, psf: FloatArray
    ) -> None:
        side, self.reach = whole.shape[axis], psf.shape[axis] // 2
        self.axis, self.known, self.gap = axis, known[axis], side - known[axis]
        height = fast_shape((self.gap + 2 * self.reach,))[0]
        self.start = self.known - self.reach if height < side else 0
        shape = (min(height, side), *_moved(whole.shape, axis)[1:])
        self.band: FloatArray = arrays.zeros(shape, whole)
        self.transfer = otf(np.moveaxis(psf, axis, 0), shape, whole)
        first = self.known - self.start
        beside = (*known[:axis], *whole.shape[axis + 1 :])
        self.inside = (slice(first, first + self.gap), *frame(beside))

    def gap_of(self, whole: FloatArray) -> FloatArray:
        """The values of a periodic picture in the gap, a view."""
        inside = (slice(self.known, None), *self.inside[1:])
        return _first(whole, self.axis)[inside]

    def blurring(self, scene: FloatArray, at: Progress) -> Job[FloatArray]:
        """Job: what the gap would have recorded of a scene."""
        scene, band = _first(scene, self.axis), self.band
        for part, own in self._parts(scene):
            band[own, ...] = scene[part, ...]
        blurred = yield from convolving(band, self.transfer, at)
        yield at
        return blurred[self.inside]

    def gathering(self, values: FloatArray, into: FloatArray, at: Progress) -> Job[None]:
        """Job: add the adjoint of :meth:`blurring`, applied to values of the gap."""
        band: FloatArray = arrays.zeros(self.band.shape, values)
        band[self.inside] = values
        band = yield from correlating(band, self.transfer, at)
        into = _first(into, self.axis)
        for part, own in self._parts(into):
            into[part, ...] += band[own, ...]
        yield at

    def _parts(self, whole: FloatArray) -> Sequence[tuple[slice, slice]]:
        """Rows of the whole, and where they are in the band."""
        if self.start == 0:
            return [(slice(None), slice(None))]
        last = whole.shape[0] - self.start
        return [
            (slice(self.start, None), slice(last)),
            (slice(self.reach), slice(last, last + self.reach)),
        ]


def banding(
    known: tuple[int, ...], whole: FloatArray, psf: FloatArray, at: Progress
) -> Job[list[Band]]:
    """Job: all parts of the gap around a picture of shape `known`, each once."""
    found = []
    for axis, side in enumerate(known):
        if side < whole.shape[axis]:
            found.append(Band(axis, known, whole, psf))
            yield at
    return found
