"""How good a result is: of a response, of a PSF, of a deblurred photo."""

import numpy as np
from scipy import ndimage, signal

from . import arguments
from ._typing import BoolArray, FloatArray, Image
from .errors import CrfDeblurError
from .photo import check_image, color, luminance, to_unit
from .response import ResponseCurve

STEPS = 257  # intensities at which curves are compared


def response_error(
    curve: ResponseCurve, truth: ResponseCurve, covered: tuple[float, float] = (0.0, 1.0)
) -> float:
    """Error of an estimated response, as far as a deconvolution can notice it.

    Root mean square of ``a g(I) + b - g_true(I)`` over the covered intensities, with the
    best `a` and `b`: an affine change of the irradiance leaves a deconvolution the same.

    Parameters
    ----------
    curve, truth : ResponseCurve
        The estimate and the true response.
    covered : (float, float)
        Range of intensity over which they are compared, within [0, 1].

    Returns
    -------
    float
        In units of the true irradiance, 0 to 1.
    """
    check_curves(curve, truth)
    low, high = arguments.numbers(covered, "a range (low, high)", count=2)
    if not 0 <= low < high <= 1:
        raise ValueError(f"expected a range within [0, 1], got {low} to {high}")
    intensity = np.linspace(low, high, STEPS)
    estimate = curve.to_irradiance(intensity)
    design = np.stack([estimate, np.ones(STEPS)], axis=1)
    target = truth.to_irradiance(intensity)
    (a, b), *_ = np.linalg.lstsq(design, target, rcond=None)
    return _rms(a * estimate + b - target)


def response_error_full(curve: ResponseCurve, truth: ResponseCurve) -> tuple[float, float]:
    """Root mean square and largest error of the inverse response on [0, 1], both ends fixed.

    This counts the part of the curve that no edge has shown, too.
    """
    check_curves(curve, truth)
    intensity = np.linspace(0, 1, STEPS)
    error = curve.to_irradiance(intensity) - truth.to_irradiance(intensity)
    return _rms(error), float(np.abs(error).max())


def check_curves(*curves: ResponseCurve) -> None:
    """Raise ValueError unless these are response curves."""
    arguments.instances(curves, ResponseCurve, "a response curve")


def check_images(*images: Image) -> None:
    """Refuse what are no images of one shape, or not finite."""
    for image in images:
        check_image(image)
        arguments.check_pixels(image)
    if images[0].shape != images[1].shape:
        raise ValueError(
            f"expected images of one shape, got {images[0].shape} and {images[1].shape}"
        )


def psnr(image: Image, truth: Image, *, border: int = 16) -> float:
    """Peak signal-to-noise ratio in dB after the best shift, ``-10 log10(mean (a - b)^2)``.

    A blind deconvolution is free to shift the image together with its PSF.

    Parameters
    ----------
    image, truth : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        Photos of any kind, of one shape; alpha is ignored.
    border : int
        Pixels left out at each border; also the largest shift that is tried.

    Returns
    -------
    float
        Infinity for identical images.
    """
    image, truth = aligned(image, truth, border=border)
    error = _rms(image - truth)
    return float("inf") if error == 0 else float(-20 * np.log10(error))


def ssim(image: Image, truth: Image, *, border: int = 16) -> float:
    """Structural similarity (Wang et al. 2004) after the best shift; 1 for identical images.

    Parameters are those of :func:`psnr`; color is the mean over the channels.
    """
    from skimage.metrics import structural_similarity

    a, b = aligned(image, truth, border=border)
    # The window and the normalization of the paper.
    similarity: float = structural_similarity(
        a,
        b,
        data_range=1,
        channel_axis=2 if a.ndim == 3 else None,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
    )
    return similarity


def aligned(image: Image, truth: Image, *, border: int = 16) -> tuple[FloatArray, FloatArray]:
    """Shift an image onto the truth, to a fraction of a pixel, and crop both.

    Parameters
    ----------
    image, truth : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        Photos of any kind, of one shape; alpha is ignored.
    border : int
        Pixels left out at each border; also the largest shift that is tried.

    Returns
    -------
    tuple of ndarray, shape (M - 2 border, N - 2 border) or (..., 3)
        Intensity of the shifted image and of the truth, float64.
    """
    check_images(image, truth)
    arguments.whole(border, "a border in pixels")
    if border < 0 or min(image.shape[:2]) < 2 * border + 8:
        raise arguments.refusal(f"a border that leaves 8 pixels of {image.shape}", border)
    moving, fixed = (to_unit(color(i)).astype(np.float64) for i in (image, truth))
    if border == 0:
        return moving, fixed
    shift = _best_shift(luminance(image), luminance(truth), border)
    target = fixed[border:-border, border:-border]
    top, left = border - np.rint(shift).astype(int)
    whole = moving[top : top + target.shape[0], left : left + target.shape[1]]
    finer = _moved(moving, shift)[border:-border, border:-border]
    # Interpolation smooths; keep it only where it brings the image closer.
    return (finer if _rms(finer - target) < _rms(whole - target) else whole), target


def kernel_similarity(a: FloatArray, b: FloatArray) -> float:
    """Similarity of two PSFs: their greatest normalized cross-correlation over all shifts.

    ``max over s of sum_x a(x) b(x + s) / (|a| |b|)`` (Hu & Yang, ECCV 2012).

    Parameters
    ----------
    a, b : ndarray, shapes (H, W) and (K, L)
        PSFs of any size and scale.

    Returns
    -------
    float
        1 for the same shape, 0 for shapes that never meet.
    """
    a, b = (_scaled(arguments.kept(each, "two PSFs (H, W)", axes=(2,))) for each in (a, b))
    peak = signal.correlate(a, b, method="fft").max()
    return float(np.clip(peak / (np.linalg.norm(a) * np.linalg.norm(b)), 0, 1))


