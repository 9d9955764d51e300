"""From a solution to that of profiles most of which are the same, in a step or two."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..._typing import FloatArray, Image
from .descent import descend
from .evidence import EdgeGroup
from .family import Family
from .known import expected_shapes
from .model import GroupState, ModelState, initial
from .noise_model import NoiseModel
from .problem import Expected, Problem
from .search import Solution, plain_misfits, typical_misfit, weighted

STEPS = 2
# Of the objective: a step that gains less moves nothing by much more than its standard deviation
# after the fit, and what such a step leaves is about a hundredth of that.
ENOUGH = 1.0
LEAST_SAME = 0.5  # share of the edges that are known; with fewer the last solution says too little
# Differences below which edges that are sampled anew are the same: of their sides, in intensity,
# and of the orientation of their groups, radians.
SAME_SIDES, SAME_ANGLE = 0.02, 0.1
HELD = 1e12  # precision of a shape that stays as it is


@dataclass(frozen=True, slots=True, eq=False)
class _Carried:
    """A group of profiles with what is known of it from before.

    Parameters
    ----------
    group : EdgeGroup
    state : GroupState
        As before where an edge is known; otherwise as its two sides say.
    expected : Expected or None
        The shape that a known PSF gives.
    new : ndarray of int
        Edges that are not known.
    origin : int or None
        Group of the last solution that it goes on from; None if there is none.
    """

    group: EdgeGroup
    state: GroupState
    expected: Expected | None
    new: Image
    origin: int | None


def refound(
    found: Solution, groups: Sequence[EdgeGroup], noise: NoiseModel, psf: FloatArray | None = None
) -> Solution | None:
    """The solution for other profiles, from that of some of which most are the same.

    Edges that are known go on from their own unknowns, the others from those that suit the
    response and the shape of their group. The weight of each edge follows its misfit. The
    evidence, which it takes a search to find, stays as it was, and so does whether that search
    came to an end.

    Parameters
    ----------
    found : Solution
        The last solution.
    groups : sequence of EdgeGroup
        The profiles now.
    noise : NoiseModel
        How much a sample counts.
    psf : ndarray, shape (H, W), optional
        If it is known.

    Returns
    -------
    Solution or None
        None if less than half of the edges are known: the way may be far then, and it takes a
        search to find it.
    """
    places = _places(found.problem.groups, groups)
    family = found.problem.family(found.state)
    carried = [
        _carried(found, group, own, family) for group, own in zip(groups, places, strict=True)
    ]
    if sum(each.new.size for each in carried) > (1 - LEAST_SAME) * sum(
        len(g.edges) for g in groups
    ):
        return None
    problem = replace(found.problem, groups=groups, weights=noise.weights(groups))
    start = ModelState(family.coefficients, _settled(problem, family, carried))
    problem = replace(problem, expected=_expectations(carried, start, psf))
    plain = problem.misfits(start)
    trust = [noise.trust(group, misfit) for group, misfit in zip(groups, plain, strict=True)]
    problem = weighted(problem, noise, trust, found.evidence)
    end = descend(problem, start, STEPS, ENOUGH)
    misfit = typical_misfit(groups, plain_misfits(problem, noise, end.state))
    return Solution(problem, end.state, end.normal, found.evidence, misfit, found.settled)


def _places(
    before: Sequence[EdgeGroup], groups: Sequence[EdgeGroup]
) -> list[list[tuple[int, int] | None]]:
    """Group and row that each edge had, None if it is new; its number changes with others.

    Edges are known by their samples. Without some of its edges, though, a group can be sampled
    anew: what is left is known by its orientation and its sides.
    """
    left = {
        intensity.tobytes(): (number, row)
        for number, group in enumerate(before)
        for row, intensity in enumerate(group.intensity)
    }
    places = [[left.pop(row.tobytes(), None) for row in group.intensity] for group in groups]
    for group, own in zip(groups, places, strict=True):
        _find_alike(group, own, before, left)
    return places


def _find_alike(
    group: EdgeGroup,
    own: list[tuple[int, int] | None],
    before: Sequence[EdgeGroup],
    left: dict[bytes, tuple[int, int]],
) -> None:
    """Give edges without a place that of the edge most like them, of those that are left."""
    kept = [_same_kind(old, group) for old in before]
    near = [(key, number, row) for key, (number, row) in left.items() if kept[number]]
    if not near or None not in own:
        return
    sides = np.stack([before[number].intensity[row, :, -2:] for _, number, row in near])
    for row, place in enumerate(own):
        if place is None:
            apart = np.abs(sides - group.intensity[row, :, -2:]).max(axis=(1, 2))
            best = int(np.argmin(apart))
            if apart[best] < SAME_SIDES:
                own[row] = left.pop(near[best][0])
                sides[best] = np.inf


def _same_kind(old: EdgeGroup, new: EdgeGroup) -> bool:
    """Whether two groups are of one orientation, and of as many channels."""
    turned = abs(old.group.orientation - new.group.orientation)
    alike = min(turned, np.pi - turned) < SAME_ANGLE
    return bool(alike) and old.present.shape[1] == new.present.shape[1]


def _carried(
    found: Solution, group: EdgeGroup, known: Sequence[tuple[int, int] | None], family: Family
) -> _Carried:
    votes = Counter(place[0] for place in known if place)
    if not votes:
        (state,) = initial([group], family).groups
        return _Carried(group, state, None, np.arange(len(known)), None)
    origin = votes.most_common(1)[0][0]
    old = found.state.groups[origin]
    same = [(row, place[1]) for row, place in enumerate(known) if place and place[0] == origin]
    rows, before = np.array(same).T
    new = np.setdiff1d(np.arange(len(known)), rows)
    light, shift = np.empty((*group.present.shape, 2)), np.zeros(group.present.shape)
    light[rows], shift[rows] = old.light[before], old.shift[before]
    if new.size:
        light[new] = initial([group.select(new)], family).groups[0].light
    # Without some of its edges a group can be sampled otherwise.
    shape = np.interp(group.position, found.problem.groups[origin].position, old.shape)
    state = GroupState(shape, light, shift)
    same_samples = np.array_equal(group.position, found.problem.groups[origin].position)
    expected = found.problem.expected[origin] if same_samples else None
    return _Carried(group, state, expected, new, origin)


def _settled(
    problem: Problem, family: Family, carried: Sequence[_Carried]
) -> tuple[GroupState, ...]:
    """The states with new edges where response and shape ask them to be; both stay.

    Else the first step, which is of all unknowns at once, would follow edges that are far off.
    """
    numbers = [n for n, each in enumerate(carried) if each.new.size]
    some = [carried[n] for n in numbers]
    part = replace(
        problem,
        groups=[each.group.select(each.new) for each in some],
        weights=[problem.weights[n][carried[n].new] for n in numbers],
        expected=[None if e.origin is None else Expected(e.state.shape, HELD) for e in some],
    )
    own = [replace(e.state, light=e.state.light[e.new], shift=e.state.shift[e.new]) for e in some]
    still = np.zeros_like(family.coefficients)
    for _ in range(STEPS):
        parts = part.normal(ModelState(family.coefficients, tuple(own))).groups if own else ()
        own = [each.moved(state, still, 1.0) for each, state in zip(parts, own, strict=True)]
    states = [each.state for each in carried]
    for number, state in zip(numbers, own, strict=True):
        states[number] = _with_rows(states[number], carried[number], state)
    return tuple(states)


def _with_rows(state: GroupState, carried: _Carried, new: GroupState) -> GroupState:
    light, shift = state.light.copy(), state.shift.copy()
    light[carried.new], shift[carried.new] = new.light, new.shift
    return GroupState(new.shape if carried.origin is None else state.shape, light, shift)


def _expectations(
    carried: Sequence[_Carried], state: ModelState, psf: FloatArray | None
) -> list[Expected | None]:
    """The shapes that a known PSF gives; those of groups that are known are known, too."""
    if psf is None:
        return [None] * len(carried)
    return [
        each.expected
        or expected_shapes(psf, [each.group], ModelState(state.coefficients, (own,)))[0]
        for each, own in zip(carried, state.groups, strict=True)
    ]
