"""An estimate that follows its profiles: what a full one finds nearby, and what it leaves to it."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.estimate import Finding, MaximumLikelihood, ResponseStatus, estimate_response
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import line
from napari_crfdeblur.response import Cameras
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles

PRIOR = Cameras.DIGITAL.prior
CURVE = PRIOR.curve(np.linspace(0.8, -0.8, PRIOR.size))
LEVELS = np.linspace(0.1, 0.9, 81)
# Of irradiance. What noise alone moves a curve of so few edges: a full estimate ends where a
# step gains a thousandth, a live one where it gains 1, and keeps the evidence of the last.
NEAR = 2e-3


def drawn(seed=0, **kinds):
    case = ProfileCase(**{"groups": 3, "profiles": 14, "samples": 23, "falling": 0.4} | kinds)
    return random_profiles(Camera(CURVE, noise=0.004), case, seed=seed)


def light(estimate):
    return estimate.curve.to_irradiance(LEVELS)


def without(groups, number, rows):
    left = np.delete(np.arange(len(groups[number])), rows)
    return [g.select(left) if n == number else g for n, g in enumerate(groups)]


@pytest.fixture(scope="module")
def groups():
    return drawn()


@pytest.fixture(scope="module")
def fit(groups):
    return drain(MaximumLikelihood().fitting(groups)).fits[0]


def test_the_estimate_to_be_followed_is_that_of_the_verb(fit, groups):
    np.testing.assert_array_equal(
        light(fit.estimate), light(estimate_response(groups, MaximumLikelihood()))
    )


def test_the_same_profiles_lead_to_the_same_response(fit, groups):
    np.testing.assert_allclose(light(fit.refit(groups).estimate), light(fit.estimate), atol=3e-4)


@pytest.mark.parametrize(("number", "rows"), [(0, [3]), (2, [0, 5, 13]), (1, range(14))])
def test_without_some_edges_it_is_close_to_a_full_estimate(fit, groups, number, rows):
    left = [g for g in without(groups, number, rows) if len(g)]
    live, full = fit.refit(left).estimate, estimate_response(left, MaximumLikelihood())
    np.testing.assert_allclose(light(live), light(full), atol=NEAR)
    assert live.status is full.status
    assert live.findings == full.findings
    assert live.diagnostics["profiles"] == full.diagnostics["profiles"]
    assert live.covered == full.covered


@pytest.mark.parametrize(("number", "rows"), [(0, [3]), (2, [0, 5, 13]), (1, range(14))])
def test_with_edges_more_it_is_close_to_a_full_estimate(fit, groups, number, rows):
    left = [g for g in without(groups, number, rows) if len(g)]
    live = drain(MaximumLikelihood().fitting(left)).fits[0].refit(groups).estimate
    np.testing.assert_allclose(light(live), light(fit.estimate), atol=NEAR)
    assert live.status is fit.estimate.status


@pytest.mark.parametrize(("number", "rows"), [(0, [3]), (2, [0, 5, 13])])
def test_the_misfit_is_that_of_the_state_it_has_come_to(fit, groups, number, rows):
    live = fit.refit(without(groups, number, rows))
    problem = live.found.problem
    plain = replace(problem, weights=live.noise.weights(problem.groups))
    misfits = np.concatenate(plain.misfits(live.found.state))
    samples = np.concatenate([group.samples for group in problem.groups])
    expected = np.sqrt(np.median(misfits / samples))
    assert live.estimate.diagnostics["misfit"] == pytest.approx(expected, rel=1e-12)


def test_edges_that_go_and_come_again_leave_no_trace(fit, groups):
    live = fit
    for number, row in ((0, 2), (1, 7), (2, 13), (0, 5)):
        live = live.refit(without(groups, number, [row])).refit(groups)
    np.testing.assert_allclose(light(live.estimate), light(fit.estimate), atol=NEAR)


def test_a_bad_edge_that_is_added_hardly_counts(fit, groups):
    bad = np.array(groups[1].intensity)
    bad[4, 15:] *= 0.6
    spoilt = [groups[0], replace(groups[1], intensity=bad), groups[2]]
    live = fit.refit(spoilt)
    np.testing.assert_allclose(light(live.estimate), light(fit.estimate), atol=NEAR)
    weight = live.found.problem.weights[1].mean(axis=(1, 2))
    assert weight[4] < 0.2 * np.delete(weight, 4).min()


def test_the_order_of_groups_and_edges_does_not_matter(fit, groups):
    mixed = [g.select(np.roll(np.arange(len(g)), 4)) for g in groups[::-1]]
    # The same sums in another order.
    np.testing.assert_allclose(
        light(fit.refit(mixed).estimate), light(fit.refit(groups).estimate), atol=1e-6
    )


def test_numbers_of_edges_are_no_names(fit, groups):
    renamed = [
        replace(g, sources=tuple(replace(s, edge=s.edge + 40) for s in g.sources)) for g in groups
    ]
    np.testing.assert_allclose(
        light(fit.refit(renamed).estimate), light(fit.refit(groups).estimate), atol=1e-9
    )


def test_edges_that_are_sampled_anew_are_known_by_their_sides(fit, groups):
    coarse = [
        replace(
            g,
            position=g.position[1:-1],
            intensity=g.intensity[:, 1:-1],
            variance=g.variance[:, 1:-1],
            count=g.count[:, 1:-1],
        )
        for g in groups
    ]
    live = fit.refit(coarse)
    assert live is not None
    full = estimate_response(coarse, MaximumLikelihood())
    np.testing.assert_allclose(light(live.estimate), light(full), atol=NEAR)


def test_other_profiles_ask_for_a_full_estimate(fit, groups):
    assert fit.refit(drawn(seed=5)) is None
    assert fit.refit([*groups, *drawn(seed=5, groups=4)]) is None
    assert fit.refit([*groups, *drawn(seed=5, groups=2)]) is not None


def test_without_contrast_it_is_what_was_assumed(fit, groups):
    flat = [replace(g, sides=np.full_like(g.sides, 0.5)) for g in groups]
    for none in (flat, []):
        live = fit.refit(none)
        assert live.estimate.status is ResponseStatus.CANNOT_TELL
        assert live.estimate.findings == (Finding.NO_EDGES,)
        np.testing.assert_allclose(
            light(live.estimate), light(estimate_response(none, MaximumLikelihood()))
        )
        assert live.refit(groups) is None


def test_too_few_edges_are_found_out_at_once(groups):
    fit = drain(MaximumLikelihood().fitting([groups[0].select(np.arange(7))])).fits[0]
    assert Finding.FEW_EDGES not in fit.estimate.findings
    live = fit.refit([groups[0].select(np.arange(5))])
    assert Finding.FEW_EDGES in live.estimate.findings
    assert live.estimate.status is not ResponseStatus.GOOD


def test_a_contradiction_stays_until_a_full_estimate(fit, groups):
    doubtful = replace(fit.estimate, findings=(Finding.CONTRADICTION,))
    live = replace(fit, estimate=doubtful).refit(groups)
    assert Finding.CONTRADICTION in live.estimate.findings
    assert live.estimate.status is ResponseStatus.DOUBTFUL


def test_a_search_without_end_stays_one(fit, groups):
    unsettled = replace(fit, found=replace(fit.found, settled=False))
    assert unsettled.refit(groups).estimate.status is ResponseStatus.NOT_CONVERGED


def test_a_known_psf_gives_the_shape_of_new_groups_too(groups):
    method = MaximumLikelihood(psf=line(9, 0.3))
    live = drain(method.fitting(groups[:2])).fits[0].refit(groups)
    expected = live.found.problem.expected
    assert len(expected) == 3
    assert all(each is not None and each.shape.shape == (23,) for each in expected)
    assert live.refit(groups[1:]).estimate.diagnostics["groups"] == 2
