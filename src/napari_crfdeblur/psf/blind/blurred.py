"""What a blind estimator looks at: a blurred plane, and which of its gradients can be used."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ..._typing import BoolArray, FloatArray
from .edge_prediction import gradient
from .overview import Overview
from .pyramid import scaled, step_contrast

LEAST_USABLE = 0.25  # of the gradients: what is left of fewer tells no PSF


@dataclass(frozen=True, slots=True, eq=False)
class Blurred:
    """A blurred plane with the gradients that obey ``B = k * E``.

    Light that the camera clipped is not a convolution any more, and neither is what lies within
    the reach of the PSF around it: its sharp edges cannot be predicted.

    Parameters
    ----------
    plane : ndarray, shape (M, N)
        float32, of contrast about 1; clipped pixels hold what was recorded.
    usable : ndarray, shape (M, N), optional
        float32 in [0, 1], how far the gradient of each pixel counts; by default all do.
    """

    plane: FloatArray
    usable: FloatArray | None = None

    @classmethod
    def of(cls, light: FloatArray, clipped: BoolArray | None, size: int) -> "Blurred":
        """Scale a plane to contrast 1, and leave out what clipping spoils.

        Parameters
        ----------
        light : ndarray, shape (M, N)
            Relative irradiance.
        clipped : ndarray of bool, shape (M, N), optional
            Pixels that the camera saturated.
        size : int
            Extent of the PSF in pixels: half of it is left out around clipped pixels, or only
            their own gradients where hardly anything would remain, as around text on white.

        Raises
        ------
        CrfDeblurError
            No contrast but noise.
        """
        plane = np.asarray(light / np.float32(step_contrast(light)), dtype=np.float32)
        return cls(plane, None if clipped is None else _usable(plane, clipped, size))

    def gradient(self) -> FloatArray:
        """Gradient of the blurred plane, shape (2, M, N), 0 where it cannot be used."""
        return self.kept(gradient(self.plane))

    def kept(self, gradients: FloatArray) -> FloatArray:
        """Gradients of shape (2, M, N), such as predicted ones, 0 where they cannot be used."""
        return gradients if self.usable is None else gradients * self.usable

    def scaled(self, scale: float) -> "Blurred":
        """The same at `scale` times its sides."""
        if scale == 1:
            return self
        usable = None if self.usable is None else scaled(self.usable, scale)
        return Blurred(scaled(self.plane, scale), usable)

    def within(self, side: int, size: int) -> "Blurred":
        """The square of at most `side` pixels that tells most of a PSF of `size` pixels."""
        lost = None if self.usable is None else self.usable < LEAST_USABLE
        part = Overview.of(self.plane, lost).informative_region(max(side, 3 * size), size)
        return Blurred(self.plane[part], None if self.usable is None else self.usable[part])


def _usable(plane: FloatArray, clipped: BoolArray, size: int) -> FloatArray | None:
    """Where gradients count; None if nothing is clipped, or too much for a choice."""
    if not clipped.any():
        return None
    strength = np.abs(gradient(plane)).sum(axis=0)
    for reach in (size | 1, 3):  # a gradient takes the next pixel, too
        usable = ~ndimage.maximum_filter(clipped, reach)
        if strength[usable].sum() >= LEAST_USABLE * strength.sum():
            return np.asarray(usable, dtype=np.float32)
    return None
