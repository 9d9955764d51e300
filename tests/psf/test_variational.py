import numpy as np
import pytest
from blurred_shapes import blurred, scene
from scipy import fft, ndimage
from scipy.signal import fftconvolve

from napari_crfdeblur.psf import PsfStatus, Variational, camera_shake, estimate_psf
from napari_crfdeblur.psf.blind.blurred import Blurred
from napari_crfdeblur.psf.blind.gradient_noise import noise_of_gradients
from napari_crfdeblur.psf.blind.variational.extent import off_middle, roomy, trimmed
from napari_crfdeblur.psf.blind.variational.gradients import (
    BlurredGradient,
    GradientPosterior,
    soft_point,
)
from napari_crfdeblur.psf.blind.variational.nonnegative import NonnegativeFit
from napari_crfdeblur.quality import kernel_similarity


def test_a_clear_case_is_good() -> None:
    estimate = estimate_psf(blurred(camera_shake(9, 3), 200, 260), Variational(size=9))
    assert estimate.status is PsfStatus.GOOD


def test_the_faint_end_of_a_long_psf_is_kept() -> None:
    truth = np.zeros((21, 21))
    truth[17:20, 2:5] = 1 / 12  # where the center of mass is
    truth[np.arange(2, 17), np.arange(4, 19)[::-1]] = 0.25 / 15
    found = estimate_psf(blurred(truth, 140, 180, noise=0.001), Variational(size=21)).psf
    rows = np.flatnonzero(found.sum(axis=1) > 0.005)
    assert np.ptp(rows) + 1 >= 15


@pytest.mark.parametrize("softness", [0.0, 0.6], ids=["crisp", "soft"])
def test_a_crisp_and_a_soft_picture_give_about_the_same_width(softness: float) -> None:
    truth = camera_shake(11, 8)
    sharp = ndimage.gaussian_filter(scene(140, 180), softness)
    photo = fftconvolve(sharp, truth, mode="valid")
    photo += np.random.default_rng(1).normal(0, 0.003, photo.shape)
    found = estimate_psf(photo, Variational(size=11)).psf
    # As many equal pixels have this sum of squares. How soft the picture was cannot be known:
    # half as much is assumed, which makes the PSF thinner by an eighth or thicker by a half.
    assert 0.8 < np.square(truth).sum() / np.square(found).sum() < 1.6
    assert kernel_similarity(found, truth) > 0.95


def test_noise_is_measured_beside_edges() -> None:
    photo = Blurred(blurred(camera_shake(15, 8), 150, 180, noise=0.01).astype(np.float32))
    # edges add to it, if little; 150 x 180 pixels leave a percent of chance
    assert noise_of_gradients(photo) == pytest.approx(0.01 * np.sqrt(2), rel=0.1)


def test_trimming_takes_nothing_but_zeros_and_keeps_the_center() -> None:
    psf = np.zeros((13, 13))
    psf[6, 2], psf[5, 6] = 0.25, 0.75
    small = trimmed(psf, 5)
    assert small.shape == (9, 9)
    assert small[4, 0] == 0.25
    assert small[3, 4] == 0.75
    assert trimmed(psf, 11).shape == (11, 11)
    np.testing.assert_array_equal(roomy(small, 13), psf)


def test_the_middle_is_that_of_the_extent() -> None:
    psf = np.zeros((11, 11))
    psf[8, 1:8] = [0.7, 0.1, 0.04, 0.04, 0.04, 0.04, 0.04]
    assert off_middle(psf) == (3, -1)


def test_the_true_psf_makes_the_picture_likelier_than_a_wrong_one() -> None:
    truth = camera_shake(9, 3)
    soft = ndimage.gaussian_filter(blurred(truth, 90, 120, noise=0), 0.6)
    soft += np.random.default_rng(1).normal(0, 0.003, soft.shape)
    gradients = BlurredGradient.of(Blurred(soft.astype(np.float32)), 9, 0.63)
    energies = []
    for psf in (truth, truth[::-1, ::-1], np.ones((1, 1))):
        sharp = gradients.unknown()
        for _ in range(6):
            sharp = gradients.posterior(psf, 0.008, sharp)
        energies.append(gradients.energy(psf, 0.008, sharp))
    assert energies[0] == min(energies)


