"""What a profile group is: profiles that share one shape once the response is undone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from .._typing import FloatArray

NAMED = {"image": "a photo", "edge": "an edge", "channel": "a channel"}


@dataclass(frozen=True, slots=True)
class ProfileSource:
    """Where a profile was taken: photo and edge by their number, channel (0 if gray)."""

    image: int
    edge: int
    channel: int

    def __post_init__(self) -> None:
        for name in ("image", "edge", "channel"):
            arguments.whole(getattr(self, name), f"the number of {NAMED[name]}", least=0)


@dataclass(frozen=True, slots=True, eq=False)
class ProfileGroup:
    """Profiles of one orientation: rows `l_j + w_j s(m)` in linear light, with one `s`.

    Kim et al. 2012, 4.1: `s` is the cumulated projection of the PSF on the normal of the
    edges. All rows are sampled in one direction and aligned by their two end points. Grouped
    by polarity, all ranges `w_j` have one sign; grouped by orientation alone they have both.

    Parameters
    ----------
    position : ndarray, shape (M,)
        Distance along the normal from the middle of the edge, in pixels, increasing.
    intensity : ndarray, shape (J, M)
        Recorded intensity in [0, 1], averaged along each edge.
    variance : ndarray, shape (J, M)
        Variance of each sample of `intensity`.
    count : ndarray, shape (J, M)
        Number of pixels averaged for each sample.
    sides : ndarray, shape (J, 2)
        Recorded intensity of the two homogeneous sides, before and after the edge.
    sides_variance : ndarray, shape (J, 2)
        Variance of `sides`.
    orientation : float
        Angle of the common normal, radians in [0, pi), as for an edge.
    polarity : int
        +1 or -1 if all rows rise or fall, 0 if the group holds both.
    sources : tuple of ProfileSource
        Origin of each row, J of them.
    """

    position: FloatArray
    intensity: FloatArray
    variance: FloatArray
    count: FloatArray
    sides: FloatArray
    sides_variance: FloatArray
    orientation: float
    polarity: int
    sources: tuple[ProfileSource, ...]

    def __post_init__(self) -> None:
        sources = arguments.instances(self.sources, ProfileSource, "a source of each profile")
        object.__setattr__(self, "sources", tuple(sources))
        arguments.number(self.orientation, "an orientation in radians")
        arguments.whole(self.polarity, "a polarity", least=-1, most=1)
        rows, samples = len(sources), np.size(arguments.array(self.position, "positions"))
        shapes = {
            "position": (samples,),
            "intensity": (rows, samples),
            "variance": (rows, samples),
            "count": (rows, samples),
            "sides": (rows, 2),
            "sides_variance": (rows, 2),
        }
        for name, shape in shapes.items():
            values = arguments.kept(getattr(self, name), name)
            object.__setattr__(self, name, values)
            if values.shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, got {values.shape}")
        if np.any(np.diff(self.position) <= 0):
            raise ValueError("expected increasing positions")
        for name in ("variance", "count", "sides_variance"):
            if np.any(getattr(self, name) < 0):
                raise ValueError(f"expected {name} of at least 0, got negative values")

    def __len__(self) -> int:
        return len(self.sources)

    def select(self, rows: ArrayLike) -> "ProfileGroup":
        """The group with only the given rows: a mask of shape (J,), or row numbers."""
        chosen = np.arange(len(self))[np.asarray(rows)]
        return replace(
            self,
            intensity=self.intensity[chosen],
            variance=self.variance[chosen],
            count=self.count[chosen],
            sides=self.sides[chosen],
            sides_variance=self.sides_variance[chosen],
            sources=tuple(self.sources[row] for row in chosen),
        )


def of_channel(groups: Sequence[ProfileGroup], channel: int) -> list[ProfileGroup]:
    """Only the profiles of one color channel; groups left empty are dropped."""
    arguments.instances(groups, ProfileGroup, "a sequence of groups of profiles")
    arguments.whole(channel, "the number of a channel", least=0)
    masks = [np.array([s.channel == channel for s in g.sources], dtype=bool) for g in groups]
    return [g.select(mask) for g, mask in zip(groups, masks, strict=True) if mask.any()]
