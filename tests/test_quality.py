"""Measures of quality: what they ignore, and what they notice."""

import numpy as np
import pytest
from scipy.ndimage import shift
from skimage.metrics import structural_similarity

from napari_crfdeblur import fourier
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.quality import (
    aligned,
    kernel_similarity,
    psnr,
    response_error,
    response_error_full,
    ringing,
    ssim,
)
from napari_crfdeblur.response import Gamma, Identity, Polynomial, Tabulated, dorf_mean
from napari_crfdeblur.simulate import Camera, simulate, slanted_edges

GRID = np.linspace(0, 1, 257)


def picture(shape=(90, 121), seed=0):
    """A smooth random picture: moved by a fraction of a pixel, it loses nothing."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft2(rng.standard_normal(shape))
    rows, columns = np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])
    spectrum *= np.exp(-((rows**2 + columns**2) / 0.08**2))
    plane = np.fft.irfft2(spectrum, s=shape)
    return 0.5 + 0.12 * plane / plane.std()


def kernel():
    psf = np.zeros((13, 19))
    for t in np.linspace(0, 1, 200):
        psf[int(2 + 9 * t), int(1 + 16 * t**2)] += 1
    return psf / psf.sum()


def test_a_curve_has_no_error_against_itself():
    assert response_error(dorf_mean(), dorf_mean()) == pytest.approx(0, abs=1e-14)
    assert response_error_full(dorf_mean(), dorf_mean()) == (0, 0)


def test_an_affine_change_within_the_covered_range_is_no_error():
    truth = Gamma(2.0)
    light = truth.to_irradiance(GRID)
    inner = (GRID >= 0.25) & (GRID <= 0.75)
    changed = np.where(inner, 0.6 * light + 0.2, np.nan)
    changed[0], changed[-1] = 0, 1
    known = np.isfinite(changed)
    curve = Tabulated(np.interp(GRID, GRID[known], changed[known]), GRID)
    # Linear interpolation between 257 samples of a parabola is off by 4e-6.
    assert response_error(curve, truth, (0.25, 0.75)) < 1e-5
    assert response_error_full(curve, truth)[0] > 0.05
    assert response_error(curve, truth) > 0.01


def test_response_error_is_in_units_of_the_true_irradiance():
    # g = I^2 against I: the best line leaves sqrt(1 / 180).
    assert response_error(Identity(), Polynomial((0, 1))) == pytest.approx(180**-0.5, rel=0.01)
    rms, largest = response_error_full(Identity(), Polynomial((0, 1)))
    assert rms == pytest.approx(30**-0.5, rel=0.01)
    assert largest == pytest.approx(0.25, rel=1e-3)


@pytest.mark.parametrize("covered", [(0.5, 0.5), (0.7, 0.2), (-0.1, 0.5), (0.5, 1.1)])
def test_wrong_ranges_are_refused(covered):
    with pytest.raises(ValueError, match="expected a range"):
        response_error(Identity(), Identity(), covered)


def test_psnr_is_that_of_the_difference():
    truth = picture()
    noise = 0.01 * np.random.default_rng(1).standard_normal(truth.shape)
    assert psnr(truth + noise, truth) == pytest.approx(40, abs=0.2)
    assert psnr(truth, truth) == np.inf


@pytest.mark.parametrize("move", [(3, -5), (-16, 16), (0, 0)])
def test_psnr_ignores_whole_shifts(move):
    truth = picture()
    assert psnr(np.roll(truth, move, axis=(0, 1)), truth) == np.inf


def test_psnr_ignores_sub_pixel_shifts():
    truth = picture()
    moved = shift(truth, (0.3, -2.6), mode="nearest")
    # Cubic interpolation there and back leaves about 1e-4; without alignment it is 25 dB.
    assert psnr(moved, truth) > 55


def test_color_is_moved_as_a_whole():
    truth = np.stack([picture(seed=s) for s in range(3)], axis=-1)
    assert psnr(np.roll(truth, (2, 1), axis=(0, 1)), truth) == np.inf
    assert psnr(np.roll(truth, 3, axis=1)[..., ::-1], truth) < 20


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_photos_of_any_kind_are_compared_as_intensity(dtype):
    full = 1 if dtype == np.float32 else np.iinfo(dtype).max
    bright, dark = (np.full((40, 50), value * full).astype(dtype) for value in (0.6, 0.4))
    bright[::7], dark[::7] = 0.9 * full, 0.7 * full
    # Rounding to 8 bits moves a difference of 0.2 by 1/255.
    assert psnr(bright, dark, border=0) == pytest.approx(-20 * np.log10(0.2), abs=0.2)


def test_aligned_crops_the_border():
    image, truth = aligned(picture(), picture(), border=7)
    assert image.shape == truth.shape == (76, 107)


def test_ssim_is_the_published_one():
    truth = picture()
    worse = np.clip(truth + 0.1 * np.random.default_rng(2).standard_normal(truth.shape), 0, 1)
    expected = structural_similarity(
        worse, truth, data_range=1, gaussian_weights=True, use_sample_covariance=False
    )
    assert ssim(worse, truth, border=0) == pytest.approx(expected, abs=1e-9)
    assert ssim(truth, truth) == pytest.approx(1)
    assert ssim(np.roll(truth, (2, 3), axis=(0, 1)), truth) == pytest.approx(1)


def test_images_that_cannot_be_compared_are_refused():
    with pytest.raises(ValueError, match="expected images of one shape"):
        psnr(picture(), picture()[1:])
    with pytest.raises(ValueError, match="expected a border"):
        psnr(picture(), picture(), border=42)


def test_a_kernel_is_wholly_similar_to_itself_moved_scaled_and_padded():
    psf = kernel()
    moved = np.roll(np.pad(3 * psf, ((4, 9), (2, 8))), (2, -1), axis=(0, 1))
    assert kernel_similarity(psf, moved) == pytest.approx(1)
    assert kernel_similarity(moved, psf) == pytest.approx(1)


def test_a_kernel_is_not_similar_to_its_mirror_image():
    assert kernel_similarity(kernel(), kernel()[:, ::-1]) < 0.7


def test_kernel_similarity_of_lines_that_cross():
    # Two lines of 9 pixels meet in one: 1 / 9.
    assert kernel_similarity(np.ones((1, 9)), np.ones((9, 1))) == pytest.approx(1 / 9)


def test_an_empty_kernel_is_refused():
    with pytest.raises(ValueError, match="expected two PSFs"):
        kernel_similarity(np.zeros((3, 3)), kernel())


def wiener(linear, psf, noise):
    """A plain Wiener filter, independent of the package's own."""
    pad = max(psf.shape)
    padded = np.pad(linear, pad, mode="reflect")
    transfer = fourier.otf(psf, padded.shape)
    spectrum = fourier.forward(padded) * transfer.conj() / (np.abs(transfer) ** 2 + noise)
    return fourier.inverse(spectrum, padded.shape)[pad:-pad, pad:-pad]


