"""Normal equations against a dense system built by brute force, and the way down to the minimum."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pytest

from napari_crfdeblur.estimate import NoiseModel
from napari_crfdeblur.estimate.likelihood.descent import descend
from napari_crfdeblur.estimate.likelihood.evidence import edge_groups
from napari_crfdeblur.estimate.likelihood.family import Family
from napari_crfdeblur.estimate.likelihood.model import GroupState, ModelState, initial, predict
from napari_crfdeblur.estimate.likelihood.problem import (
    MONOTONE_WEIGHT,
    RIDGE,
    SHARES,
    Expected,
    Problem,
    Shift,
)
from napari_crfdeblur.profiles import ProfileSource
from napari_crfdeblur.response import Cameras, Gamma, ResponsePrior
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles

CURVE = Gamma(1.7)
SHIFT = Shift(edge=0.25, channel=0.07)
FULL = Cameras.DIGITAL.prior
PRIOR = ResponsePrior(FULL.mean, FULL.directions[:5])
SOURCES = [
    [(0, 0, 0), (0, 0, 1), (0, 0, 2), (0, 1, 0), (0, 1, 2), (1, 0, 1), (0, 2, 0)],
    [(0, 7, 0), (1, 7, 0), (0, 8, 0)],
]


def middle(rng, rows):
    """Sides well within the range, so that no perturbed light leaves it."""
    dark = rng.uniform(0.1, 0.4, rows)
    return np.stack([dark, dark + rng.uniform(0.2, 0.45, rows)], axis=1)


@pytest.fixture(scope="module")
def groups():
    """Two groups of unlike size and length, one to three channels, rising and falling."""
    camera = Camera(CURVE, noise=0.01, bits=None)
    cases = [
        ProfileCase(profiles=7, samples=13, falling=0.4, levels=middle),
        ProfileCase(profiles=3, samples=18, falling=0.4, levels=middle),
    ]
    drawn = [random_profiles(camera, case, seed=5 + k)[0] for k, case in enumerate(cases)]
    return edge_groups(
        [
            replace(group, sources=tuple(ProfileSource(*s) for s in sources))
            for group, sources in zip(drawn, SOURCES, strict=True)
        ]
    )


def problem_of(groups, expected=(None, None), prior=PRIOR):
    return Problem(prior, groups, NoiseModel().weights(groups), SHIFT, list(expected))


def away(problem, *, shift=0.2, size=0.3, seed=2):
    """A state that is not the minimum in any of its unknowns."""
    rng = np.random.default_rng(seed)
    coefficients = size * rng.standard_normal(problem.prior.size)
    start = initial(problem.groups, Family(problem.prior, 0 * coefficients))
    return ModelState(
        coefficients,
        tuple(
            GroupState(
                own.shape + 0.02 * rng.standard_normal(own.shape.shape),
                own.light + 0.01 * rng.standard_normal(own.light.shape),
                shift * rng.standard_normal(own.shift.shape),
            )
            for own in start.groups
        ),
    )


def as_vector(state):
    parts = [state.coefficients]
    for own in state.groups:
        parts += [own.shape, own.light.ravel(), own.shift.ravel()]
    return np.concatenate(parts)


def as_state(vector, like):
    rest = list(np.split(vector, np.cumsum([a.size for a in arrays(like)])[:-1]))
    shaped = [r.reshape(a.shape) for r, a in zip(rest, arrays(like), strict=True)]
    groups = (GroupState(*shaped[i : i + 3]) for i in range(1, len(shaped), 3))
    return ModelState(shaped[0], tuple(groups))


def arrays(state):
    return [
        state.coefficients,
        *(a for g in state.groups for a in (g.shape, g.light, g.shift)),
    ]


@dataclass(frozen=True)
class Dense:
    """Gauss-Newton system of all unknowns, shapes (P, P) and (P,)."""

    hessian: np.ndarray
    gradient: np.ndarray


def dense(problem, state):
    """By finite differences of every residual; the slope by which an edge shifts stands still."""
    slopes = [predict(g, own).slope for g, own in zip(problem.groups, state.groups, strict=True)]

    def residuals(vector):
        at = as_state(vector, state)
        family = problem.family(at)
        found = [at.coefficients]
        for group, weight, own, slope, known in zip(
            problem.groups, problem.weights, at.groups, slopes, problem.expected, strict=True
        ):
            spread = np.concatenate([own.shape, [0, 1]]) + own.shift[..., np.newaxis] * slope
            light = own.light[..., :1] + own.light[..., 1:] * spread
            found.append((np.sqrt(weight) * (family.record(light) - group.intensity)).ravel())
            found.append((own.shift @ root(own.shift.shape[1])).ravel())
            if known is not None:
                found.append(np.sqrt(known.precision) * (own.shape - known.shape))
        return np.concatenate(found)

    at, step = as_vector(state), 1e-7
    columns = [(residuals(at + s) - residuals(at - s)) / (2 * step) for s in step * np.eye(at.size)]
    jacobian = np.stack(columns, axis=1)
    hessian, gradient = jacobian.T @ jacobian, jacobian.T @ residuals(at)
    size = problem.prior.size
    _, slope, curvature = problem.family(state).penalty(MONOTONE_WEIGHT)
    hessian[:size, :size] += curvature
    gradient[:size] += slope
    ridge = np.repeat([0, RIDGE], [size, at.size - size])
    return Dense(hessian + np.diag(ridge), gradient)


def root(channels):
    """Root of the inverse covariance of the shifts of the channels of an edge."""
    covariance = SHIFT.channel**2 * np.eye(channels) + SHIFT.edge**2 * np.ones((channels, channels))
    return np.linalg.cholesky(np.linalg.inv(covariance))


def expected_of(problem, precision=3e4):
    """Shapes that are known, not those of the profiles."""
    shapes = [own.shape for own in away(problem, seed=9).groups]
    return [None, Expected(shapes[1], precision)]


VARIANTS = {
    "shapes free": {},
    "a shape known": {"known": True},
    "a curve that falls": {"size": 6.0},
    "one direction": {"prior": ResponsePrior(FULL.mean, FULL.directions[:1])},
    "no shifts": {"shift": 0.0},
}


@pytest.fixture(scope="module", params=VARIANTS.values(), ids=VARIANTS)
def system(request, groups):
    """Problem, state away from the minimum, dense system, normal equations."""
    options = dict(request.param)
    problem = problem_of(groups, prior=options.pop("prior", PRIOR))
    if options.pop("known", False):
        problem = replace(problem, expected=expected_of(problem))
    state = away(problem, **options)
    return problem, state, dense(problem, state), problem.normal(state)


# Differences of residuals of size 1e2 with a step of 1e-7 leave 1e-7; the squares of a system
# whose diagonals run from 1e-3 to 1e8 lose some of it.
CLOSE = 1e-6


def test_normal_equations_are_the_schur_complement_of_all(system):
    problem, _, whole, normal = system
    n = problem.prior.size
    a, b = whole.hessian[:n, :n], whole.hessian[:n, n:]
    rest = np.linalg.solve(
        whole.hessian[n:, n:], np.column_stack([b.T, whole.gradient[n:, np.newaxis]])
    )
    scale = np.abs(a).max()
    np.testing.assert_allclose(normal.hessian, a - b @ rest[:, :-1], atol=CLOSE * scale)
    scale = np.abs(whole.gradient[:n]).max()
    np.testing.assert_allclose(
        normal.gradient, whole.gradient[:n] - b @ rest[:, -1], atol=CLOSE * scale
    )


def test_normal_equations_are_symmetric_and_positive(system):
    normal = system[-1]
    np.testing.assert_allclose(
        normal.hessian, normal.hessian.T, atol=1e-10 * np.abs(normal.hessian).max()
    )
    assert np.linalg.eigvalsh(normal.hessian).min() > 1 - 1e-6  # the prior alone makes 1


def test_scores_of_the_edges_sum_to_what_the_data_say(system):
    problem, state, _, normal = system
    data = normal.gradient - state.coefficients
    data -= problem.family(state).penalty(MONOTONE_WEIGHT)[1]
    for part, own, known in zip(normal.groups, state.groups, problem.expected, strict=True):
        if known is not None:  # pulls at the shape, and so at the coefficients, too
            data += part.shape[:, :-1].T @ (known.precision * (own.shape - known.shape))
    assert len(normal.scores) == sum(len(g.edges) for g in problem.groups)
    np.testing.assert_allclose(
        normal.scores.sum(axis=0), data, atol=1e-9 * np.abs(normal.scores).max()
    )


def test_an_undamped_whole_step_is_that_of_the_dense_system(system):
    _, state, whole, normal = system
    change = -np.linalg.solve(whole.hessian, whole.gradient)
    found = as_vector(normal.step(state, 0.0, 1.0)) - as_vector(state)
    np.testing.assert_allclose(found, change, atol=1e-4 * np.abs(change).max())


def test_a_share_of_a_step_is_that_share_of_every_unknown(system):
    _, state, _, normal = system
    at = as_vector(state)
    whole, part = (as_vector(normal.step(state, 0.1, share)) - at for share in (1.0, 0.3))
    np.testing.assert_allclose(part, 0.3 * whole, atol=1e-12 * np.abs(whole).max())


def test_a_group_takes_the_share_of_its_step_that_suits_it_best(system):
    problem, state, _, normal = system
    change = normal.change(0.1, 1.0)
    found, value = problem.lowest(normal, state, change)
    np.testing.assert_array_equal(found.coefficients, state.coefficients + change)
    # Several states at once are summed in another order than one.
    assert value == pytest.approx(problem.value(found), rel=1e-12)
    parts = list(zip(normal.groups, state.groups, strict=True))
    for shares in product(SHARES, repeat=len(parts)):
        moved = tuple(
            part.moved(own, change, s) for (part, own), s in zip(parts, shares, strict=True)
        )
        assert value <= problem.value(ModelState(found.coefficients, moved)) * (1 + 1e-12)


def test_states_side_by_side_are_those_one_by_one(system):
    problem, state, _, normal = system
    change, shares = normal.change(0.1, 0.7), np.array([0.9, 0.2])
    for group, own, part in zip(problem.groups, state.groups, normal.groups, strict=True):
        both = part.moved(own, change, shares)
        light = predict(group, both).light
        for number, share in enumerate(shares):
            one = part.moved(own, change, share)
            for name in ("shape", "light", "shift"):
                np.testing.assert_allclose(
                    getattr(both.at(number), name), getattr(one, name), atol=1e-12
                )
            np.testing.assert_allclose(light[number], predict(group, one).light, atol=1e-12)


def test_damping_shortens_the_step_of_the_coefficients(system):
    _, state, _, normal = system
    lengths = [
        np.linalg.norm(normal.step(state, damping, 1.0).coefficients - state.coefficients)
        for damping in (0.0, 1.0, 1e2, 1e4)
    ]
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[-1] < 1e-2 * lengths[0]


@pytest.mark.parametrize("known", [False, True], ids=["shapes free", "a shape known"])
def test_the_gradient_is_that_of_the_value(groups, known):
    # Without shifts: with them, the slope by which an edge shifts is not differentiated.
    problem = problem_of(groups)
    if known:
        problem = replace(problem, expected=expected_of(problem))
    state = away(problem, shift=0.0)
    gradient, at = dense(problem, state).gradient, as_vector(state)
    rng = np.random.default_rng(1)
    for _ in range(6):
        way = rng.standard_normal(at.size)
        up, down = (problem.value(as_state(at + s * way, state)) for s in (1e-7, -1e-7))
        assert (up - down) / 2e-7 == pytest.approx(way @ gradient, rel=1e-5)


def test_the_value_is_half_the_squares_of_all_residuals(groups):
    problem = problem_of(groups)
    problem = replace(problem, expected=expected_of(problem))
    state = away(problem)
    rest = ModelState(
        0 * state.coefficients, tuple(replace(g, shift=0 * g.shift) for g in state.groups)
    )
    misfit = sum(float(m.sum()) for m in problem.misfits(rest))
    known = problem.expected[1]
    misfit += known.precision * float(np.sum((rest.groups[1].shape - known.shape) ** 2))
    assert problem.value(rest) == pytest.approx(misfit / 2, rel=1e-12)
    assert [m.shape for m in problem.misfits(rest)] == [(4,), (3,)]


def starts(problem):
    truth = np.linalg.lstsq(
        problem.prior.directions.T,
        CURVE.to_intensity(np.linspace(0, 1, 513) ** 2) - problem.prior.mean,
        rcond=None,
    )[0]
    return {
        "the truth": initial(problem.groups, Family(problem.prior, truth)),
        "far away": away(problem, shift=0.6, size=2.0),
        "a curve that falls": away(problem, shift=0.0, size=6.0),
    }


@pytest.mark.parametrize("start", ["the truth", "far away", "a curve that falls"])
def test_descending_never_raises_the_value(groups, start):
    problem = problem_of(groups, prior=FULL)
    state = starts(problem)[start]
    value = problem.value(state)
    for _ in range(12):
        end = descend(problem, state, 1)
        assert end.value <= value
        # Several states at once are summed in another order than one.
        assert end.value == pytest.approx(problem.value(end.state), rel=1e-12)
        state, value = end.state, end.value


def test_all_starts_end_at_the_same_response(groups):
    problem = problem_of(groups, prior=FULL)
    ends = {name: descend(problem, state) for name, state in starts(problem).items()}
    assert all(end.settled for end in ends.values())
    best = ends["the truth"]
    for end in ends.values():
        # A search stops at gains of a thousandth, several of which may be left: a tenth of the
        # half that is a standard deviation.
        assert end.value == pytest.approx(best.value, abs=0.05)
        apart = end.state.coefficients - best.state.coefficients
        assert apart @ best.normal.hessian @ apart / 2 < 0.05


def test_a_search_cut_short_says_so(groups):
    problem = problem_of(groups)
    assert not descend(problem, away(problem), 1).settled
