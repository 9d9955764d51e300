"""A photo made small, in linear and in compressed light, and PSFs at its scale."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..._typing import BoolArray, FloatArray
from .blurred import Blurred
from .colors import gray_of
from .overview import Overview
from .pyramid import scaled

WIDEST = 512  # pixels of a side of a small photo, at most, or three PSFs
LEAST_LOST = 0.02  # of a pixel of a small photo that was clipped
COMPRESSED = np.float32(1 / 2.2)  # power of light: dark places count as in a photo as recorded


@dataclass(frozen=True, slots=True, eq=False)
class SmallPhoto:
    """A photo made small, in two lights: all of it, or the square that tells most.

    Parameters
    ----------
    linear, compressed : Blurred
        In linear and in compressed light.
    """

    linear: Blurred
    compressed: Blurred

    @classmethod
    def of(
        cls, light: FloatArray, clipped: BoolArray | None, scale: float, size: int
    ) -> "SmallPhoto":
        """Of linear light (M, N) or (M, N, 3), for PSFs of about `size` pixels at this scale."""
        small, lost = _told_most(*_made_small(light, clipped, scale), size)
        compressed = np.maximum(small, 0) ** COMPRESSED
        return cls(_blurred(small, lost, size), _blurred(compressed, lost, size))

    def in_light(self, *, compressed: bool) -> Blurred:
        """All of it in one of the lights: clipped light misleads, but without it less is found."""
        return Blurred((self.compressed if compressed else self.linear).plane)


def psf_scaled(psf: FloatArray, scale: float) -> FloatArray:
    """A PSF as it is in a picture of other sides; sum 1, odd sides, its center in place."""
    if scale == 1:
        return psf
    softness = max(1 / scale - 1, 0) / 2
    wide = np.pad(psf, int(np.ceil(4 * softness)) + 1)
    sides = [int(np.ceil(side * scale)) // 2 * 2 + 1 for side in wide.shape]
    middle = [(old // 2) - (new // 2) / scale for old, new in zip(wide.shape, sides, strict=True)]
    soft = ndimage.gaussian_filter(wide, softness)
    resampled = ndimage.affine_transform(
        soft, np.full(2, 1 / scale), middle, output_shape=tuple(sides), order=1
    )
    return np.asarray(resampled / resampled.sum())


def _made_small(
    light: FloatArray, clipped: BoolArray | None, scale: float
) -> tuple[FloatArray, BoolArray | None]:
    """Light, and where any of it was clipped, at a scale."""
    if scale == 1:
        return light, clipped
    planes = light[..., None] if light.ndim == 2 else light
    small = np.stack([scaled(planes[..., c], scale) for c in range(planes.shape[2])], axis=2)
    lost = None
    if clipped is not None:
        lost = scaled(clipped.astype(np.float32), scale) > LEAST_LOST
    return small.reshape(*small.shape[:2], *light.shape[2:]), lost


def _told_most(
    light: FloatArray, clipped: BoolArray | None, size: int
) -> tuple[FloatArray, BoolArray | None]:
    """The square of at most `WIDEST` pixels that tells most of a PSF."""
    overview = Overview.of(gray_of(light)[0], clipped)
    part = overview.informative_region(max(WIDEST, 3 * size), size)
    return light[part], None if clipped is None else clipped[part]


def _blurred(light: FloatArray, clipped: BoolArray | None, size: int) -> Blurred:
    gray, _ = gray_of(light)
    return Blurred.of(gray, clipped, size)