@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_a_photo_rings_less_when_its_response_is_undone(noise):
    truth = dorf_mean()
    photo = simulate(
        slanted_edges((200, 420), seed=1), kernel(), Camera(truth, noise=noise), seed=1
    )
    found = []
    for assumed in (truth, Gamma(2.2), Identity()):
        linear = assumed.to_irradiance(photo.photo / 255).astype(np.float32)
        restored = assumed.to_intensity(wiener(linear, photo.psf, 0.003 + noise))
        found.append(ringing(restored, photo.photo, extent=15))
    assert found[0] < 0.85 * found[1]
    assert found[1] < 0.85 * found[2]


def test_a_sharp_photo_does_not_ring():
    photo = simulate(slanted_edges((200, 420), seed=1), kernel(), Camera(dorf_mean()))
    assert ringing(photo.sharp, photo.photo, extent=15) < 1e-6


def test_ringing_does_not_depend_on_the_scale_of_intensity():
    photo = simulate(
        slanted_edges((200, 420), seed=1), kernel(), Camera(Identity(), noise=0.001, bits=None)
    )
    blurred = photo.photo.astype(np.float64)
    restored = wiener(blurred, photo.psf, 0.001)
    half = ringing(0.5 * restored + 0.2, blurred, extent=15)
    # luminance() works in float32.
    assert half == pytest.approx(ringing(restored, blurred, extent=15), rel=1e-3)


def test_ringing_needs_an_edge():
    flat = np.full((80, 90), 0.5)
    with pytest.raises(CrfDeblurError, match="no isolated edge"):
        ringing(flat, flat)


def test_ringing_refuses_what_does_not_belong_together():
    with pytest.raises(ValueError, match="expected images of one shape"):
        ringing(picture(), picture()[1:])
    with pytest.raises(ValueError, match="expected an extent"):
        ringing(picture(), picture(), extent=0)
