"""Profiles of one edge stand side by side, whatever their order; what is absent does not count."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.estimate import NoiseModel
from napari_crfdeblur.estimate.likelihood.evidence import edge_groups
from napari_crfdeblur.estimate.likelihood.family import Family
from napari_crfdeblur.estimate.likelihood.model import initial, predict
from napari_crfdeblur.estimate.likelihood.problem import Problem, Shift
from napari_crfdeblur.profiles import ProfileSource
from napari_crfdeblur.response import Cameras, Gamma
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles

PRIOR = Cameras.DIGITAL.prior
CASE = ProfileCase(profiles=7, samples=19, falling=0.4)
# Photo, edge, channel: two photos have an edge 3; edge 9 has one channel, edge 3 of photo 1 two.
SOURCES = [(0, 3, 0), (1, 3, 0), (0, 9, 1), (0, 3, 2), (1, 3, 2), (0, 3, 1), (2, 0, 0)]
EDGES = [(0, 3), (0, 9), (1, 3), (2, 0)]
ROWS = [[0, 3, 5], [2], [1, 4], [6]]  # of each edge, in the order of the group


@pytest.fixture(scope="module")
def group():
    (drawn,) = random_profiles(Camera(Gamma(1.7), noise=0.005), CASE, seed=8)
    return replace(drawn, sources=tuple(ProfileSource(*s) for s in SOURCES))


@pytest.fixture(scope="module")
def edges(group):
    return edge_groups([group])[0]


def test_channels_of_one_edge_stand_side_by_side(group, edges):
    np.testing.assert_array_equal(edges.edges, EDGES)
    assert edges.intensity.shape == edges.variance.shape == (4, 3, 19 + 2)
    for edge, rows in enumerate(ROWS):
        assert edges.present[edge].tolist() == [slot < len(rows) for slot in range(3)]
        for slot, row in enumerate(rows):
            expected = [*group.intensity[row], *group.sides[row]]
            np.testing.assert_array_equal(edges.intensity[edge, slot], expected)
            expected = [*group.variance[row], *group.sides_variance[row]]
            np.testing.assert_array_equal(edges.variance[edge, slot], expected)


def test_samples_count_those_of_all_channels_and_sides(edges):
    np.testing.assert_array_equal(edges.samples, [3 * 21, 21, 2 * 21, 21])
    assert edges.step == 1


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_rows_may_come_in_any_order(group, edges, seed):
    order = np.random.default_rng(seed).permutation(len(group))
    (mixed,) = edge_groups([group.select(order)])
    np.testing.assert_array_equal(mixed.edges, edges.edges)
    np.testing.assert_array_equal(mixed.present, edges.present)
    for a, b in zip(mixed.intensity, edges.intensity, strict=True):
        np.testing.assert_array_equal(np.sort(a, axis=0), np.sort(b, axis=0))


def test_some_edges_can_be_selected(edges):
    some = edges.select(np.array([2, 0]))
    np.testing.assert_array_equal(some.edges, [EDGES[2], EDGES[0]])
    np.testing.assert_array_equal(some.intensity, edges.intensity[[2, 0]])
    np.testing.assert_array_equal(some.present, edges.present[[2, 0]])


def found(edges):
    """All that a problem says about edges at the first guess."""
    weights = NoiseModel().weights([edges])
    problem = Problem(PRIOR, [edges], weights, Shift(0.3, 0.1), [None])
    state = initial([edges], Family(PRIOR, np.full(PRIOR.size, 0.2)))
    return problem.value(state), problem.normal(state), state


@pytest.mark.parametrize("filling", [0.02, 0.97])
def test_what_stands_for_absent_channels_changes_nothing(edges, filling):
    absent = ~edges.present[..., np.newaxis]
    other = replace(
        edges,
        intensity=np.where(absent, np.linspace(filling, 0.6, 21), edges.intensity),
        variance=np.where(absent, 1e-9, edges.variance),
    )
    for weight in NoiseModel().weights([other]):
        assert np.all(weight[~edges.present] == 0)
        assert np.all(weight[edges.present] > 0)
    (value, normal, state), (value_2, normal_2, state_2) = found(edges), found(other)
    assert value == pytest.approx(value_2, rel=1e-12)
    np.testing.assert_allclose(state.groups[0].shape, state_2.groups[0].shape, atol=1e-14)
    scale = np.abs(normal.hessian).max()
    # Sums of the same numbers and of zeros.
    np.testing.assert_allclose(normal.hessian, normal_2.hessian, atol=1e-12 * scale)
    np.testing.assert_allclose(normal.gradient, normal_2.gradient, atol=1e-12 * scale)


def test_the_first_guess_has_sides_and_signs_of_its_profiles(edges):
    family = Family(PRIOR, np.zeros(PRIOR.size))
    (state,) = initial([edges], family).groups
    light = predict(edges, state).light
    shown = edges.present
    np.testing.assert_allclose(family.record(light)[shown][:, -2:], edges.intensity[shown][:, -2:])
    np.testing.assert_array_equal(
        np.sign(state.light[shown][:, 1]),
        np.sign(np.diff(edges.intensity[shown][:, -2:]))[:, 0],
    )
    assert set(np.sign(state.light[shown][:, 1])) == {-1, 1}
    assert np.isfinite(state.shape).all()
    np.testing.assert_array_equal(state.shift, 0)


@pytest.mark.parametrize("wrong", [{"floor": 0}, {"mismatch": -1}, {"freedom": 0}])
def test_an_impossible_noise_model_is_refused(wrong):
    with pytest.raises(ValueError, match=r"expected a (positive|mismatch of at least 0)"):
        NoiseModel(**wrong)


def test_noise_adds_to_what_was_measured_and_evidence_scales_it(edges):
    shown = edges.present
    (plain,) = NoiseModel(floor=0.01).weights([edges])
    np.testing.assert_allclose(plain[shown], 1 / (edges.variance[shown] + 0.01**2))
    (mismatched,) = NoiseModel(floor=0.01, mismatch=0.1).weights([edges])
    assert np.all(mismatched[shown] < plain[shown])
    (half,) = NoiseModel(floor=0.01).weights([edges], evidence=0.5)
    np.testing.assert_allclose(half, plain / 2)


def test_trust_falls_with_misfit_and_is_one_at_the_expected_misfit(edges):
    noise = NoiseModel(freedom=3)
    np.testing.assert_allclose(noise.trust(edges, edges.samples), 1)
    trust = noise.trust(edges, edges.samples * np.array([0.5, 1, 10, 1000]))
    assert np.all(np.diff(trust) < 0)
    assert trust.min() > 0
