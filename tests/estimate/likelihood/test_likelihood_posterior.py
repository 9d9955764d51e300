"""What is known after the fit: its spread in irradiance, and what edges cannot tell of it."""

import numpy as np
import pytest

from napari_crfdeblur.estimate.likelihood.posterior import WIDENED, ResponsePosterior
from napari_crfdeblur.response import Cameras

INTENSITY = np.linspace(0, 1, 41)
PRIORS = [cameras.prior for cameras in Cameras]


def drawn(prior, seed, spread=0.3):
    """A posterior in the middle of the family, its covariance of any directions."""
    rng = np.random.default_rng(seed)
    roots = spread * rng.standard_normal((prior.size, prior.size)) / np.sqrt(prior.size)
    return ResponsePosterior(prior, 0.3 * rng.standard_normal(prior.size), roots @ roots.T)


@pytest.mark.parametrize("prior", PRIORS, ids=[c.name for c in Cameras])
@pytest.mark.parametrize("covered", [(0.0, 1.0), (0.2, 0.7), (0.05, 0.95)])
def test_nothing_is_open_at_black_and_white(prior, covered):
    deviation = drawn(prior, 1).deviation(INTENSITY, covered)
    assert np.all(np.isfinite(deviation))
    np.testing.assert_allclose(deviation[[0, -1]], 0, atol=1e-12)
    assert np.all(deviation[1:-1] > 0)


@pytest.mark.parametrize("seed", range(3))
def test_the_spread_is_that_of_curves_that_are_drawn(seed):
    posterior = drawn(Cameras.DORF.prior, seed, spread=0.01)
    rng = np.random.default_rng(seed)
    inside = np.linspace(0.2, 0.8, 129)
    root = np.linalg.cholesky(WIDENED * posterior.covariance + 1e-15 * np.eye(12))
    curves = np.array(
        [
            posterior.prior.curve(
                posterior.coefficients + root @ rng.standard_normal(12)
            ).to_irradiance(inside)
            for _ in range(4000)
        ]
    )
    center = posterior.prior.curve(posterior.coefficients).to_irradiance(inside)
    aligned = np.linalg.qr(np.stack([np.ones_like(center), center], axis=1)).Q
    apart = curves - center
    apart = apart - (apart @ aligned) @ aligned.T
    # 4000 draws tell a deviation to 1 %; small ones, so that the curve follows to first order.
    expected = posterior.expected_error((0.2, 0.8))
    assert expected == pytest.approx(np.sqrt(np.mean(apart**2)), rel=0.05)


def test_offset_and_scale_are_more_open_than_computed():
    posterior, covered = drawn(Cameras.DIGITAL.prior, 4), (0.2, 0.8)
    inside = np.linspace(*covered, 129)
    deviation = posterior.deviation(inside, covered)
    assert np.sqrt(np.mean(deviation**2)) > 2 * posterior.expected_error(covered)


def test_what_is_known_of_the_next_photo_is_never_less():
    prior = Cameras.DIGITAL.prior
    light = np.linspace(0, 1, 101)
    np.testing.assert_allclose(
        ResponsePosterior.before(prior).narrowed.deviation(light),
        prior.deviation(light),
        atol=1e-12,
    )
    for spread in (0.05, 0.5, 5.0):
        narrowed = drawn(prior, 2, spread).narrowed
        assert np.all(narrowed.deviation(light) <= prior.deviation(light) + 1e-12)
