"""The job around an estimate: progress, stopping, the band, and the same result each time."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.estimate import (
    GivenResponse,
    KnownPsf,
    MeanProfile,
    PolynomialFit,
    RankMinimization,
    ResponseStatus,
    estimate_response,
    estimating_response,
)
from napari_crfdeblur.estimate.band import band, covered_range, prior_band
from napari_crfdeblur.profiles import ProfileSource
from napari_crfdeblur.progress import drain
from napari_crfdeblur.response import SRGB, Gamma, dorf_mean
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles

FEW = PolynomialFit(resamples=4)
GROUPS = random_profiles(Camera(Gamma(1.6), noise=0.004), ProfileCase(groups=2), seed=3)
METHODS = [RankMinimization(polynomial=FEW), MeanProfile(FEW), KnownPsf(np.eye(7), polynomial=FEW)]
each_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)


@each_method
def test_the_same_profiles_give_the_same_estimate(method):
    a, b = estimate_response(GROUPS, method), estimate_response(GROUPS, method)
    np.testing.assert_array_equal(
        a.curve.to_irradiance(a.intensity), b.curve.to_irradiance(a.intensity)
    )
    np.testing.assert_array_equal([a.lower, a.upper], [b.lower, b.upper])
    assert a.diagnostics == b.diagnostics


@each_method
def test_progress_never_goes_back_and_comes_to_its_end(method):
    reports = []
    drain(estimating_response(GROUPS, method), reports.append)
    assert {r.stage for r in reports} == {"response", "band of the response"}
    resamples = [r for r in reports if r.stage == "band of the response"]
    assert [(r.done, r.total) for r in resamples] == [(i, 4) for i in range(4)]
    assert (reports[0].done, reports[-1].done, reports[-1].total) == (0, 1, 1)


@each_method
def test_closing_the_job_stops_it(method):
    job = estimating_response(GROUPS, method)
    assert next(job).stage == "response"
    next(job)
    job.close()
    with pytest.raises(StopIteration):
        next(job)


def test_no_resamples_leave_a_band_only_where_no_edge_speaks():
    estimate = estimate_response(GROUPS, MeanProfile(PolynomialFit(resamples=0)))
    low, high = estimate.covered
    inside = (estimate.intensity >= low) & (estimate.intensity <= high)
    width = estimate.upper - estimate.lower
    np.testing.assert_array_equal(width[inside], 0)
    assert width[~inside].max() > 0


@each_method
def test_the_band_contains_the_estimate(method):
    estimate = estimate_response(GROUPS, method)
    center = estimate.curve.to_irradiance(estimate.intensity)
    # The mirror of rounding: the band is the estimate plus and minus a width, clipped.
    assert np.all(estimate.lower <= center + 1e-15)
    assert np.all(estimate.upper >= center - 1e-15)
    assert estimate.lower.min() >= 0
    assert estimate.upper.max() <= 1


def test_the_band_widens_beyond_the_covered_range():
    def middle(rng, rows):
        return 0.3 + 0.3 * np.sort(rng.random((rows, 2)), axis=1)

    groups = random_profiles(Camera(Gamma(1.6), noise=0.002), ProfileCase(levels=middle), seed=3)
    estimate = estimate_response(groups, RankMinimization(polynomial=FEW))
    low, high = estimate.covered
    beyond_low = np.searchsorted(estimate.intensity, low) - 1
    width = estimate.upper - estimate.lower
    prior = np.subtract(*prior_band(estimate.intensity)[::-1])
    assert width[beyond_low] >= 0.99 * prior[beyond_low]
    beyond_high = np.searchsorted(estimate.intensity, high, side="right")
    assert width[beyond_high] >= 0.99 * prior[beyond_high]


def test_band_is_two_deviations_of_the_resampled_curves():
    intensity = np.linspace(0, 1, 11)
    center = intensity**2
    off = 0.01 * np.sin(np.pi * intensity)
    lower, upper = band(intensity, np.array([center - off, center + off]), center, (0, 1))
    np.testing.assert_allclose(upper - center, 1.96 * off, atol=1e-15)
    np.testing.assert_allclose(center - lower, np.minimum(1.96 * off, center), atol=1e-15)


def test_band_of_the_prior_lies_about_the_dorf_mean_and_closes_at_the_ends():
    intensity = np.linspace(0, 1, 33)
    lower, upper = prior_band(intensity)
    np.testing.assert_allclose((lower + upper) / 2, dorf_mean().to_irradiance(intensity))
    np.testing.assert_allclose((upper - lower)[[0, -1]], 0, atol=1e-12)
    assert np.all(upper[1:-1] > lower[1:-1])


def test_covered_range_is_that_of_all_but_the_outermost_samples():
    low, high = covered_range(GROUPS)
    samples = np.concatenate([g.intensity.ravel() for g in GROUPS])
    outside = np.mean((samples < low) | (samples > high))
    assert 0 < outside < 0.025  # two times 1 %, and one sample each side


def test_estimates_are_read_only():
    estimate = estimate_response(GROUPS, MeanProfile(FEW))
    with pytest.raises(ValueError, match="read-only"):
        estimate.lower[0] = 1


@pytest.mark.parametrize("groups", [GROUPS, []], ids=["profiles", "no profiles"])
def test_a_given_response_covers_what_the_profiles_do(groups):
    estimate = estimate_response(groups, GivenResponse(Gamma(2.2)))
    assert estimate.status is ResponseStatus.GIVEN
    assert estimate.covered == (covered_range(groups) if groups else (0, 1))
    np.testing.assert_array_equal(estimate.lower, estimate.upper)
    np.testing.assert_array_equal(estimate.lower, estimate.intensity**2.2)


@pytest.mark.parametrize("degree", [1, 3, 7])
def test_any_degree_can_be_asked_for(degree):
    fit = PolynomialFit(degree, resamples=0)
    estimate = estimate_response(GROUPS, MeanProfile(fit))
    assert estimate.curve.to_irradiance(1) == 1


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"degree": 0}, "degree of at least 1"),
        ({"boundary_weight": -1}, "weight of at least 0"),
        ({"monotone_weight": -0.1}, "weight of at least 0"),
        ({"resamples": -1}, "resamples of at least 0"),
    ],
)
def test_impossible_settings_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        PolynomialFit(**wrong)


@pytest.mark.parametrize("shift", [-1, float("inf"), float("nan")])
def test_an_impossible_shift_is_refused(shift):
    with pytest.raises(ValueError, match="shift in pixels of at least 0"):
        KnownPsf(np.ones((3, 5)), shift)


def own_edges(groups):
    """The groups as if every one were another edge, its rows the channels of that edge."""
    return [
        replace(g, sources=tuple(ProfileSource(0, number, c) for c in range(len(g))))
        for number, g in enumerate(groups)
    ]


@pytest.mark.parametrize("method", [RankMinimization(), MeanProfile()], ids=["rank", "mean"])
def test_groups_of_one_edge_each_have_a_band_too(method):
    groups = random_profiles(Camera(SRGB(), noise=0.005), ProfileCase(groups=9, profiles=3), seed=3)
    estimate = estimate_response(own_edges(groups), method)
    inside = (estimate.intensity > 0.3) & (estimate.intensity < 0.7)
    assert np.all((estimate.upper - estimate.lower)[inside] > 1e-4)


def test_edges_that_disagree_leave_the_estimate_in_doubt():
    agreeing = random_profiles(Camera(SRGB(), noise=0.003), ProfileCase(groups=6), seed=3)
    assert estimate_response(agreeing, RankMinimization()).status is ResponseStatus.GOOD
    spoilt = random_profiles(Camera(SRGB(), noise=0.003), ProfileCase(profiles=5, bad=0.8), seed=3)
    assert estimate_response(spoilt, RankMinimization()).status is ResponseStatus.DOUBTFUL


@pytest.mark.parametrize("method", [RankMinimization(), MeanProfile()], ids=["rank", "mean"])
def test_small_groups_survive_being_drawn_again(method):
    groups = random_profiles(Camera(SRGB(), noise=0.005), ProfileCase(groups=4, profiles=3), seed=5)
    few = [groups[0], *(group.select([0, 1]) for group in groups[1:])]
    estimate = estimate_response(few, method)
    assert np.isfinite(estimate.lower).all()
    assert np.isfinite(estimate.upper).all()
