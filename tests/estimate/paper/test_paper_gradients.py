"""Analytic gradients agree with finite differences, for tall and for wide groups."""

import numpy as np
import pytest

from napari_crfdeblur.estimate import RankMinimization, RowScale, Tail
from napari_crfdeblur.estimate.paper import polynomial
from napari_crfdeblur.estimate.paper.mean_profile import _distance_to_mean, distance_to
from napari_crfdeblur.estimate.paper.rows import PolynomialRows
from napari_crfdeblur.estimate.paper.search import Terms
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles

CAMERA = Camera(Gamma(1.8), noise=0.01)
TALL = ProfileCase(profiles=31, samples=13, falling=0.4)
WIDE = ProfileCase(profiles=5, samples=23, falling=0.4)
SQUARE = ProfileCase(profiles=12, samples=12, falling=0.4)
shapes = pytest.mark.parametrize("case", [TALL, WIDE, SQUARE], ids=["tall", "wide", "square"])

MEAN = polynomial.dorf_mean_coefficients(5)
RISING = MEAN + np.array([0.01, 0.02, -0.05, 0.04, 0.01, -0.02])
WAVY = np.array([0.1, 1.0, -3.5, 3.0, 0.2, 0.1])  # falls in the middle of the range


def to_mean(rows, a):
    return _distance_to_mean(rows, a)


def to_one_spread(rows, a):
    return distance_to(np.linspace(0, 1, rows.group.position.size) ** 2, rows, a)


def to_own_spreads(rows, a):
    shape = rows.group.intensity.shape
    return distance_to(np.random.default_rng(3).random(shape), rows, a)


def to_own_spreads_bounded(rows, a):
    shape = rows.group.intensity.shape
    return distance_to(np.random.default_rng(3).random(shape), rows, a, 0.3)


DATA_TERMS = {
    "Eq. 5": to_mean,
    "Eq. 4, one spread": to_one_spread,
    "Eq. 4, a spread for each profile": to_own_spreads,
    "Eq. 4, bounded": to_own_spreads_bounded,
    **{
        f"{tail.name}, {scale.name}": RankMinimization(tail, scale)._distance
        for tail in Tail
        for scale in RowScale
    },
}
data_terms = pytest.mark.parametrize("data", DATA_TERMS.values(), ids=DATA_TERMS)


def differences(function, at):
    """Central differences; a step of 1e-5 leaves 1e-10 of curvature and of rounding."""
    steps = 1e-5 * np.eye(at.size)
    return np.array([(function(at + s)[0] - function(at - s)[0]) / 2e-5 for s in steps])


def agree(function, at):
    gradient = function(at)[1]
    np.testing.assert_allclose(
        gradient, differences(function, at), rtol=1e-5, atol=1e-6 * np.abs(gradient).max()
    )


@shapes
@data_terms
def test_gradient_of_a_data_term(data, case):
    (group,) = random_profiles(CAMERA, case, seed=2)
    rows = PolynomialRows(group, 5)
    agree(lambda a: data(rows, a), RISING)


@data_terms
def test_gradient_of_all_terms_over_groups_of_unlike_size(data):
    groups = random_profiles(CAMERA, TALL, seed=2) + random_profiles(CAMERA, WIDE, seed=5)
    agree(Terms(data, 100, 10).objective([PolynomialRows(g, 5) for g in groups]), RISING)


@pytest.mark.parametrize("coefficients", [RISING, WAVY], ids=["rising", "wavy"])
@pytest.mark.parametrize("penalty", [polynomial.boundary, polynomial.falling_steps])
def test_gradient_of_a_penalty(penalty, coefficients):
    agree(penalty, coefficients)


def test_penalties_are_what_the_paper_asks_for():
    assert polynomial.boundary(np.array([0.0, 0.5, 0.5]))[0] == 0
    assert polynomial.boundary(np.array([0.2, 0.5, 0.6]))[0] == pytest.approx(0.2**2 + 0.3**2)
    assert polynomial.falling_steps(RISING)[0] == 0
    # The line -I falls by the average step in each of the 255 steps.
    assert polynomial.falling_steps(np.array([1.0, -1.0]))[0] == pytest.approx(255)


@shapes
@pytest.mark.parametrize("scale", RowScale)
@pytest.mark.parametrize("tail", Tail)
def test_rank_is_blind_to_an_affine_change_of_the_response(tail, scale, case):
    (group,) = random_profiles(CAMERA, case, seed=2)
    rows, data = PolynomialRows(group, 5), RankMinimization(tail, scale)._distance
    changed = 0.4 * RISING + 0.3 * np.eye(6)[0]
    assert data(rows, changed)[0] == pytest.approx(data(rows, RISING)[0], rel=1e-9)


@shapes
def test_distance_to_the_mean_is_blind_to_an_affine_change_of_the_response(case):
    (group,) = random_profiles(CAMERA, case, seed=2)
    rows = PolynomialRows(group, 5)
    changed = 0.4 * RISING + 0.3 * np.eye(6)[0]
    expected = _distance_to_mean(rows, RISING)[0]
    assert _distance_to_mean(rows, changed)[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("tail", Tail)
def test_ratio_of_singular_values_is_that_of_numpy(tail):
    (group,) = random_profiles(CAMERA, TALL, seed=2)
    rows = PolynomialRows(group, 5)
    values = np.linalg.svd(rows.raw(RISING), compute_uv=False)
    rest = values[1] if tail is Tail.SECOND else values[1:].sum()
    found, _ = RankMinimization(tail, RowScale.RAW)._distance(rows, RISING)
    assert found == pytest.approx(rest / values[0], rel=1e-9)


def test_the_rows_are_those_of_the_paper():
    (group,) = random_profiles(CAMERA, WIDE, seed=2)
    rows = PolynomialRows(group, 5)
    light = np.polynomial.polynomial.polyval(group.intensity, RISING)
    sides = np.polynomial.polynomial.polyval(group.sides, RISING)
    ranges = np.diff(sides, axis=1)
    np.testing.assert_allclose(rows.offsets(RISING), sides[:, 0], rtol=1e-12)
    np.testing.assert_allclose(rows.ranges(RISING), ranges[:, 0], rtol=1e-12)
    np.testing.assert_allclose(rows.raw(RISING), light - sides[:, :1], atol=1e-14)
    np.testing.assert_allclose(rows.scaled(RISING), (light - sides[:, :1]) / ranges, atol=1e-13)


@pytest.mark.parametrize("degree", [1, 5, 9])
def test_powers_and_the_change_of_variables(degree):
    levels = np.linspace(0, 1, polynomial.LEVELS)
    samples = polynomial.powers(levels, degree)
    np.testing.assert_allclose(samples, levels[:, None] ** np.arange(degree + 1), rtol=1e-13)
    scaled = samples @ polynomial.well_scaled(degree)
    total = scaled.T @ scaled / polynomial.LEVELS
    total += polynomial.ENDS_WEIGHT * scaled[[0, -1]].T @ scaled[[0, -1]]
    # Powers up to the ninth depend on each other to 1e-7.
    np.testing.assert_allclose(total, np.eye(degree + 1), atol=1e-7)
