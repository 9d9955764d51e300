"""From edges to groups of profiles."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import count
from math import cos

import numpy as np

from .. import arguments
from .._typing import BoolArray, FloatArray, Image
from ..edges.base import Edge, Line, check_near
from ..edges.picture import check_view
from ..edges.strip import Frame
from ..photo import luminance
from ..progress import Job, Progress, drain
from .align import Alignment, CommonShape, Rows
from .base import ProfileGroup, ProfileSource
from .fine import HALF, FineProfile, Fit, fit_profile, gather, rounding_variance
from .group import ByOrientation, Grouping, OrientationCluster, cluster

LEAST_RANGE = 0.02  # contrast of a channel below which its profile says nothing
CLIP = 1.5 / 255  # distance of a side from the ends of the range at which it is clipped
SAMPLES = 40  # across a transition, unless that is finer than half a pixel


class Channels(Enum):
    """Which intensities are sampled."""

    SEPARATE = "one profile for each color channel"
    LUMINANCE = "one profile of the mean of the channels"


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """How far across the edges of one group is looked, pixels from the origin.

    Parameters
    ----------
    half : float
        Half of the common width of the transitions.
    flat : float
        Length of the flat sides beyond.
    """

    half: float
    flat: float

    @property
    def step(self) -> float:
        """Spacing of the samples: not finer than the pixels permit."""
        return max(2 * self.half / SAMPLES, 0.5)

    @property
    def fit(self) -> float:
        """Half-width of the local fits: a tenth of the transition, or a little over a step."""
        return max(1.25 * self.step, 0.2 * self.half)

    @property
    def position(self) -> FloatArray:
        """Samples across the transition and a little of its sides, symmetric about 0."""
        end = int(np.ceil((self.half + min(self.flat / 2, 0.1 * self.half + 1)) / self.step))
        return np.arange(-end, end + 1) * self.step

    @property
    def reach(self) -> float:
        """Farthest pixel that is looked at, with room for the alignment."""
        return 1.3 * self.half + self.flat + HALF + 2


def sample_profiles(
    image: Image,
    edges: Sequence[Edge],
    *,
    grouping: Grouping | None = None,
    alignment: Alignment | None = None,
    channels: Channels = Channels.SEPARATE,
    index: int = 0,
) -> list[ProfileGroup]:
    """Sample the profiles across the good edges of a photo and group them.

    Each profile is the average along its edge of the pixels themselves, at sub-pixel
    distances. Groups of several photos of one camera simply add: put the lists together.

    Parameters
    ----------
    image : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        Photo, uint8, uint16 or float in [0, 1].
    edges : sequence of Edge
        Edges of that photo; those that are not good are passed over.
    grouping : Grouping, optional
        Default :class:`ByOrientation`.
    alignment : Alignment, optional
        Default :class:`CommonShape`.
    channels : Channels
        What is sampled; channels that hardly change, or are clipped, are left out.
    index : int
        Number of the photo, noted in the source of each profile.

    Returns
    -------
    list of ProfileGroup
        The group with the most profiles first; empty if no edge is good.
    """
    job = sampling_profiles(
        image, edges, grouping=grouping, alignment=alignment, channels=channels, index=index
    )
    return drain(job)


def sampling_profiles(
    image: Image,
    edges: Sequence[Edge],
    *,
    grouping: Grouping | None = None,
    alignment: Alignment | None = None,
    channels: Channels = Channels.SEPARATE,
    index: int = 0,
) -> Job[list[ProfileGroup]]:
    """Job of :func:`sample_profiles`: reports progress, can be stopped."""
    check_view(image)
    grouping = ByOrientation() if grouping is None else grouping
    alignment = CommonShape() if alignment is None else alignment
    arguments.instance(grouping, Grouping, "a rule of grouping, such as ByOrientation(),")
    arguments.instance(alignment, Alignment, "a way of alignment, such as CommonShape(),")
    arguments.instance(channels, Channels, "a member of Channels")
    arguments.whole(index, "the number of a photo", least=0)
    for edge in arguments.instances(edges, Edge, "a sequence of edges"):
        check_near(image.shape, (edge.start, edge.end))
    good = [i for i, edge in enumerate(edges) if edge.good]
    # Every edge is gathered, and then measured about its own origin.
    reports = (Progress("profiles", done, 2 * len(good)) for done in count())
    yield next(reports)
    if channels is Channels.LUMINANCE:
        image = luminance(image)
    clusters = cluster(
        [edges[i].orientation for i in good],
        [edges[i].length * edges[i].contrast for i in good],
        grouping.tolerance,
    )
    bundles = []
    for members in clusters:
        bundles.append((yield from gathering_cluster(image, edges, good, members, reports)))
    bundles = [b for b in bundles if len(b.rows.edge)]
    shifts = alignment.shifts([b.rows for b in bundles]) if bundles else []
    groups: list[ProfileGroup] = []
    for bundle, shift in zip(bundles, shifts, strict=True):
        group = yield from bundle.measuring(shift, index, reports)
        groups += grouping.split(group) if len(group) else []
    return sorted(groups, key=len, reverse=True)


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """The edges of one orientation, with their pixels, before they are aligned."""

    orientation: float
    span: Span
    edges: tuple[int, ...]
    fine: tuple[FineProfile, ...]
    usable: BoolArray
    rows: Rows
    floor: float

    def measuring(
        self, shift: FloatArray, index: int, reports: Iterator[Progress]
    ) -> Job[ProfileGroup]:
        """Long job: the group of profiles about the given origin of each edge, shape (E,)."""
        fits = []
        for fine, origin in zip(self.fine, shift, strict=True):
            yield next(reports)
            fits.append(measured_profile(fine, self.span, origin, self.floor))
        return self.group(fits, index)

    def group(self, fits: Sequence["MeasuredProfile"], index: int) -> ProfileGroup:
        """The group of the profiles of all edges, without those that are not usable."""
        inside = np.array([np.isfinite(f.sides).all() and f.fit.count.min() >= 1 for f in fits])
        keep = self.usable & inside[:, None]
        sources = [ProfileSource(index, self.edges[e], int(c)) for e, c in np.argwhere(keep)]
        pixels = np.stack([np.broadcast_to(f.fit.count, f.fit.value.shape) for f in fits])
        sides = np.stack([f.sides for f in fits])[keep]
        return ProfileGroup(
            position=self.span.position,
            intensity=np.stack([f.fit.value for f in fits])[keep],
            variance=np.stack([f.fit.variance for f in fits])[keep],
            count=pixels[keep],
            sides=sides,
            sides_variance=np.stack([f.sides_variance for f in fits])[keep],
            orientation=self.orientation,
            polarity=common_sign(sides[:, 1] - sides[:, 0]),
            sources=tuple(sources),
        )


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredProfile:
    """Profile of one edge in all channels; `sides` and `sides_variance` (C, 2)."""

    fit: Fit
    sides: FloatArray
    sides_variance: FloatArray
    spread: FloatArray


def gathering_cluster(
    image: Image,
    edges: Sequence[Edge],
    good: Sequence[int],
    members: OrientationCluster,
    reports: Iterator[Progress],
) -> Job[Bundle]:
    """Long job: pixels of all edges of one orientation, seen in one direction."""
    numbers = [good[i] for i in members.members]
    span = common_span([edges[i].width for i in numbers])
    floor = rounding_variance(image)
    fine, fits = [], []
    for number in numbers:
        yield next(reports)
        fine.append(seen_along(image, edges[number], members.orientation, span))
        fits.append(measured_profile(fine[-1], span, 0.0, floor))
    usable = np.stack([usable_channels(f) for f in fits])
    some = np.flatnonzero(usable.any(axis=1))
    return Bundle(
        members.orientation,
        span,
        tuple(numbers[i] for i in some),
        tuple(fine[i] for i in some),
        usable[some],
        rows_of([fits[i] for i in some], usable[some], span),
        floor,
    )


def common_span(widths: Sequence[float]) -> Span:
    """The span of the widest of the edges of one group, but for outliers."""
    half = max(float(np.quantile(widths, 0.9)), 3.0) / 2
    return Span(half, flat=max(3.0, 0.4 * half))


def seen_along(image: Image, edge: Edge, orientation: float, span: Span) -> FineProfile:
    """Pixels across an edge in the direction of a group's normal, whatever its own is."""
    frame = Frame.of(Line(edge.start, edge.end))
    found = gather(image, frame, span.reach, span.fit)
    return found.reversed() if cos(frame.angle - orientation) < 0 else found


