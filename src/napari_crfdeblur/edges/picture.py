"""A photo at the scale at which its edges are looked at."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._typing import FloatArray, Image
from ..arguments import check_pixels, refusal
from ..photo import ALPHA, check_image, full_scale

BAND = 32  # rows of squares that are summed at once: they fit into the caches


def check_view(image: Image) -> None:
    """Refuse what edges cannot be looked for in: no image, an empty one, one that is not finite."""
    check_image(image)
    if image.size == 0:
        raise refusal("an image with pixels", image)
    check_pixels(image)


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A photo, or the means over its squares of `step` pixels.

    Parameters
    ----------
    pixels : ndarray, shape (M // step, N // step, C) or more channels, contiguous
        The channels; what comes after them, an alpha channel, is not looked at.
    channels : int
        How many they are.
    unit : float
        Intensity in [0, 1] of the value 1 of the pixels.
    step : int
        Pixels of the photo in a row of one pixel of the picture.
    """

    pixels: Image
    channels: int
    unit: float
    step: int

    @classmethod
    def of(cls, image: Image) -> "Picture":
        """The picture of a photo, shape (M, N), (M, N, 3) or (M, N, 4), pixel by pixel."""
        # float16 is slow to reckon with.
        kind = np.float32 if image.dtype == np.float16 else image.dtype
        pixels = np.ascontiguousarray(image.reshape(*image.shape[:2], -1), dtype=kind)
        return cls(pixels, min(pixels.shape[2], ALPHA - 1), 1 / full_scale(image), 1)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the picture."""
        rows, columns = self.pixels.shape[:2]
        return rows, columns

    def planes(self) -> list[FloatArray]:
        """Each channel in [0, 1], float32, shape (M // step, N // step)."""
        unit = np.float32(self.unit)
        return [self.pixels[..., c].astype(np.float32) * unit for c in range(self.channels)]

    def middle(self, share: float) -> "Picture":
        """Its middle, a `share` of its height and width."""
        if share == 1:
            return self
        cut = [slice(round((1 - share) / 2 * n), round((1 + share) / 2 * n)) for n in self.shape]
        pixels = np.ascontiguousarray(self.pixels[cut[0], cut[1]])
        return Picture(pixels, self.channels, self.unit, self.step)

    def reduced(self, factor: int) -> "Picture":
        """The picture of the same photo with `factor` times the step."""
        if factor == 1:
            return self
        sums = block_sums(self.pixels, self.channels, factor)
        return Picture(sums, self.channels, self.unit / factor**2, self.step * factor)


def block_sums(pixels: Image, channels: int, step: int) -> FloatArray:
    """Sums over squares of `step` pixels, float32; what does not fill a square is left out."""
    rows, columns, stride = pixels.shape[0] // step, pixels.shape[1] // step, pixels.shape[2]
    lines = pixels[: rows * step, : columns * step].reshape(rows, step, -1)
    kind = kind_of_sums(pixels.dtype, step)
    sums = np.empty((rows, columns, channels), dtype=np.float32)
    for first in range(0, rows, BAND):
        band = lines[first : first + BAND]
        tall = running_sums([band[:, i] for i in range(step)], kind)
        # Of all squares, not only of those that are kept: numbers side by side add faster.
        last = tall.shape[1] - (step - 1) * stride
        wide = running_sums([tall[:, i * stride : last + i * stride] for i in range(step)], kind)
        for c in range(channels):
            sums[first : first + BAND, :, c] = wide[:, c :: step * stride]
    return sums


def running_sums(parts: list[Image], kind: np.dtype[Any]) -> Image:
    """Sum of arrays of one shape, as numbers of the given kind."""
    total: Image = np.add(parts[0], parts[1], dtype=kind)
    for part in parts[2:]:
        np.add(total, part, out=total, dtype=kind)
    return total


def kind_of_sums(kind: np.dtype[Any], step: int) -> np.dtype[Any]:
    """The smallest kind of number that holds the sum over a square of `step` pixels."""
    if kind.kind == "f":
        return np.dtype(np.float32)
    return np.min_scalar_type(np.iinfo(kind).max * step**2)