def test_another_softness_is_assumed_of_the_same_picture() -> None:
    photo = Blurred(blurred(camera_shake(5, 4), 40, 50).astype(np.float32))
    first, other = (BlurredGradient.of(photo, 5, softness) for softness in (0.5, 0.3))
    changed = first.assuming(0.3)
    np.testing.assert_array_equal(changed.softness, other.softness)
    np.testing.assert_array_equal(changed.measured, first.measured)
    offsets = np.arange(-1, 2)
    assert changed.softness.sum(axis=1) @ offsets**2 == pytest.approx(0.3**2)


def test_a_psf_and_the_softness_count_together() -> None:
    photo = Blurred(blurred(camera_shake(5, 4), 60, 70).astype(np.float32))
    psf = np.pad(camera_shake(5, 4), 2)
    soft = fftconvolve(psf, soft_point(0.5), mode="same")
    energies = []
    for model, kernel in (
        (BlurredGradient.of(photo, 9, 0.5), psf),
        (BlurredGradient.of(photo, 9, 0.0), soft),
    ):
        sharp = model.posterior(kernel, 0.01, model.unknown())
        energies.append(model.energy(kernel, 0.01, sharp))
    assert energies[0] == pytest.approx(energies[1], rel=1e-4)  # single precision


def test_the_sharp_gradient_nears_the_true_one() -> None:
    truth = camera_shake(9, 3)
    picture = scene(98, 128).astype(np.float32)
    gradients = BlurredGradient.of(Blurred(blurred(truth, 90, 120).astype(np.float32)), 9, 0.0)
    sharp = gradients.unknown()
    for _ in range(12):
        sharp = gradients.posterior(truth, 0.01, sharp)
    steps = np.diff(picture, axis=0)[14:84, 14:114]
    found = sharp.mean[0, 10:80, 10:110]
    # steps are found to a pixel at least: the cosine of what is blurred is below .5
    assert np.vdot(found, steps) > 0.7 * np.linalg.norm(found) * np.linalg.norm(steps)


def test_the_true_gradients_give_the_true_psf() -> None:
    truth = camera_shake(9, 3)
    sharp = scene(96, 120).astype(np.float32)
    photo = ndimage.convolve(sharp, np.asarray(truth, np.float32), mode="wrap")
    steps = [np.roll(sharp, -1, axis=axis) - sharp for axis in (0, 1)]
    known = np.ones((2, 96, 120), np.float32)
    data = [np.roll(photo, -1, axis=axis) - photo for axis in (0, 1)]
    gradients = BlurredGradient(np.stack(data), known, soft_point(0), 9)
    exact = GradientPosterior(np.stack(steps), np.zeros_like(known[:1]), known[:1])
    found = np.full((9, 9), 1 / 81)
    for _ in range(6):
        found = gradients.refit(found, exact)
    # conjugate gradients end before the faintest values are found
    assert kernel_similarity(found, truth) > 0.99
    assert np.abs(found - truth).max() < 0.02


def test_the_fit_keeps_to_the_bound_and_meets_the_conditions_of_a_minimum() -> None:
    random = np.random.default_rng(2)
    sharp, photo = random.normal(size=(2, 2, 30, 36))
    fit = NonnegativeFit.of(fft.rfft2(sharp), fft.rfft2(photo), (30, 36), 5)
    psf, weight = np.full((5, 5), 0.04), 50.0
    for _ in range(20):
        psf = fit.solve(weight, psf)
    shifts = [(y, x) for y in range(-2, 3) for x in range(-2, 3)]
    columns = np.stack([np.roll(sharp, shift, axis=(1, 2)).ravel() for shift in shifts], axis=1)
    slope = columns.T @ (columns @ psf.ravel() - photo.ravel()) + weight * psf.ravel()
    assert psf.min() >= 0
    assert 0 < np.count_nonzero(psf) < psf.size
    # to the precision of the transforms of pictures with an energy of 2000
    np.testing.assert_allclose(slope[psf.ravel() > 0], 0, atol=0.05)
    assert slope[psf.ravel() == 0].min() > -0.05
