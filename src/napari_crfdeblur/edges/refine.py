"""From proposed lines to edges: located to sub-pixels, checked, trimmed to what is usable."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from math import cos, hypot, sin, sqrt

import numpy as np

from .. import arguments
from .._typing import FloatArray, Image
from ..progress import Job, Progress, drain
from .base import FAR, Edge, EdgeStatus, Line, Rectangle, check_near
from .checks import (
    LEAST_CONTRAST,
    check_blocks,
    check_channels,
    check_profile,
    crossings,
    largest_bend,
    sagitta,
    shortest,
)
from .locate import CaptureRange, locate, refit
from .picture import Picture, check_view
from .scales import NARROW, Scales
from .strip import Frame, Strip, sample_strip, strips_along
from .transition import Transition, find_transition, flat_samples

NARROWEST = 1e-3  # blur extent in pixels: less is no blur, and as little as any program can tell
FEW_ROWS = 48  # of the strip of a whole edge: its parts are sampled anew
KEPT_BEND = 0.6  # of the largest, to which a curved edge is trimmed: some is noise
Part = tuple[Frame, EdgeStatus]


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
    check_view(image)
    check_extent(blur_extent, image.shape)
    for line in arguments.instances(lines, (Line, Rectangle), "a sequence of lines or rectangles"):
        ends = line.corners if isinstance(line, Rectangle) else (line.start, line.end)
        check_near(image.shape, ends)
    yield Progress("edges", 0, max(len(lines), 1))
    scales = Scales.to_refine(Picture.of(image), blur_extent)
    edges = []
    for number, line in enumerate(lines):
        yield Progress("edges", number, len(lines))
        frame, capture = drawn(scales.photo, line, blur_extent)
        (parts,) = refine(scales, [frame], CaptureRange(capture, blur_extent))
        edges.append(max(parts, key=lambda e: (e.good, e.length)))
    return tuple(edges)


def check_extent(blur_extent: float, shape: tuple[int, ...]) -> None:
    """Raise ValueError unless the width is a positive number of pixels, for a photo of a shape."""
    what = "a positive blur extent in pixels, of this photo"
    arguments.number(blur_extent, what, least=NARROWEST, most=FAR * max(shape[:2]))


def drawn(photo: Picture, shape: Line | Rectangle, blur_extent: float) -> tuple[Frame, float]:
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
    steps = [step_across(sample_strip(photo, f, d)) for f, d in zip(options, across, strict=True)]
    best = int(np.argmax(steps))
    return options[best], across[best]


def step_across(strip: Strip) -> float:
    """Range of the mean profile across a strip, the largest of the channels."""
    profile = strip.profile[:, np.isfinite(strip.profile).all(axis=0)]
    return float(np.ptp(profile, axis=1).max()) if profile.size else 0.0


def refine(scales: Scales, frames: Sequence[Frame], search: CaptureRange) -> list[list[Edge]]:
    """Edges along each proposed line: its usable parts, or one edge that says why not.

    Frames, edges and the search in pixels of the photo.
    """
    lines = find_parts(scales, frames, search)
    usable = [part for parts in lines for part, status in parts if status is EdgeStatus.GOOD]
    edges = iter(confirm_closely(scales, usable, search.blur_extent))
    return [
        [next(edges) if status is EdgeStatus.GOOD else bad(part, status) for part, status in parts]
        for parts in lines
    ]


def find_parts(scales: Scales, frames: Sequence[Frame], search: CaptureRange) -> list[list[Part]]:
    """Parts of each edge that pass the checks block by block, or all of it and why not."""
    near, step = scales.near.step, scales.fine.step
    located = [frame.reduced(near) for frame in frames]
    located = locate(scales.near, located, search.reduced(near))
    located = refit(scales.near, located, search.blur_extent / near)
    located = [frame.enlarged(near).reduced(step) for frame in located]
    search = search.reduced(step)
    strips = strips_along(scales.fine, located, reach(search.blur_extent), FEW_ROWS)
    return [
        [(part.enlarged(step), status) for part, status in usable_parts(frame, strip, search, step)]
        for frame, strip in zip(located, strips, strict=True)
    ]


def usable_parts(frame: Frame, strip: Strip, search: CaptureRange, step: int) -> list[Part]:
    """Parts of an edge whose blocks are good, or all of it and why there are none."""
    transition = find_transition(strip, search.blur_extent)
    if transition is None:
        return [(frame, without_sides(strip))]
    found = check_blocks(strip, transition)
    if found is None:
        return [(frame, EdgeStatus.OUTSIDE)]
    places, statuses = found
    least = shortest(transition.last - transition.first, step)
    runs = [r for r in good_runs(places, statuses) if r[1] - r[0] >= least]
    if not runs:
        return [(frame, reason(statuses))]
    return [straight(frame, strip, transition, run, least) for run in runs]


def straight(
    frame: Frame, strip: Strip, transition: Transition, run: tuple[float, float], least: float
) -> Part:
    """The part of an edge, or so much of its middle as is straight; CURVED if that is too short."""
    first, last = run
    limit = KEPT_BEND * largest_bend(transition.last - transition.first)
    bend = sagitta(strip, transition, first, last)
    if bend > limit:
        half = (last - first) / 2 * sqrt(limit / bend)  # the sagitta grows with the length squared
        first, last = (first + last) / 2 - half, (first + last) / 2 + half
    status = EdgeStatus.GOOD if last - first >= least else EdgeStatus.CURVED
    return frame.part(first, last), status


def reach(blur_extent: float) -> float:
    """How far across an edge is looked at, pixels on each side."""
    return 0.75 * blur_extent + flat_samples(blur_extent) + 4


def without_sides(strip: Strip) -> EdgeStatus:
    """Why no flat sides were found: the image ends, nothing is there, or they are not flat."""
    if np.isfinite(strip.signal).mean() < 0.75:
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


def confirm_closely(scales: Scales, frames: Sequence[Frame], blur_extent: float) -> list[Edge]:
    """The edges of :func:`confirm`; those that are narrow in the picture, from the photo."""
    edges = confirm(scales.fine, frames, blur_extent)
    step = scales.fine.step
    if step == 1:
        return edges
    narrow = [i for i, e in enumerate(edges) if e.good and e.width < NARROW * step]
    closer = confirm(scales.photo, [frames[i] for i in narrow], blur_extent)
    for i, edge in zip(narrow, closer, strict=True):
        edges[i] = edge
    return edges


def confirm(picture: Picture, frames: Sequence[Frame], blur_extent: float) -> list[Edge]:
    """The edges along parts found usable, fitted again on their own and checked as a whole.

    Frames, edges and the extent of the blur in pixels of the photo.
    """
    if not frames:
        return []
    step = picture.step
    extent = blur_extent / step
    located = refit(picture, [frame.reduced(step) for frame in frames], extent)
    strips = strips_along(picture, located, reach(extent))
    return [
        confirmed(frame, strip, extent, step) for frame, strip in zip(located, strips, strict=True)
    ]


def confirmed(frame: Frame, strip: Strip, blur_extent: float, step: int) -> Edge:
    """The edge of a frame, good if all its checks are passed."""
    transition = find_transition(strip, blur_extent)
    if transition is None:
        return bad(frame.enlarged(step), without_sides(strip))
    status = check_profile(strip, transition, blur_extent)
    if status is EdgeStatus.GOOD:
        status = check_channels(strip, transition)
    if status is EdgeStatus.GOOD:
        status = check_length(strip, transition)
    return measured(frame, strip, transition, status, step)


def check_length(strip: Strip, transition: Transition) -> EdgeStatus:
    """Whether most blocks along the edge are good, and it is straight, now that it is trimmed."""
    found = check_blocks(strip, transition)
    if found is None:
        return EdgeStatus.OUTSIDE
    statuses = found[1]
    bad_blocks = sum(s is not EdgeStatus.GOOD for s in statuses)
    if bad_blocks > 0.15 * len(statuses):
        return Counter(s for s in statuses if s is not EdgeStatus.GOOD).most_common(1)[0][0]
    half = strip.spacing * len(strip.along) / 2
    bend = sagitta(strip, transition, -half, half)
    if bend > largest_bend(transition.last - transition.first):
        return EdgeStatus.CURVED
    return EdgeStatus.GOOD


def measured(
    frame: Frame, strip: Strip, transition: Transition, status: EdgeStatus, step: int
) -> Edge:
    """The edge of a frame, moved to where its profile crosses the middle of its sides."""
    rising = transition.rising()[transition.window]
    across = float(crossings(rising, np.array([0.0, 1.0]))) + strip.across[transition.window][0]
    edge = bad(frame.moved(float(across), 0.0).enlarged(step), status)
    same = hypot(sin(frame.angle) + edge.normal[0], cos(frame.angle) + edge.normal[1]) > 1
    return replace(
        edge,
        polarity=transition.polarity * (1 if same else -1),
        width=float(step * (transition.last - transition.first)),
        contrast=transition.contrast,
    )


def bad(frame: Frame, status: EdgeStatus) -> Edge:
    """An edge of which no more is known than where it is and what is wrong with it."""
    line = frame.line
    return Edge(line.start, line.end, status=status)
