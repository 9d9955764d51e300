"""A camera that turns while it takes a photo: blur that varies across the picture."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from .. import arguments
from .._typing import FloatArray
from ..psf.shapes import LARGEST, render, shake_path
from .scenes import checked_shape

# Poses for each pixel that the farthest corner moves: linear interpolation between two poses
# is then off by an eighth of a pixel at most.
DENSITY = 4


@dataclass(frozen=True, slots=True, eq=False)
class CameraMotion:
    """Shifts of the picture, and turns about its middle, each for an equal time.

    The light that would fall on ``x`` falls on ``c + R(turn) (x - c) + shift``, `c` the middle
    of the picture; the blurred picture is the mean over all poses (Whyte, Sivic, Zisserman &
    Ponce 2012, Non-uniform deblurring for shaken images, Eq. 4, for turns about the optical
    axis, and with shifts in place of the small turns about the others).

    Parameters
    ----------
    shifts : ndarray, shape (T, 2)
        Rows and columns, pixels.
    turns : ndarray, shape (T,)
        Radians from the column axis towards the row axis.
    """

    shifts: FloatArray
    turns: FloatArray

    def __post_init__(self) -> None:
        shifts = arguments.kept(self.shifts, "shifts (T, 2)", axes=(2,))
        turns = arguments.kept(self.turns, "turns (T,)", axes=(1,))
        if turns.ndim != 1 or turns.size == 0 or shifts.shape != (turns.size, 2):
            raise ValueError(
                f"expected as many shifts (T, 2) as turns (T,), got {shifts.shape}, {turns.shape}"
            )
        if np.abs(shifts).max() > LARGEST or np.abs(turns).max() > 2 * np.pi:
            raise ValueError(
                f"expected shifts of at most {LARGEST} pixels and turns of at most 2 pi"
            )
        object.__setattr__(self, "shifts", shifts)
        object.__setattr__(self, "turns", turns)

    def path(self, offset: tuple[float, float]) -> FloatArray:
        """Where the light goes that belongs `offset` pixels from the middle, shape (T, 2).

        Relative to that place, (row, column).
        """
        row, column = offset
        cosine, sine = np.cos(self.turns) - 1, np.sin(self.turns)
        moved = [cosine * row + sine * column, cosine * column - sine * row]
        return np.asarray(self.shifts + np.stack(moved, axis=1))

    def psf_at(self, offset: tuple[float, float]) -> FloatArray:
        """The PSF `offset` pixels from the middle: centroid on the center pixel, sides odd."""
        return render(self.path(offset), np.ones(len(self.turns)))

    def reach(self, shape: tuple[int, ...]) -> tuple[int, int]:
        """Rows and columns at the borders of a picture that light from outside can touch."""
        corners = [(y * shape[0] / 2, x * shape[1] / 2) for y in (-1, 1) for x in (-1, 1)]
        farthest = np.max([np.abs(self.path(corner)).max(axis=0) for corner in corners], axis=0)
        rows, columns = np.ceil(farthest).astype(int).tolist()
        return rows, columns

    def reach_for(self, inner: tuple[int, int]) -> tuple[int, int]:
        """The reach in a picture of which `inner` rows and columns remain without it."""
        reach = self.reach(inner)
        while self.reach((inner[0] + 2 * reach[0], inner[1] + 2 * reach[1])) != reach:
            reach = self.reach((inner[0] + 2 * reach[0], inner[1] + 2 * reach[1]))
        return reach

    def blurred(self, linear: FloatArray) -> FloatArray:
        """Mean of a picture over all poses; wrong within :meth:`reach` of its borders.

        Parameters
        ----------
        linear : ndarray, shape (M, N) or (M, N, 3)
            float32, sampled linearly.
        """
        total = np.zeros_like(linear)
        for shift, turn in zip(self.shifts, self.turns, strict=True):
            # what falls on a pixel came from where the opposite turn leads
            back = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
            middle = (np.array(linear.shape[:2]) - 1) / 2
            start = middle - back @ (middle + shift)
            for channel in np.ndindex(linear.shape[2:]):
                plane = linear[:, :, *channel]
                total[:, :, *channel] += ndimage.affine_transform(
                    plane, back, start, order=1, mode="nearest"
                )
        return np.asarray(np.clip(total / np.float32(len(self.turns)), 0, 1))


def camera_turn(size: int, turn: float, seed: int, shape: tuple[int, int]) -> CameraMotion:
    """A shake of the camera, and a turn of varying speed at the same time.

    Parameters
    ----------
    size : int
        Extent in pixels of the PSF in the middle, odd, at least 3; as of
        :func:`~napari_crfdeblur.psf.camera_shake`.
    turn : float
        Radians from the first pose to the last.
    seed : int
        Of the shake; the same seed gives the same motion.
    shape : (M, N)
        Of the picture: how finely the motion has to be sampled.
    """
    arguments.odd(size, "size", most=LARGEST)
    arguments.number(turn, "a turn in radians", least=-2 * np.pi, most=2 * np.pi)
    arguments.whole(seed, "a seed", least=0)
    shape = checked_shape(shape)
    random = np.random.default_rng([seed, 1])
    farthest = abs(turn) * np.hypot(*shape) / 2 + 2 * size
    count = max(int(DENSITY * farthest), 2)
    speed = 1 + 0.8 * np.sin(2 * np.pi * (np.linspace(0, 1, count) + random.random()))
    angle = np.cumsum(speed) / speed.sum()
    return CameraMotion(shake_path(size, seed, count), turn * (angle - angle.mean()))
