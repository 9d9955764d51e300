"""From a proposed line to edges: located to sub-pixels, checked, trimmed to what is usable."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from math import cos, hypot, inf, sin

import numpy as np

from .._typing import FloatArray, Image
from ..photo import check_image
from ..progress import Job, Progress, drain
from .base import Edge, EdgeStatus, Line, Rectangle
from .checks import (
    LEAST_CONTRAST,
    check_blocks,
    check_channels,
    check_profile,
    crossing,
    shortest,
)
from .locate import Search, locate, mean_valid, refit, signal
from .strip import Frame, Strip, sample_strip
from .transition import Transition, find_transition, flat_samples


def refine_edges(
    image: Image, lines: Sequence[Line | Rectangle], *, blur_extent: float
) -> tuple[Edge, ...]:
    """Edges next to lines or rectangles that the user has drawn, one for each, in order.

    Parameters
    ----------
    image : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
        Photo, uint8, uint16 or float in [0, 1].
    lines : sequence of Line or Rectangle
        Where the edges are, roughly.
    blur_extent : float
        Largest expected width of an edge, pixels.

    Returns
    -------
    tuple of Edge
        The longest usable part of each edge, or the reason why there is none.
    """
    return drain(refining_edges(image, lines, blur_extent=blur_extent))


def refining_edges(
    image: Image, lines: Sequence[Line | Rectangle], *, blur_extent: float
) -> Job[tuple[Edge, ...]]:
    """Job of :func:`refine_edges`: reports progress, can be stopped."""
    check_image(image)
    check_extent(blur_extent)
    image = readable(image)
    edges = []
    for number, line in enumerate(lines):
        yield Progress("edges", number, len(lines))
        frame, capture = drawn(image, line, blur_extent)
        parts = refine(image, frame, Search(capture, blur_extent))
        edges.append(max(parts, key=lambda e: (e.good, e.length)))
    return tuple(edges)


def check_extent(blur_extent: float) -> None:
    """Raise ValueError unless the width is a positive number of pixels."""
    if not 0 < blur_extent < inf:
        raise ValueError(f"expected a positive blur extent in pixels, got {blur_extent}")


def readable(image: Image) -> Image:
    """The image in a kind of number that interpolation takes (it does not take float16)."""
    return image.astype(np.float32) if image.dtype == np.float16 else image


def drawn(image: Image, shape: Line | Rectangle, blur_extent: float) -> tuple[Frame, float]:
    """Frame of what the user has drawn, and how far the edge may lie from its middle line."""
    if isinstance(shape, Line):
        frame = Frame.of(shape)
        return frame, max(4.0, 0.5 * blur_extent, 0.05 * frame.length)
    p, q, r, s = np.asarray(shape.corners, dtype=float)
    options = []
    for start, end in (((p + s) / 2, (q + r) / 2), ((p + q) / 2, (r + s) / 2)):
        frame = Frame.of(Line((start[0], start[1]), (end[0], end[1])))
        options.append(frame)
    across = [options[1].length / 2, options[0].length / 2]
    steps = [step_across(sample_strip(image, f, d)) for f, d in zip(options, across, strict=True)]
    best = int(np.argmax(steps))
    return options[best], across[best]


def step_across(strip: Strip) -> float:
    """Range of the mean profile across a strip, the largest of the channels."""
    mean = mean_valid(strip.values, 0)
    mean = mean[np.isfinite(mean).all(axis=1)]
    return float(np.ptp(mean, axis=0).max()) if len(mean) else 0.0


def refine(image: Image, frame: Frame, search: Search) -> list[Edge]:
    """Edges along a proposed line: its usable parts, or one edge that says why not."""
    edges = []
    for part, status in usable_parts(image, frame, search):
        if status is not EdgeStatus.GOOD:
            edges.append(bad(part, status))
            continue
        edges.append(confirm(image, part, search.blur_extent))
    return edges


def usable_parts(image: Image, frame: Frame, search: Search) -> Iterator[tuple[Frame, EdgeStatus]]:
    """Parts of an edge that pass the checks block by block, or all of it and why not."""
    located = locate(image, frame, search)
    if located is None:
        yield frame, EdgeStatus.OUTSIDE
        return
    strip = sample_strip(image, located, reach(search.blur_extent))
    transition = find_transition(strip, signal(strip), search.blur_extent)
    if transition is None:
        yield located, without_sides(strip)
        return
    found = check_blocks(strip, transition)
    if found is None:
        yield located, EdgeStatus.OUTSIDE
        return
    places, statuses = found
    least = shortest(transition.last - transition.first)
    runs = [r for r in good_runs(places, statuses) if r[1] - r[0] >= least]
    for first, last in runs:
        yield located.part(first, last), EdgeStatus.GOOD
    if not runs:
        yield located, reason(statuses)


def reach(blur_extent: float) -> float:
    """How far across an edge is looked at, pixels on each side."""
    return 0.75 * blur_extent + flat_samples(blur_extent) + 4


def without_sides(strip: Strip) -> EdgeStatus:
    """Why no flat sides were found: the image ends, nothing is there, or they are not flat."""
    if np.isfinite(strip.values).all(axis=2).mean() < 0.75:
        return EdgeStatus.OUTSIDE
    return EdgeStatus.FAINT if step_across(strip) < LEAST_CONTRAST else EdgeStatus.UNEVEN_SIDE


def good_runs(places: FloatArray, statuses: list[EdgeStatus]) -> list[tuple[float, float]]:
    """Runs of good blocks along the edge, as (first, last) in pixels from its middle."""
    half = (places[1] - places[0]) / 2 if len(places) > 1 else 0.0
    good = [s is EdgeStatus.GOOD for s in statuses]
    runs = []
    for is_good, members in groupby(range(len(good)), key=lambda i: good[i]):
        if is_good:
            run = list(members)
            runs.append((float(places[run[0]] - half), float(places[run[-1]] + half)))
    return runs


def reason(statuses: list[EdgeStatus]) -> EdgeStatus:
    """The commonest reason among blocks, SHORT if they are good but too few."""
    bad_ones = Counter(s for s in statuses if s is not EdgeStatus.GOOD)
    if not bad_ones or bad_ones.total() < len(statuses) / 3:
        return EdgeStatus.SHORT
    return bad_ones.most_common(1)[0][0]


def confirm(image: Image, frame: Frame, blur_extent: float) -> Edge:
    """The edge along a part found usable, fitted again on its own and checked as a whole."""
    located = refit(image, frame, blur_extent)
    if located is None:
        return bad(frame, EdgeStatus.OUTSIDE)
    strip = sample_strip(image, located, reach(blur_extent))
    transition = find_transition(strip, signal(strip), blur_extent)
    if transition is None:
        return bad(located, without_sides(strip))
    status = check_profile(strip, transition)
    if status is EdgeStatus.GOOD:
        status = check_channels(strip, transition)
    if status is EdgeStatus.GOOD:
        status = check_length(strip, transition)
    return measured(located, strip, transition, status)


def check_length(strip: Strip, transition: Transition) -> EdgeStatus:
    """Whether most blocks along the edge are good, now that its ends are trimmed."""
    found = check_blocks(strip, transition)
    if found is None:
        return EdgeStatus.OUTSIDE
    statuses = found[1]
    bad_blocks = sum(s is not EdgeStatus.GOOD for s in statuses)
    if bad_blocks <= 0.15 * len(statuses):
        return EdgeStatus.GOOD
    return Counter(s for s in statuses if s is not EdgeStatus.GOOD).most_common(1)[0][0]


def measured(frame: Frame, strip: Strip, transition: Transition, status: EdgeStatus) -> Edge:
    """The edge of a frame, moved to where its profile crosses the middle of its sides."""
    rising = transition.rising()[transition.window]
    across = crossing(rising, 0.0, 1.0) + strip.across[transition.window][0]
    edge = bad(frame.moved(float(across), 0.0), status)
    same = hypot(sin(frame.angle) + edge.normal[0], cos(frame.angle) + edge.normal[1]) > 1
    return replace(
        edge,
        polarity=transition.polarity * (1 if same else -1),
        width=float(transition.last - transition.first),
        contrast=transition.contrast,
    )


def bad(frame: Frame, status: EdgeStatus) -> Edge:
    """An edge of which no more is known than where it is and what is wrong with it."""
    line = frame.line
    return Edge(line.start, line.end, status=status)
