"""PSFs that differ from place to place: the result of a search in every part of a picture."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from numbers import Integral
from types import NoneType

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...fourier import Shape
from ..status import PsfStatus
from .poses import Poses

TURNING = 12**0.5  # standard deviations from the first turn to the last, if all are as likely
LARGEST = 1e6  # value of a PSF: there are some that were never scaled
FAR = 1e6  # pixels: wider than any picture


@dataclass(frozen=True, slots=True, eq=False)
class PsfField:
    """The PSFs of all parts of a picture, on a grid.

    Parameters
    ----------
    psfs : ndarray, shape (R, C, H, W)
        One for each part: R rows of C parts of equal size, which are the picture. Each is
        non-negative, of sum 1; H and W are odd, and the center pixel is the origin.
    statuses : tuple of tuple of PsfStatus
        How far each can be trusted, R x C.
    shape : (M, N)
        Of the picture, pixels.
    poses : Poses, optional
        The motion of the camera that they follow from; it tells the PSF between the parts,
        too. Without it, PSFs are interpolated.
    diagnostics : dict of str to float
        Figures of the search, by name.
    """

    psfs: FloatArray
    statuses: tuple[tuple[PsfStatus, ...], ...]
    shape: tuple[int, int]
    poses: Poses | None = None
    diagnostics: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        psfs = arguments.kept(self.psfs, "PSFs (R, C, H, W)")
        if psfs.ndim != 4 or psfs.size == 0 or not all(side % 2 for side in psfs.shape[2:]):
            raise ValueError(f"expected PSFs (R, C, H, W) with odd H and W, got {psfs.shape}")
        for row in arguments.instances(self.statuses, Sequence, "rows of statuses"):
            arguments.instances(row, PsfStatus, "statuses of PSFs")
        if [len(row) for row in self.statuses] != [psfs.shape[1]] * psfs.shape[0]:
            raise ValueError(f"expected a status for each of the {psfs.shape[:2]} PSFs")
        if psfs.min() < 0 or psfs.max() > LARGEST or not psfs.any(axis=(2, 3)).all():
            raise ValueError("expected PSFs that are not negative, each of sum 1")
        for side in arguments.instances(self.shape, Integral, "the shape (M, N) of a picture"):
            arguments.whole(side, "a side of a picture", least=1)
        if len(self.shape) != 2:
            raise arguments.refusal("the shape (M, N) of a picture", self.shape)
        arguments.instance(self.poses, (Poses, NoneType), "poses of the camera or None")
        arguments.instance(self.diagnostics, dict, "figures by their names")
        object.__setattr__(self, "psfs", psfs)

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns of parts."""
        return self.psfs.shape[0], self.psfs.shape[1]

    @property
    def centers(self) -> FloatArray:
        """Middles of the parts, shape (R, C, 2), in (row, column) pixels."""
        return part_centers(self.shape, self.grid)

    @property
    def spread(self) -> float:
        """How much the PSFs differ: 1 minus the mean cosine between each and their mean."""
        flat = self.psfs.reshape(-1, self.psfs.shape[2] * self.psfs.shape[3])
        mean = flat.mean(axis=0)
        cosines = flat @ mean / (np.linalg.norm(flat, axis=1) * np.linalg.norm(mean))
        return float(1 - cosines.mean())

    @property
    def pace(self) -> tuple[float, float]:
        """Rows and columns over which the ends of the PSF move by about a pixel."""
        if self.poses is not None:
            length = 1 / max(TURNING * self.poses.spread, 1 / FAR)
            return length, length
        rows, columns = (s / (2 * n) for s, n in zip(self.shape, self.grid, strict=True))
        return (rows if self.grid[0] > 1 else FAR), (columns if self.grid[1] > 1 else FAR)

    def at(self, row: float, column: float) -> FloatArray:
        """The PSF at a place of the picture, shape (H, W)."""
        if self.poses is not None:
            return self.poses.psf_at(offset_from_middle((row, column), self.shape))
        places = [
            _between(position, side, count)
            for position, side, count in zip((row, column), self.shape, self.grid, strict=True)
        ]
        (top, down), (left, right) = places
        rows = [
            (1 - right) * self.psfs[r, left] + right * self.psfs[r, min(left + 1, self.grid[1] - 1)]
            for r in (top, min(top + 1, self.grid[0] - 1))
        ]
        return np.asarray((1 - down) * rows[0] + down * rows[1])

    def picture(self) -> FloatArray:
        """All PSFs side by side, each scaled to its peak, with a line of zeros between them.

        Shape ``(R (H + 1) - 1, C (W + 1) - 1)``, in [0, 1].
        """
        rows, columns = self.grid
        height, width = self.psfs.shape[2:]
        peaks = self.psfs.max(axis=(2, 3), keepdims=True)
        framed = np.pad(self.psfs / peaks, [(0, 0), (0, 0), (0, 1), (0, 1)])
        sheet = framed.swapaxes(1, 2).reshape(rows * (height + 1), columns * (width + 1))
        return sheet[:-1, :-1]


def part_centers(shape: Shape, grid: tuple[int, int]) -> FloatArray:
    """Middles of the equal parts of a picture, shape (R, C, 2)."""
    axes = [
        (np.arange(count) + 0.5) * side / count - 0.5
        for side, count in zip(shape, grid, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def offset_from_middle(place: tuple[float, float], shape: Shape) -> tuple[float, float]:
    """Rows and columns from the middle of a picture to a place."""
    return place[0] - (shape[0] - 1) / 2, place[1] - (shape[1] - 1) / 2


def _between(position: float, side: int, count: int) -> tuple[int, float]:
    """Number of the part whose middle comes before a position, and how far it is beyond."""
    place = float(np.clip((position + 0.5) * count / side - 0.5, 0, count - 1))
    before = min(int(place), max(count - 2, 0))
    return before, place - before
