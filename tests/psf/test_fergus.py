from dataclasses import replace

import numpy as np
import pytest
from blurred_shapes import blurred
from scipy import integrate

from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.psf.blind.blurred import Blurred
from napari_crfdeblur.psf.blind.fergus.ensemble import Ensemble, MeasuredGradient, System
from napari_crfdeblur.psf.blind.fergus.kernel_posterior import KernelPosterior
from napari_crfdeblur.psf.blind.fergus.priors import ExponentialMixture, GaussianMixture

GRADIENTS = GaussianMixture()


def small_problem() -> tuple[MeasuredGradient, Ensemble, ExponentialMixture]:
    photo = blurred(camera_shake(7, 3), 50, 66).astype(np.float32)
    clipped = np.zeros(photo.shape, bool)
    clipped[20:25, 30:40] = True
    measured = MeasuredGradient.of(Blurred.of(photo, clipped, 7), 7)
    start = Ensemble.start(measured, np.full((7, 7), 1 / 49), 0.3 * measured.energy)
    return measured, start, ExponentialMixture.for_size(7)


def test_no_update_raises_the_free_energy() -> None:
    measured, ensemble, prior = small_problem()
    ensemble = ensemble.sharpened(measured, GRADIENTS).fitted(prior)
    energy = ensemble.free_energy(measured, GRADIENTS, prior)
    start = energy
    for step in range(24):
        updated = (
            ensemble.fitted(prior),
            ensemble.sharpened(measured, GRADIENTS),
            ensemble.with_noise(measured, 0.85),
        )
        ensemble = updated[step % 3]
        after = ensemble.free_energy(measured, GRADIENTS, prior)
        # the gradients are of single precision: a millionth of the energy is rounding
        assert after <= energy + 1e-6 * abs(energy)
        energy = after
    assert energy < start - 100


def test_the_noise_is_the_one_of_least_free_energy() -> None:
    measured, ensemble, prior = small_problem()
    ensemble = ensemble.sharpened(measured, GRADIENTS).fitted(prior).with_noise(measured)

    def energy(factor: float) -> float:
        other = replace(ensemble, noise=factor * ensemble.noise)
        return other.free_energy(measured, GRADIENTS, prior)

    assert energy(1) < min(energy(0.9), energy(1.1))


def test_what_was_not_measured_does_not_matter() -> None:
    photo = blurred(camera_shake(7, 3), 50, 66).astype(np.float32)
    clipped = np.zeros(photo.shape, bool)
    clipped[20:25, 30:40] = True
    first = MeasuredGradient.of(Blurred(photo, 1.0 - clipped), 7)
    assert first.known.sum() == 49 * 66 + 50 * 65 - 2 * clipped.sum()
    assert not first.values[~first.known].any()


def test_the_system_is_the_normal_equations() -> None:
    random = np.random.default_rng(2)
    transfer = np.fft.rfft2(random.normal(size=(12, 15)))
    precision = random.uniform(1, 2, (2, 12, 15))
    system = System(transfer, np.abs(transfer) ** 2 / 0.5, precision)
    values = random.normal(size=(2, 12, 15))
    once = np.fft.irfft2(np.fft.rfft2(values) * transfer, (12, 15))
    twice = np.fft.irfft2(np.fft.rfft2(once) * np.conj(transfer), (12, 15))
    expected = twice / 0.5 + precision * values
    # both in double precision
    np.testing.assert_allclose(system.product(values), expected, rtol=1e-10, atol=1e-8)


@pytest.mark.parametrize("slope", [-3000.0, -40.0, -1.0, 0.0, 6.0, 60.0])
def test_the_moments_are_those_of_a_rectified_gaussian(slope: float) -> None:
    """One pixel: ``a = own + spread``, ``b = cross - rate`` for noise of variance 1."""
    prior = ExponentialMixture((1.0,), (1.0,))
    start = KernelPosterior.known(np.full((1, 1), 0.2))
    own, cross = np.full((1, 1), 3.0), np.full((1, 1), slope + 1)
    found = start.updated(own, cross, 2.0, 1.0, prior)

    def density(k: float) -> float:
        return float(np.exp(-2.5 * k * k + slope * k - top))

    mode = max(slope / 5, 0.0)
    top = -2.5 * mode**2 + slope * mode
    reach = mode + (12 / np.sqrt(5) if slope > -1 else 40 / -slope)
    volume, mean, second = (
        integrate.quad(lambda k, n=n: k**n * density(k), 0, reach, points=[mode], epsabs=0)[0]
        for n in range(3)
    )
    assert found.mean[0, 0] == pytest.approx(mean / volume, rel=1e-6)
    spread = second / volume - (mean / volume) ** 2
    assert found.variance[0, 0] == pytest.approx(spread, rel=1e-4)
    entropy = np.log(volume) + top - slope * found.mean[0, 0] + 2.5 * second / volume
    assert found.energy == pytest.approx(-entropy, rel=1e-6, abs=1e-6)


def test_a_mixture_of_one_gaussian_has_its_precision() -> None:
    one = GaussianMixture((1.0,), (0.1,))
    square = np.array([0.0, 0.01, 4.0])
    precision, bound = one.precision(square)
    np.testing.assert_allclose(precision, 100)
    assert bound == pytest.approx(np.sum(-50 * square - np.log(np.sqrt(2 * np.pi) * 0.1)))


def test_large_gradients_are_held_less() -> None:
    precision, _ = GRADIENTS.precision(np.array([0, 1e-4, 1e-2, 1, 100], np.float32))
    assert (np.diff(precision[:-1]) < 0).all()
    # far out only the widest is left
    assert precision[-1] == pytest.approx(1 / GRADIENTS.deviations[-1] ** 2, rel=1e-5)


def test_faint_pixels_of_a_psf_are_pressed_harder() -> None:
    rate, _ = ExponentialMixture.for_size(15).rate(np.array([0.0, 1e-3, 0.1]))
    assert (np.diff(rate) < 0).all()
