"""Pictures continued beyond their frame, so that circular deconvolution does not ring.

A blurred photo depends on the scene up to half a PSF outside its frame, where nothing was
recorded. Circular convolution instead assumes that the picture repeats. Both agree once the
gap between one side of the picture and the repeated opposite side holds what the blur would
have recorded there; that is estimated here from the picture itself.
"""

import numpy as np

from ._typing import BoolArray, FloatArray
from .fourier import Shape, fast_shape, forward, gradient_power, inverse, otf, power
from .progress import Job, Progress, drain

SMOOTHNESS = 0.02  # of the gap: a flat optimum for noise of .003 to .03 of full scale
STEPS = 10  # of conjugate gradients: two fewer lose .01 dB at noise .01, .04 dB at .002
REACH = 2  # PSF sides from the border beyond which the picture does not affect the gap


def periodic_shape(shape: Shape, psf_shape: Shape) -> Shape:
    """Shape that holds a picture and a gap of one PSF side less one, and transforms fast."""
    return fast_shape((shape[0] + psf_shape[0] - 1, shape[1] + psf_shape[1] - 1))


def extend(plane: FloatArray, psf: FloatArray) -> FloatArray:
    """Continue a blurred plane to a periodic one that is consistent with its blur.

    The values `u` in the gap solve ``u = [k * x]``, where `x` minimizes
    ``|k * x - y|^2 + w |D x|^2`` for the plane `y` that has `u` in its gap: a symmetric linear
    system, as for the unknown border of Reeves (2005, Fast image restoration without boundary
    artifacts, IEEE TIP 14). Only the neighborhood of the border takes part in it, so that the
    cost at 12 megapixels is that of about one transform of the whole.

    Parameters
    ----------
    plane : ndarray, shape (M, N)
        Blurred plane, any unit; not modified.
    psf : ndarray, shape (H, W)
        Point spread function, sum 1, origin at ``side // 2``.

    Returns
    -------
    ndarray, shape :func:`periodic_shape`
        `plane` at ``[:M, :N]``, in its unit and kind, and the gap behind it.
    """
    return drain(extending(plane, psf, Progress("border", 0, 1)))


def extending(plane: FloatArray, psf: FloatArray, at: Progress) -> Job[FloatArray]:
    """Job of :func:`extend`, as a part of another: reports `at` again and again."""
    extended = np.zeros(periodic_shape(plane.shape, psf.shape), dtype=plane.dtype)
    rows, columns = plane.shape
    extended[:rows, :columns] = plane
    _bridge(extended[:, :columns], rows, extended.shape[0])
    _bridge(extended.T, columns, extended.shape[1])
    yield at
    bands = _band_height(extended, rows, psf), _band_height(extended.T, columns, psf.T)
    if bands[0] < extended.shape[0] and bands[1] < extended.shape[1]:
        yield from _filling_rows(extended, plane.shape, psf, bands[0], at)
        yield from _filling_rows(extended.T, plane.shape[::-1], psf.T, bands[1], at)
    else:
        unknown = np.ones(extended.shape, dtype=bool)
        unknown[:rows, :columns] = False
        yield from _predicting(extended, unknown, psf, at)
    return extended


def _bridge(picture: FloatArray, start: int, stop: int) -> None:
    """Fill the rows from `start` to `stop` linearly, from the row before to the row after."""
    share = np.linspace(0, 1, stop - start + 2, dtype=picture.dtype)[1:-1, None]
    before, after = picture[start - 1], picture[stop % picture.shape[0]]
    picture[start:stop] = (1 - share) * before + share * after


def _band_height(extended: FloatArray, known: int, psf: FloatArray) -> int:
    """Rows of a band around the gap below row `known`, with a second gap where it is cut."""
    gap = extended.shape[0] - known
    return fast_shape((2 * REACH * psf.shape[0] + gap + psf.shape[0] - 1, 1))[0]


def _filling_rows(
    extended: FloatArray, known: Shape, psf: FloatArray, height: int, at: Progress
) -> Job[None]:
    """Job: predict the rows of the gap, below the first ``known[0]``, from a band of `height`."""
    near, gap = REACH * psf.shape[0], extended.shape[0] - known[0]
    if gap == 0:
        return
    band = np.zeros((height, extended.shape[1]), dtype=extended.dtype)
    band[:near], band[-near - gap :] = extended[:near], extended[-near - gap :]
    _bridge(band, near, height - near - gap)
    unknown = np.ones(band.shape, dtype=bool)
    unknown[:near, : known[1]] = False
    unknown[-near - gap : -gap, : known[1]] = False
    yield from _predicting(band, unknown, psf, at)
    extended[-gap:] = band[-gap:]


def _predicting(
    picture: FloatArray, unknown: BoolArray, psf: FloatArray, at: Progress
) -> Job[None]:
    """Job: solve ``u = [A y]`` for the unknown pixels, in place, by conjugate gradients.

    `A` is blur after deconvolution, ``|K|^2 / (|K|^2 + w |D|^2)``; `y` contains `u`.
    """
    smoothing = _blur_of_deblurred(psf, picture)
    yield at

    def predicted(values: FloatArray) -> FloatArray:
        return inverse(smoothing * forward(values), picture.shape) * unknown

    residual = predicted(picture) - picture * unknown
    yield at
    # what remains at single precision; a constant picture is there at once
    negligible = (1e-6 * np.linalg.norm(picture)) ** 2
    direction, energy = residual.copy(), float(np.vdot(residual, residual))
    for _ in range(STEPS):
        if energy <= negligible:
            return
        image = direction - predicted(direction)
        step = energy / float(np.vdot(direction, image))
        picture += step * direction
        residual -= step * image
        previous, energy = energy, float(np.vdot(residual, residual))
        direction *= energy / previous
        direction += residual
        yield at


def _blur_of_deblurred(psf: FloatArray, picture: FloatArray) -> FloatArray:
    smoothing = power(otf(psf, picture.shape, picture.dtype))
    rows, columns = gradient_power(picture.shape, picture.dtype)
    smoothing /= smoothing + SMOOTHNESS * (rows[:, None] + columns)
    return smoothing
