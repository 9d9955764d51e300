"""What an edge is: where it lies, how it is oriented, and whether it can be used."""

from dataclasses import dataclass
from enum import Enum
from math import atan2, cos, hypot, pi, sin

Point = tuple[float, float]


class EdgeStatus(Enum):
    """Whether an edge can be used; the value is the sentence that the user reads."""

    GOOD = "good"
    OUTSIDE = "too close to the border of the image for the reach of the blur"
    SHORT = "too short for its profile to be averaged"
    FAINT = "too little contrast above the noise"
    CLIPPED = "one side is clipped: recorded at the end of the intensity range"
    UNEVEN_SIDE = "one side is not homogeneous over the reach of the blur"
    NOT_MONOTONE = "the profile does not rise or fall steadily across the edge"
    CURVED = "not straight"
    VARIES = "the profile changes along the edge"
    CHANNELS_DISAGREE = "the color channels disagree about where the edge is"


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line drawn along an edge, from `start` to `end`, (row, column) pixels."""

    start: Point
    end: Point

    def __post_init__(self) -> None:
        if not hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]) > 0:
            raise ValueError(f"expected two different points, got {self.start} and {self.end}")


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle drawn over an edge: its 4 corners in order, (row, column) pixels.

    The edge is taken to cross the middle of the rectangle; whether it runs along the long or
    the short side is seen from the image.
    """

    corners: tuple[Point, Point, Point, Point]


@dataclass(frozen=True, slots=True)
class Edge:
    """A straight edge between two homogeneous areas.

    Parameters
    ----------
    start, end : (float, float)
        End points, (row, column) in pixels, pixel centers at whole numbers.
    polarity : int
        +1 if the intensity rises along :attr:`normal`, -1 if it falls, 0 if unknown.
    width : float
        Extent of the transition across the edge, in pixels; 0 if unknown.
    contrast : float
        Difference of intensity between the sides, in [0, 1]; the largest of the channels.
    status : EdgeStatus
        Whether the edge can be used, and if not, why.
    """

    start: Point
    end: Point
    polarity: int = 0
    width: float = 0.0
    contrast: float = 0.0
    status: EdgeStatus = EdgeStatus.GOOD

    @property
    def good(self) -> bool:
        """Whether the edge passed every check."""
        return self.status is EdgeStatus.GOOD

    @property
    def length(self) -> float:
        """Length in pixels."""
        return hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def orientation(self) -> float:
        """Angle of the normal in [0, pi), radians from the column axis towards the row axis."""
        along = atan2(self.end[0] - self.start[0], self.end[1] - self.start[1])
        angle = (along + pi / 2) % pi
        return 0.0 if angle >= pi else angle  # the remainder can round up to pi itself

    @property
    def normal(self) -> Point:
        """Unit vector across the edge, (row, column) = (sin, cos) of the orientation."""
        return sin(self.orientation), cos(self.orientation)
