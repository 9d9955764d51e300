"""Simulated photos: the truth that travels with them is the truth."""

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest
from scipy.signal import convolve2d

from napari_crfdeblur.photo import to_unit
from napari_crfdeblur.response import SRGB, Gamma, Identity, dorf_mean
from napari_crfdeblur.simulate import Camera, Scene, simulate, slanted_edges, step_image

PSF = np.array([[0, 1, 4, 0, 0], [0, 0, 2, 1, 0], [0, 0, 0, 3, 6]], dtype=float)
FLAT = Scene(np.full((200, 300), 0.4))


@pytest.fixture(scope="module")
def scene():
    return slanted_edges((90, 131), seed=2, pitch=60, channels=3)


def test_blurred_light_is_the_convolution_of_every_channel(scene):
    photo = simulate(scene, PSF, Camera(dorf_mean()))
    assert photo.photo.shape == (88, 127, 3)
    for channel in range(3):
        expected = convolve2d(scene.linear[..., channel], PSF / PSF.sum(), mode="valid")
        # float32 transforms of values up to 1 keep 6 digits.
        np.testing.assert_allclose(photo.blurred_linear[..., channel], expected, atol=2e-6)


def test_sharp_light_is_the_scene_where_the_psf_has_its_origin(scene):
    delta = np.zeros((3, 5))
    delta[1, 2] = 1
    photo = simulate(scene, delta, Camera(Identity()))
    np.testing.assert_array_equal(photo.sharp_linear, scene.linear[1:-1, 2:-2])
    np.testing.assert_allclose(photo.blurred_linear, photo.sharp_linear, atol=1e-6)
    np.testing.assert_array_equal(photo.photo, photo.sharp)


def test_an_even_psf_keeps_its_origin(scene):
    photo = simulate(scene, np.array([[0, 0], [0, 1.0]]), Camera(Identity()))
    np.testing.assert_allclose(photo.blurred_linear, photo.sharp_linear, atol=1e-6)


@pytest.mark.parametrize("response", [Identity(), Gamma(2.2), SRGB(), dorf_mean()], ids=repr)
@pytest.mark.parametrize(("bits", "levels"), [(8, 255), (16, 65535), (None, 1e6)])
def test_undoing_the_response_gives_the_blurred_light(scene, response, bits, levels):
    photo = simulate(scene, PSF, Camera(response, bits=bits))
    intensity = to_unit(photo.photo)
    exact = response.to_intensity(photo.blurred_linear)
    # Half a step of rounding; the table of an 8-bit camera is exact to a 60th of a level,
    # interpolation to 1e-6.
    finest = 1 / 60 / 255 if bits == 8 else 1e-6
    assert np.abs(intensity - exact).max() <= 0.5 / levels + finest


@pytest.mark.parametrize(("bits", "kind"), [(8, "uint8"), (16, "uint16"), (None, "float32")])
def test_bits_decide_the_kind_of_number(scene, bits, kind):
    photo = simulate(scene, PSF, Camera(SRGB(), bits=bits))
    assert photo.photo.dtype == photo.sharp.dtype == kind
    assert photo.sharp_linear.dtype == photo.blurred_linear.dtype == np.float32


def test_the_seed_decides_the_noise(scene):
    camera = Camera(dorf_mean(), noise=0.01)
    first, same, other = (simulate(scene, PSF, camera, seed=s).photo for s in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert np.mean(first != other) > 0.5


def test_read_noise_is_that_of_the_light_before_the_response():
    response = Gamma(2.2)
    camera = Camera(response, noise=0.01, bits=None)
    photo = simulate(FLAT, np.ones((1, 1)), camera, seed=3).photo
    light = response.to_irradiance(photo)
    # 60000 pixels: the deviation is known within 0.3 %; four times that is allowed.
    assert light.std() == pytest.approx(0.01, rel=0.012)
    assert light.mean() == pytest.approx(0.4, abs=2e-4)


def test_photon_noise_grows_with_the_light():
    scene = step_image((200, 400), levels=(0.1, 0.8))
    camera = Camera(Identity(), photons=1000, bits=None)
    photo = simulate(scene, np.ones((1, 1)), camera, seed=4).photo
    for side, level in ((photo[:, :190], 0.1), (photo[:, 210:], 0.8)):
        assert side.std() == pytest.approx(np.sqrt(level / 1000), rel=0.015)


def test_noise_that_leaves_the_range_is_clipped():
    scene = Scene(np.full((40, 50), 0.999))
    photo = simulate(scene, np.ones((1, 1)), Camera(SRGB(), noise=0.05)).photo
    assert photo.max() == 255
    assert np.mean(photo == 255) == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize("channels", [1, 3])
def test_jpeg_changes_little_at_high_quality_and_more_at_low(channels):
    scene = slanted_edges((90, 131), seed=2, pitch=60, channels=channels)
    camera = Camera(SRGB())
    plain = simulate(scene, PSF, camera).photo.astype(float)
    loss = []
    for quality in (95, 30):
        photo = simulate(scene, PSF, replace(camera, jpeg=quality)).photo
        assert photo.dtype == np.uint8
        assert photo.shape == plain.shape
        loss.append(np.sqrt(np.mean((photo - plain) ** 2)))
    assert 0 < loss[0] < loss[1] < 10


def test_edges_move_with_the_crop():
    scene = step_image((50, 80))
    photo = simulate(scene, PSF, Camera(Identity(), bits=None))
    (before, *_), (after, *_) = scene.edges, photo.edges
    assert after.line.start == (before.line.start[0] - 1, before.line.start[1] - 2)
    column = round(after.line.start[1])
    assert photo.sharp_linear[10, column - 1] == pytest.approx(after.before[0])
    assert photo.sharp_linear[10, column + 2] == pytest.approx(after.after[0])


def test_simulated_arrays_are_read_only(scene):
    photo = simulate(scene, PSF, Camera(SRGB()))
    for array in (photo.photo, photo.sharp, photo.sharp_linear, photo.blurred_linear, photo.psf):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 0


def test_psf_of_the_caller_stays_his():
    psf = PSF.copy()
    simulate(FLAT, psf, Camera(SRGB()))
    psf[0, 0] = 1  # still writeable, never scaled
    assert psf.sum() == PSF.sum() + 1


def test_cameras_compare_by_their_settings():
    assert Camera(Gamma(2.2), noise=0.01) == Camera(Gamma(2.2), noise=0.01)
    assert Camera(Gamma(2.2)) != Camera(Gamma(2.4))


@pytest.mark.parametrize(
    "options",
    [
        {"noise": -0.1},
        {"noise": nan},
        {"noise": inf},
        {"photons": 0},
        {"photons": nan},
        {"bits": 12},
        {"jpeg": 0},
        {"jpeg": 101},
        {"jpeg": 90, "bits": 16},
    ],
)
def test_impossible_cameras_are_refused(options):
    with pytest.raises(ValueError, match="expected"):
        Camera(Identity(), **options)


def test_a_psf_larger_than_the_scene_is_refused():
    with pytest.raises(ValueError, match="expected a scene larger"):
        simulate(step_image((20, 30)), np.ones((21, 3)), Camera(Identity()))
