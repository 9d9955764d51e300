"""What an edge is: where it lies, how it is oriented, and whether it can be used."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from math import atan2, cos, hypot, pi, sin

from .. import arguments

Point = tuple[float, float]
FAR = 10  # diagonals of a picture
FARTHEST = 1e9  # pixels from the origin: no picture is larger, and squares stay finite


def point(place: Point) -> Point:
    """A place, checked to be two finite numbers of pixels."""
    row, column = arguments.numbers(
        place, "a point (row, column)", count=2, least=-FARTHEST, most=FARTHEST
    )
    return row, column


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
        object.__setattr__(self, "start", point(self.start))
        object.__setattr__(self, "end", point(self.end))
        if not hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]) > 0:
            raise ValueError(f"expected two different points, got {self.start} and {self.end}")


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle drawn over an edge: its 4 corners in order, (row, column) pixels.

    The edge is taken to cross the middle of the rectangle; whether it runs along the long or
    the short side is seen from the image.
    """

    corners: tuple[Point, Point, Point, Point]

    def __post_init__(self) -> None:
        what = "4 corners (row, column)"
        corners = arguments.array(self.corners, what, axes=(2,), finite=True)
        if corners.shape != (4, 2):
            raise arguments.refusal(what, corners)
        object.__setattr__(self, "corners", tuple(map(point, corners.tolist())))


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

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", point(self.start))
        object.__setattr__(self, "end", point(self.end))
        arguments.whole(self.polarity, "a polarity", least=-1, most=1)
        arguments.number(self.width, "a width in pixels", least=0)
        arguments.number(self.contrast, "a contrast", least=0)
        arguments.instance(self.status, EdgeStatus, "a status of an edge")

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


def check_near(shape: tuple[int, ...], points: Iterable[Point]) -> None:
    """Refuse points that lie so far outside of a picture that no line to them is meant.

    What is looked at around a line grows with its length.

    Parameters
    ----------
    shape : (M, N) or (M, N, C)
        Of the picture.
    points : iterable of (float, float)
        Of lines, edges or rectangles.
    """
    beyond = FAR * hypot(*shape[:2])
    for place in points:
        if any(not -beyond <= x <= side + beyond for x, side in zip(place, shape, strict=False)):
            raise ValueError(
                f"expected lines within or near a photo of {shape[0]} rows and {shape[1]} "
                f"columns, got the point {place}"
            )
