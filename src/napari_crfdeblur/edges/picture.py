"""A photo at the scale at which its edges are looked at."""

from dataclasses import dataclass

import numpy as np

from .._typing import FloatArray, Image
from ..photo import full_scale, planes


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A photo, or the means over its squares of `step` pixels.

    Parameters
    ----------
    planes : tuple of ndarray, each of shape (M // step, N // step)
        The channels, alpha left out.
    unit : float
        Intensity in [0, 1] of the value 1 of the planes.
    step : int
        Pixels of the photo in a row of one pixel of the picture.
    """

    planes: tuple[Image, ...]
    unit: float
    step: int

    @classmethod
    def of(cls, image: Image) -> "Picture":
        """The picture of a photo, shape (M, N), (M, N, 3) or (M, N, 4), pixel by pixel."""
        # Interpolation takes every kind of number but float16.
        kind = np.float32 if image.dtype == np.float16 else image.dtype
        kept = tuple(plane.astype(kind, copy=False) for plane in planes(image))
        return cls(kept, 1 / full_scale(image), 1)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the picture."""
        rows, columns = self.planes[0].shape
        return rows, columns

    def intensity(self) -> FloatArray:
        """All of it in [0, 1], float32, shape (M // step, N // step, C)."""
        unit = np.float32(self.unit)
        return np.stack([plane.astype(np.float32) * unit for plane in self.planes], axis=-1)

    def middle(self, share: float) -> "Picture":
        """Its middle, a `share` of its height and width."""
        if share == 1:
            return self
        cut = [slice(round((1 - share) / 2 * n), round((1 + share) / 2 * n)) for n in self.shape]
        return Picture(tuple(plane[cut[0], cut[1]] for plane in self.planes), self.unit, self.step)

    def reduced(self, factor: int) -> "Picture":
        """The picture of the same photo with `factor` times the step."""
        if factor == 1:
            return self
        sums = tuple(block_sums(plane, factor) for plane in self.planes)
        return Picture(sums, self.unit / factor**2, self.step * factor)


def block_sums(plane: Image, step: int) -> FloatArray:
    """Sums over squares of `step` pixels, float32; what does not fill a square is left out."""
    rows, columns = plane.shape[0] // step, plane.shape[1] // step
    plane = plane[: rows * step, : columns * step]
    # Whole rows first, in a kind that holds the sum: one pass through the photo.
    wide = {"u1": np.uint16, "u2": np.uint32}.get(plane.dtype.str[1:], np.float32)
    tall: Image = plane[::step].astype(wide)
    for i in range(1, step):
        tall += plane[i::step].astype(wide, copy=False)
    total = tall[:, ::step].astype(np.float32)
    for i in range(1, step):
        total += tall[:, i::step]
    return total