def rows_of(fits: Sequence[MeasuredProfile], usable: BoolArray, span: Span) -> Rows:
    """The usable channels, shape (E, C), of all edges, for their alignment."""
    edge, channel = np.nonzero(usable)
    pairs = list(zip(edge.tolist(), channel.tolist(), strict=True))
    return Rows(
        span.position,
        np.array([fits[e].fit.value[c] for e, c in pairs]),
        np.array([fits[e].fit.variance[c] for e, c in pairs]),
        np.array([fits[e].sides[c] for e, c in pairs]),
        edge,
    )


def measured_profile(fine: FineProfile, span: Span, origin: float, floor: float) -> MeasuredProfile:
    """Profile and sides of one edge about an origin, pixels along the normal."""
    fit = fit_profile(fine, span.position + origin, fine.half(span.fit), floor)
    places = np.abs(fine.place - origin)
    flat = (places >= span.half) & (places <= span.half + span.flat)
    means, spreads, counts = [], [], []
    for side in (fine.place < origin, fine.place > origin):
        weight = fine.count * (flat & side)
        total = max(float(weight.sum()), 1e-12)
        mean = fine.mean @ weight / total
        means.append(mean if weight.any() else np.full_like(mean, np.nan))
        spreads.append(np.maximum(fine.square @ weight / total - mean**2, floor))
        counts.append(total)
    spread = np.stack(spreads, axis=1)
    return MeasuredProfile(fit, np.stack(means, axis=1), spread / counts, spread)


def usable_channels(found: MeasuredProfile) -> BoolArray:
    """Channels that change across the edge and are not clipped on a side, shape (C,)."""
    # 1.4 standard deviations: less than a twelfth of the pixels beyond.
    margin = CLIP + 1.4 * np.sqrt(found.spread)
    clipped = (found.sides > 1 - margin) | (found.sides < margin)
    clear = np.abs(np.diff(found.sides, axis=1)[:, 0]) >= LEAST_RANGE
    inside = np.isfinite(found.sides).all(axis=1) & (found.fit.count.min() >= 1)
    return np.asarray(clear & ~clipped.any(axis=1) & inside)


def common_sign(values: FloatArray) -> int:
    """+1 or -1 if all values have that sign, else 0."""
    signs = set(np.sign(values).astype(int))
    return signs.pop() if len(signs) == 1 else 0
