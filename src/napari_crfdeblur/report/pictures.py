"""Photos, the edges on them, and PSFs, drawn on axes."""

from collections import Counter
from collections.abc import Sequence
from math import degrees
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from .._typing import FloatArray, Image
from ..edges import Edge
from ..photo import color, luminance, to_unit
from ..profiles import ProfileGroup
from .colors import GROUPS, INK, OTHERS, PALE, REJECTED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LONGEST = 1000  # pixels of a photo as shown: more than a printed page resolves
DETAIL = (80, 200)  # rows and columns of a detail, large enough on paper to see its pixels


def reduced(photo: Image, longest: int = LONGEST) -> tuple[FloatArray, int]:
    """A photo small enough to be shown: float32 in [0, 1], means of square blocks.

    Returns
    -------
    tuple of ndarray, shape (M // k, N // k) or (M // k, N // k, 3), and int
        The small photo, without alpha, and the side `k` of its blocks in pixels.
    """
    k = -(-max(photo.shape[:2]) // longest)
    k = min(k, *photo.shape[:2])
    rows, columns = (side // k * k for side in photo.shape[:2])
    total = np.zeros((rows // k, columns // k, *color(photo).shape[2:]), dtype=np.float32)
    # One pixel of every block at a time, so that no copy of the whole photo is made.
    for i, j in np.ndindex(k, k):
        total += to_unit(color(photo)[i:rows:k, j:columns:k])
    return np.clip(total / k**2, 0, 1), k


def draw_photo(ax: "Axes", photo: Image) -> None:
    """Draw a photo, reduced if it is large; the axes count its full pixels."""
    small, k = reduced(photo)
    height, width = photo.shape[:2]
    shown = (-0.5, small.shape[1] * k - 0.5, small.shape[0] * k - 0.5, -0.5)
    ax.imshow(small, extent=shown, cmap="gray", vmin=0, vmax=1, interpolation="nearest")
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xticks=[], yticks=[])
    frame(ax)


def draw_edges(ax: "Axes", edges: Sequence[Edge], groups: Sequence[ProfileGroup] = ()) -> None:
    """Draw edges over their photo, those of one group in one colour, rejected ones thin.

    The lines are labelled for a legend: how many edges at which angle, how many rejected
    for which reason.

    Parameters
    ----------
    ax : Axes
        Shows the photo in (column, row) pixels.
    edges : sequence of Edge
        Edges of the photo.
    groups : sequence of ProfileGroup
        Profiles across the edges; those of image 0 tell which edge is in which group.
    """
    used: set[int] = set()
    members = [_edges_of(group, len(edges)) - used for group in groups]
    distinct = [(group, own) for group, own in zip(groups, members, strict=True) if own]
    for (group, own), shade in zip(distinct, GROUPS, strict=False):
        _lines(ax, [edges[i] for i in own - used], shade, f"at {_angle(group)}")
        used |= own
    rest = [e for i, e in enumerate(edges) if e.good and i not in used]
    _lines(ax, rest, OTHERS, "at other angles" if used else "good")
    rejected = Counter(edge.status for edge in edges if not edge.good)
    for status, _ in rejected.most_common():
        faulty = [edge for edge in edges if edge.status is status]
        _lines(ax, faulty, REJECTED, f"rejected: {status.value}", thin=True)


def _edges_of(group: ProfileGroup, count: int) -> set[int]:
    return {s.edge for s in group.sources if s.image == 0 and s.edge < count}
