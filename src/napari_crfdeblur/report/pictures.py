"""Photos, the edges on them, and PSFs, drawn on axes."""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from .._typing import FloatArray, Image
from ..edges import Edge
from ..photo import color, luminance, to_unit
from ..profiles import ProfileGroup
from ..psf import PsfField, PsfStatus
from .colors import GROUPS, INK, OTHERS, PALE, REJECTED
from .content import direction

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

LONGEST = 1000  # pixels of a photo as shown: more than a printed page resolves
DETAIL = (80, 200)  # rows and columns of a detail, large enough on paper to see its pixels
REASONS = 4  # for which edges were rejected, that a legend has room for


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
    outline_axes(ax)


def draw_edges(ax: "Axes", edges: Sequence[Edge], groups: Sequence[ProfileGroup] = ()) -> None:
    """Draw edges over their photo, those of one direction in one color, rejected ones thin.

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
    left = {i for i, edge in enumerate(edges) if edge.good}
    angles: dict[str, set[int]] = {}
    for group in groups:
        own = left & {s.edge for s in group.sources if s.image == 0}
        angles.setdefault(direction(group), set()).update(own)
    largest = sorted(angles.items(), key=lambda item: -len(item[1]))
    for shade, (angle, own) in zip(GROUPS, largest, strict=False):
        _lines(ax, [edges[i] for i in sorted(own & left)], shade, f"at {angle}")
        left -= own
    rest = "at other angles" if groups else "found"
    _lines(ax, [edges[i] for i in sorted(left)], OTHERS, rest)
    rejected = Counter(edge.status for edge in edges if not edge.good)
    reasons = [status for status, _ in rejected.most_common(REASONS)]
    for status in reasons:
        faulty = [edge for edge in edges if edge.status is status]
        _lines(ax, faulty, REJECTED, f"rejected: {status.value}", width=0.7)
    others = [edge for edge in edges if not edge.good and edge.status not in reasons]
    _lines(ax, others, REJECTED, "rejected for other reasons", width=0.7)


def draw_psf(ax: "Axes", psf: FloatArray) -> None:
    """Draw a PSF, shape (H, W), dark where it is heavy, in pixels from its origin."""
    rows, columns = (side // 2 for side in psf.shape)
    shown = (-columns - 0.5, columns + 0.5, rows + 0.5, -rows - 0.5)
    ax.imshow(psf, extent=shown, cmap="gray_r", vmin=0, interpolation="nearest")
    for line in (ax.axhline, ax.axvline):
        line(0, color=GROUPS[0], linewidth=0.5, alpha=0.6)
    ax.tick_params(labelsize=7, labelcolor=PALE, length=2, color=PALE)
    ax.locator_params(nbins=5, integer=True)
    ax.set_xlabel("pixels from the origin", fontsize=7.5, color=INK)
    outline_axes(ax)


def draw_psf_field(ax: "Axes", field: PsfField) -> None:
    """Draw the PSFs of all parts of a photo in their places, each scaled to its peak.

    Those that follow from the others are drawn on gray.
    """
    rows, columns = field.grid
    height, width = (side + 1 for side in field.psfs.shape[2:])
    sheet = field.picture()
    ax.imshow(sheet, cmap="gray_r", vmin=0, vmax=1, interpolation="nearest")
    for row, column in np.ndindex(rows, columns):
        if field.statuses[row][column] is PsfStatus.BORROWED:
            corner = column * width - 0.5, row * height - 0.5
            ax.add_patch(_rectangle(corner, width - 1, height - 1))
    for row in range(1, rows):
        ax.axhline(row * height - 1, color=PALE, linewidth=0.5)
    for column in range(1, columns):
        ax.axvline(column * width - 1, color=PALE, linewidth=0.5)
    ax.set(xticks=[], yticks=[])
    outline_axes(ax)


def _rectangle(corner: tuple[float, float], width: float, height: float) -> "Patch":
    from matplotlib.patches import Rectangle

    return Rectangle(corner, width, height, facecolor=PALE, alpha=0.25, edgecolor="none")


def detail(photo: Image, sharp: Image) -> tuple[slice, slice] | None:
    """Rows and columns where deblurring changed most; None if the photo is hardly larger."""
    height, width = photo.shape[:2]
    if height < 1.5 * DETAIL[0] or width < 1.5 * DETAIL[1]:
        return None
    (before, k), (after, _) = reduced(photo), reduced(sharp)
    # Squared, so that edges count for more than noise.
    change = (luminance(after) - luminance(before)) ** 2
    window = [max(1, side // k) for side in DETAIL]
    mean = ndimage.uniform_filter(change, window, mode="constant")
    row, column = (int(i) * k for i in np.unravel_index(np.argmax(mean), mean.shape))
    top = min(max(row - DETAIL[0] // 2, 0), height - DETAIL[0])
    left = min(max(column - DETAIL[1] // 2, 0), width - DETAIL[1])
    return slice(top, top + DETAIL[0]), slice(left, left + DETAIL[1])


def outline_axes(ax: "Axes") -> None:
    """A thin gray line around the axes."""
    ax.spines[:].set(linewidth=0.5, color=PALE)


def _lines(
    ax: "Axes", edges: Sequence[Edge], shade: str, label: str, *, width: float = 1.6
) -> None:
    """Edges in one color, cased in white so that they stand out on any photo."""
    from matplotlib.collections import LineCollection
    from matplotlib.patheffects import withStroke

    if not edges:
        return
    points = [[edge.start[::-1], edge.end[::-1]] for edge in edges]
    casing = [withStroke(linewidth=width + 1, foreground="white")]
    lines = LineCollection(points, colors=shade, linewidths=width, path_effects=casing)
    lines.set_label(f"{len(edges)} {label}")
    ax.add_collection(lines, autolim=False)