def ringing(restored: Image, blurred: Image, *, extent: int = 31) -> float:
    """How much a deblurred image oscillates across the isolated edges of its blurred one.

    Where the blurred image rises steadily from one level to another, the sharp one has a
    single step; up and down beyond it is ringing. With `n` the direction of the rise, sums
    over all windows `W` around such edges give ::

        sum (mean_W |n . grad R| - |mean_W n . grad R|) / sum |mean_W n . grad R|

    In the spirit of Liu et al. 2013, no sharp image is needed. Noise counts, too, as far as
    smoothing by 1 pixel leaves it: compare results of one photo and one amount of noise.

    Parameters
    ----------
    restored, blurred : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        The deblurred image and what it was made of, both linear or both as recorded.
    extent : int
        Extent of the PSF in pixels; the windows are twice as large.

    Returns
    -------
    float
        0 without ringing; 1 where ups and downs double the way from side to side.

    Raises
    ------
    CrfDeblurError
        No isolated edge.
    """
    check_images(restored, blurred)
    arguments.whole(extent, "an extent in pixels", least=1, most=max(1, *blurred.shape[:2]))
    window = 2 * extent + 1
    rise = _gradient(luminance(blurred))
    net, path = _window_mean(rise, window), _window_mean(np.hypot(*rise), window)
    height = np.hypot(*net)
    isolated = (height > 0.9 * path) & (height * window > 0.1)
    isolated &= _interior(height.shape, window)
    if not isolated.any():
        raise CrfDeblurError("the image has no isolated edge; choose a region around one")
    direction = net / np.maximum(height, 1e-12)
    slopes = _gradient(luminance(restored))
    # The direction varies slowly: that of the middle of a window serves all its pixels.
    across = (direction * slopes).sum(axis=0)
    step = np.abs(_window_mean(across, window))[isolated].sum()
    if step == 0:
        raise CrfDeblurError("the deblurred image is even where the blurred one has edges")
    return float(_window_mean(np.abs(across), window)[isolated].sum() / step - 1)


def _scaled(psf: FloatArray) -> FloatArray:
    """A PSF over the power of two next to its peak, so that no square leaves the floats."""
    peak = np.abs(psf).max(initial=0.0)
    if peak == 0:
        raise ValueError("expected two PSFs that are not zero, got one that is")
    return np.ldexp(psf, -int(np.frexp(peak)[1]))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _best_shift(moving: FloatArray, fixed: FloatArray, reach: int) -> FloatArray:
    """Shift (rows, columns), within `reach`, that brings `moving` closest to `fixed`."""
    whole = _whole_shift(moving, fixed, reach)
    inner = (slice(reach, -reach),) * 2
    shift = whole
    for _ in range(2):  # Gauss-Newton on the sum of squares; starts within half a pixel
        current = _moved(moving, shift)
        slopes = np.stack([np.gradient(current, axis=a)[inner].ravel() for a in (0, 1)])
        error = (current - fixed)[inner].ravel()
        step, *_ = np.linalg.lstsq(slopes @ slopes.T, slopes @ error, rcond=None)
        shift = np.clip(shift + step, whole - 1, whole + 1)
    return np.clip(shift, -reach, reach)


def _whole_shift(moving: FloatArray, fixed: FloatArray, reach: int) -> FloatArray:
    """Whole-pixel shift of least squared difference to the inner part of `fixed`."""
    level = float(fixed.mean())
    search = moving.astype(np.float64) - level
    inner = fixed[reach:-reach, reach:-reach].astype(np.float64) - level
    product = signal.correlate(search, inner, mode="valid", method="fft")
    sums = np.pad(np.cumsum(np.cumsum(search**2, axis=0), axis=1), ((1, 0), (1, 0)))
    bands = sums[inner.shape[0] :] - sums[: -inner.shape[0]]
    energy = bands[:, inner.shape[1] :] - bands[:, : -inner.shape[1]]
    best = np.unravel_index(np.argmin(energy - 2 * product), product.shape)
    return reach - np.array(best, dtype=np.float64)


def _moved(image: FloatArray, shift: FloatArray) -> FloatArray:
    """Cubic interpolation of each channel by itself."""
    if image.ndim == 3:
        channels = np.moveaxis(image, -1, 0)
        return np.stack([_moved(channel, shift) for channel in channels], axis=-1)
    moved: FloatArray = ndimage.shift(image, shift, order=3, mode="nearest")
    return moved


def _gradient(plane: FloatArray) -> FloatArray:
    """Gradient, shape (2, M, N), of the plane smoothed by 1 pixel."""
    return np.stack([ndimage.gaussian_filter(plane, 1, order=o) for o in ((1, 0), (0, 1))])


def _window_mean(values: FloatArray, window: int) -> FloatArray:
    """Mean over square windows of the last two axes."""
    mean: FloatArray = ndimage.uniform_filter(values, window, axes=(-2, -1))
    return mean


def _interior(shape: tuple[int, ...], window: int) -> BoolArray:
    """Where windows lie inside an image."""
    mask = np.zeros(shape, dtype=bool)
    mask[window // 2 : -(window // 2), window // 2 : -(window // 2)] = True
    return mask
