"""A PSF drawn by hand: the path on which the camera moved."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...progress import Job
from ..base import Evidence, PsfEstimate, PsfEstimator
from ..given import GivenPsf
from ..shapes import DENSITY, LARGEST, render
from .beads import as_places

ACROSS = 4  # points for each pixel of the width: bilinear drawing makes them even
MOST_POINTS = 100_000  # of a path: more than any hand draws


@dataclass(frozen=True, slots=True)
class MotionPath(PsfEstimator):
    """The PSF of a motion along a path, at an even speed.

    ``k(u) = 1 / L`` along the polyline through the points, `L` long, spread over a disk of the
    width. Where it lies in the picture does not matter: its middle becomes the origin.

    Parameters
    ----------
    points : sequence of (row, column)
        Corners of the path in pixels, in order; at least two places that differ.
    width : float
        Of the line in pixels; 0 is as thin as pixels permit.
    """

    needs_picture: ClassVar[bool] = False

    points: tuple[tuple[float, float], ...]
    width: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", as_places(self.points, "points (row, column)"))
        arguments.number(self.width, "a width in pixels", least=0, most=LARGEST)
        if len(self.points) > MOST_POINTS:
            raise arguments.refusal(f"at most {MOST_POINTS} points of a path", self.points)
        if len({*self.points}) < 2:
            raise CrfDeblurError(
                "a path of motion needs two points at least; draw it from where the motion "
                "begins to where it ends"
            )
        if np.ptp(np.array(self.points), axis=0).max() + self.width > LARGEST:
            raise CrfDeblurError(
                f"the path is longer than {LARGEST} pixels, the largest PSF; draw a shorter one"
            )

    @property
    def psf(self) -> FloatArray:
        """The path drawn, shape (H, W): non-negative, sum 1, centered."""
        path = _even(np.array(self.points))
        spots = _disk(self.width)
        whole = (path[:, np.newaxis] + spots).reshape(-1, 2)
        return render(whole, np.ones(len(whole)))

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: hand out the PSF; an image that is smaller than it is refused."""
        return (yield from GivenPsf(self.psf).run(evidence))


def _even(corners: FloatArray) -> FloatArray:
    """Points at even distances along a polyline."""
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    reached = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(int(np.ceil(reached[-1] * DENSITY / 4)), 2)
    along = (np.arange(count) + 0.5) / count * reached[-1]
    return np.stack([np.interp(along, reached, axis) for axis in corners.T], axis=1)


def _disk(width: float) -> FloatArray:
    """Points all over a disk of this diameter."""
    half = int(np.ceil(width * ACROSS / 2))
    grid = np.arange(-half, half + 1) / ACROSS
    spots = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
    inside: FloatArray = spots[np.hypot(*spots.T) <= width / 2]
    return inside
