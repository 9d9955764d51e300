"""What a photo is: its kinds, its full scale, and how numbers come back as a photo."""

from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from . import arguments
from ._typing import FloatArray, Image
from .errors import CrfDeblurError

MOST_SATURATED = 0.98  # share of a photo: what is left of it tells nothing
ALPHA = 4  # channels of RGBA
KINDS = (np.uint8, np.uint16, np.float16, np.float32, np.float64)


def full_scale(photo: Image) -> float:
    """Value that stands for intensity 1: the largest of an integer kind, 1 for floats."""
    return float(np.iinfo(photo.dtype).max) if photo.dtype.kind == "u" else 1.0


def check_photo(photo: Image) -> None:
    """Refuse what cannot be deblurred, in a sentence that says what to do.

    Parameters
    ----------
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        uint8, uint16 or float in [0, 1].

    Raises
    ------
    ValueError
        Not an image: wrong shape or kind of number.
    CrfDeblurError
        An image without content: tiny, not finite, constant or saturated throughout.
    """
    check_image(photo)
    if min(photo.shape[:2]) < 8:
        raise CrfDeblurError(
            f"the image is only {photo.shape[1]} x {photo.shape[0]} pixels; "
            "use a photo of at least 8 x 8 pixels"
        )
    low, high = check_intensities(color(photo))
    if low >= full_scale(photo) or _saturated(color(photo)) > MOST_SATURATED:
        raise CrfDeblurError("the image is saturated throughout; use a shorter exposure")
    if low == high:
        raise CrfDeblurError("the image is constant; use a photo that shows something")


def _saturated(pixels: Image) -> float:
    """Share of the values that are at the top of the range."""
    return float(np.count_nonzero(pixels >= full_scale(pixels)) / pixels.size)


def check_intensities(pixels: Image) -> tuple[float, float]:
    """The range of pixels of a photo, alpha left out; refuses what is no intensity.

    Raises
    ------
    CrfDeblurError
        No pixels at all, not finite ones, or floats outside [0, 1].
    """
    if pixels.size == 0:
        raise CrfDeblurError("the image has no pixels; choose another one")
    low, high = float(pixels.min()), float(pixels.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        raise CrfDeblurError(
            "the image has pixels that are not finite (NaN or infinity); replace them first"
        )
    if pixels.dtype.kind == "f" and not (low >= 0 and high <= 1):
        raise CrfDeblurError(
            f"the image has values from {low:.4g} to {high:.4g}; "
            "divide a floating-point image by its full scale, so that it lies in [0, 1]"
        )
    return low, high


def check_image(image: Image) -> None:
    """Raise ValueError unless this is a 2-D or color image of a kind we work with."""
    arguments.instance(image, np.ndarray, "an image as an array of numpy")
    if isinstance(image, np.ma.MaskedArray):  # whose masks most functions forget
        raise arguments.refusal("an image without a mask", image)
    if image.ndim != 2 and not (image.ndim == 3 and image.shape[2] in (3, ALPHA)):
        raise ValueError(f"expected an image (M, N), (M, N, 3) or (M, N, 4), got {image.shape}")
    _check_kind(image)


def photo_kind(dtype: DTypeLike) -> np.dtype[Any]:
    """Data type of a photo; ValueError for any but uint8, uint16 and floats."""
    try:
        kind = np.dtype(dtype)
    except (TypeError, ValueError, SyntaxError):  # numpy reads some strings as a program's
        kind = np.dtype(object)
    if dtype is None or kind not in KINDS:
        raise arguments.refusal("a photo of uint8, uint16 or float", dtype)
    return kind


def _check_kind(image: Image) -> None:
    if image.dtype not in KINDS:
        raise ValueError(f"expected an image of uint8, uint16 or float, got {image.dtype}")


def color(photo: Image) -> Image:
    """The photo without its alpha channel, as a view."""
    return photo[..., :3] if photo.ndim == 3 else photo


def planes(photo: Image) -> list[Image]:
    """Channels of the photo, alpha left out: 1 or 3 views of shape (M, N)."""
    return [photo] if photo.ndim == 2 else [photo[..., c] for c in range(3)]


def little_endian(pixels: Image) -> memoryview:
    """The bytes of all values in the order of reading, for a checksum that is the same anywhere."""
    little = np.ascontiguousarray(pixels, dtype=pixels.dtype.newbyteorder("<"))
    return memoryview(little).cast("B")


def to_unit(photo: Image) -> FloatArray:
    """Intensity in [0, 1], float32 unless the photo is float64; the shape of `photo`."""
    _check_kind(arguments.instance(photo, np.ndarray, "a photo as an array of numpy"))
    arguments.check_pixels(photo)
    if photo.dtype.kind == "f":
        return photo.astype(np.float32 if photo.dtype != np.float64 else np.float64, copy=False)
    return np.multiply(photo, np.float32(1 / full_scale(photo)), dtype=np.float32)


def from_unit(intensity: FloatArray, dtype: DTypeLike) -> Image:
    """Intensity as a photo of kind `dtype`: clipped to [0, 1], scaled and rounded."""
    dtype = photo_kind(dtype)
    intensity = arguments.array(intensity, "intensity as an array of floats", kinds=("float",))
    if np.isnan(intensity).any():
        raise CrfDeblurError("the image has pixels that are not a number (NaN); replace them first")
    clipped = np.asarray(np.clip(intensity, 0, 1))
    if dtype.kind == "f":
        return clipped.astype(dtype, copy=False)
    if clipped.dtype == np.float16:  # which does not hold 65535
        clipped = clipped.astype(np.float32)
    clipped *= np.iinfo(dtype).max
    return np.rint(clipped, out=clipped).astype(dtype)


def luminance(photo: Image) -> FloatArray:
    """Mean of the color channels as intensity in [0, 1], shape (M, N), float32."""
    if photo.ndim == 2:
        return to_unit(photo).astype(np.float32, copy=False)
    total = np.zeros(photo.shape[:2], dtype=np.float32)
    for plane in planes(photo):
        total += to_unit(plane)
    return np.multiply(total, np.float32(1 / 3), out=total)
