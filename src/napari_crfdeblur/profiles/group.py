"""Which edges belong together: those that see the same projection of the PSF."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import pi, radians

import numpy as np

from .. import arguments
from .._typing import FloatArray
from .base import ProfileGroup

UNKNOWN = 1e-300  # weight beside which any other is all


class Grouping(ABC):
    """A rule by which profiles are put together in one group.

    Two edges whose normals differ by an angle `a` see, of a PSF of extent `e`, projections
    that differ by up to ``a e / 2`` pixels: 3 degrees are half a pixel at 20.

    Attributes
    ----------
    tolerance : float
        Largest angle between an edge and the orientation of its group, radians.
    """

    tolerance: float

    @abstractmethod
    def split(self, group: ProfileGroup) -> list[ProfileGroup]:
        """Groups into which all profiles of one orientation are divided."""


@dataclass(frozen=True, slots=True)
class ByOrientation(Grouping):
    """One group for each orientation, with rising and falling profiles together.

    Sampled in one direction, both have the same shape, the falling ones with a negative
    range: together they say more about the response than apart.
    """

    tolerance: float = field(default=radians(3))

    def __post_init__(self) -> None:
        check_tolerance(self.tolerance)

    def split(self, group: ProfileGroup) -> list[ProfileGroup]:
        """The group itself."""
        return [group]


@dataclass(frozen=True, slots=True)
class ByPolarity(Grouping):
    """Rising and falling profiles apart, as in Kim et al. 2012, 4.1."""

    tolerance: float = field(default=radians(3))

    def __post_init__(self) -> None:
        check_tolerance(self.tolerance)

    def split(self, group: ProfileGroup) -> list[ProfileGroup]:
        """The rising and the falling profiles; a side without any is left out."""
        rises = group.sides[:, 1] > group.sides[:, 0]
        return [
            replace(group.select(rows), polarity=sign)
            for rows, sign in ((rises, 1), (~rises, -1))
            if rows.any()
        ]


@dataclass(frozen=True, slots=True)
class ByEdge(Grouping):
    """Each edge by itself: its color channels are the rows of one group.

    Channels of one edge need no alignment with each other and see the very same blur. An edge
    between two colors spans a different range in each channel; a gray edge tells nothing.
    """

    tolerance: float = field(default=radians(3))

    def __post_init__(self) -> None:
        check_tolerance(self.tolerance)

    def split(self, group: ProfileGroup) -> list[ProfileGroup]:
        """A group for each edge."""
        edges = np.array([(source.image, source.edge) for source in group.sources])
        distinct, number = np.unique(edges, axis=0, return_inverse=True)
        groups = [group.select(number.ravel() == edge) for edge in range(len(distinct))]
        return [replace(g, polarity=common_polarity(g)) for g in groups]


def common_polarity(group: ProfileGroup) -> int:
    """+1 if all profiles rise, -1 if all fall, 0 if there are both."""
    rises = group.sides[:, 1] > group.sides[:, 0]
    return 1 if rises.all() else -1 if not rises.any() else 0


def check_tolerance(tolerance: float) -> None:
    """Raise ValueError unless the angle is positive and less than a right angle."""
    arguments.number(tolerance, "a tolerance in radians", above=0, below=pi / 2)


@dataclass(frozen=True, slots=True)
class OrientationCluster:
    """Edges of one orientation: its angle in [0, pi), the members by number."""

    orientation: float
    members: tuple[int, ...]


def cluster(
    orientations: Sequence[float], weights: Sequence[float], tolerance: float
) -> list[OrientationCluster]:
    """Put orientations together, the heaviest window of twice the tolerance first.

    Angles are compared modulo pi: 179.5 and 0.5 degrees are one degree apart.
    """
    angle = np.asarray(orientations, dtype=float)
    # what weighs nothing, such as an edge of unknown contrast, has an orientation all the same
    weight = np.maximum(np.asarray(weights, dtype=float), UNKNOWN)
    left = np.arange(len(angle))
    found = []
    while len(left):
        near = orientation_difference(angle[left][:, None], angle[left]) <= tolerance
        best = int((near * weight[left]).sum(axis=1).argmax())
        members = left[near[best]]
        mean = circular_mean(angle[members], weight[members])
        # Only those that are also near the mean, so that the tolerance means what it says; of
        # orientations all around there may be none.
        if not np.any(orientation_difference(angle[members], mean) <= tolerance):
            members, mean = left[[best]], float(angle[left[best]])
        members = members[orientation_difference(angle[members], mean) <= tolerance]
        found.append(OrientationCluster(mean, tuple(int(i) for i in members)))
        left = np.setdiff1d(left, members)
    return found


def orientation_difference(a: FloatArray, b: FloatArray | float) -> FloatArray:
    """Angle between two orientations, in [0, pi/2]."""
    return np.asarray(np.abs((a - b + pi / 2) % pi - pi / 2))


def circular_mean(angle: FloatArray, weight: FloatArray) -> float:
    """Weighted mean orientation in [0, pi), from the mean of the doubled angles."""
    mean = float(np.angle((weight * np.exp(2j * angle)).sum()) / 2) % pi
    return 0.0 if mean >= pi else mean  # the remainder can round up to pi itself
