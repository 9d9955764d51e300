"""The fit of a blurred picture's spectrum: derivatives, and the most likely values."""

import numpy as np
import pytest
from scipy import fft, optimize

from napari_crfdeblur.psf.spectral_fit import MIDDLE, SpectralFit

SHAPE = (90, 128)


def spectrum(white, falling, seed=0):
    """Half a power spectrum of a scene, blurred by a line, with errors; and what was passed."""
    frequency = np.hypot(fft.fftfreq(SHAPE[0])[:, None], fft.rfftfreq(SHAPE[1])[None])
    passed = np.sinc(11 * fft.rfftfreq(SHAPE[1])[None]) ** 2 * np.ones_like(frequency)
    frequency[0, 0] = 1
    expected = passed * 0.01 / frequency**2 + white + falling * (MIDDLE / frequency) ** 3
    return expected * np.random.default_rng(seed).exponential(size=expected.shape), passed


def logarithms(fit, seed=1):
    count = 2 + fit.cell.max() + 1
    return np.random.default_rng(seed).normal(np.log(fit.powers.mean()), 0.3, count)


@pytest.mark.parametrize("seed", range(3))
def test_derivatives(seed):
    fit = SpectralFit.of(*spectrum(0.003, 0.002, seed))
    at = logarithms(fit, seed)
    _, slopes = fit.unlikelihood(at)
    # a step ahead errs by half the step; steps both ways by their square, and rounding over them
    numeric = optimize.approx_fprime(at, lambda x: fit.unlikelihood(x)[0], 1e-7)
    np.testing.assert_allclose(slopes, numeric, atol=1e-6)
    for k, direction in enumerate(np.eye(len(at))):
        ahead, behind = (fit.unlikelihood(at + h * direction)[1] for h in (1e-5, -1e-5))
        np.testing.assert_allclose(fit.curvature(at)[k], (ahead - behind) / 2e-5, atol=1e-8)


@pytest.mark.parametrize(("white", "falling"), [(0.003, 0.0), (0.0, 0.003), (0.002, 0.004)])
def test_what_was_added_is_found(white, falling):
    found = SpectralFit.of(*spectrum(white, falling)).unexplained()
    # some 200 frequencies tell, of the picture's power in them some ten percent
    assert found**2 == pytest.approx(white + falling, rel=0.2)


@pytest.mark.parametrize("factor", [1e-8, 1e8])
def test_powers_have_any_unit(factor):
    powers, passed = spectrum(0.003, 0.001)
    found = SpectralFit.of(powers, passed).unexplained()
    scaled = SpectralFit.of(factor * powers, passed).unexplained()
    assert scaled**2 == pytest.approx(factor * found**2, rel=1e-6)
