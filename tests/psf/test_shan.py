import numpy as np
import pytest
from blurred_shapes import blurred, scene

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.psf.blind.blurred import Blurred
from napari_crfdeblur.psf.blind.shan.kernel import sparse_kernel
from napari_crfdeblur.psf.blind.shan.latent import Latent, differences, gradient_of
from napari_crfdeblur.psf.blind.shan.prior import KNEE, most_likely, penalty
from napari_crfdeblur.quality import kernel_similarity


def test_the_penalty_is_continuous_and_rises() -> None:
    values = penalty(np.linspace(0, 1, 4001))
    assert (np.diff(values) > 0).all()
    near, far = penalty(np.array([KNEE - 1e-9, KNEE + 1e-9]))
    assert far == pytest.approx(near, abs=1e-5)  # of 5, and by construction
    np.testing.assert_array_equal(penalty(np.array([-0.3])), penalty(np.array([0.3])))


def test_the_substitute_is_the_global_minimum() -> None:
    random = np.random.default_rng(5)
    rough, measured = random.normal(0, 0.1, (2, 2, 4, 5))
    local, coupling, weight = random.uniform(0, 20, (4, 5)), 16.0, 0.05
    found = most_likely(rough, coupling, measured, local, weight)

    def cost(value: FloatArray) -> FloatArray:
        pulled = local * (value - measured) ** 2 + coupling * (value - rough) ** 2
        return np.asarray(weight * penalty(value) + pulled)

    trials = np.linspace(-0.6, 0.6, 24001)[:, None, None, None] * np.ones_like(rough)
    # trials lie 5e-5 apart: between two of them the cost changes by some 1e-4
    assert (cost(found) <= cost(trials).min(axis=0) + 1e-4).all()


def test_differences_are_forward() -> None:
    plane = np.random.default_rng(0).normal(size=(12, 15))
    steps = differences((12, 15))
    down, across = gradient_of(np.fft.rfft2(plane), steps, (12, 15))
    # transforms of single precision
    np.testing.assert_allclose(down, np.roll(plane, -1, axis=0) - plane, atol=1e-5)
    np.testing.assert_allclose(across, np.roll(plane, -1, axis=1) - plane, atol=1e-5)


def test_the_latent_picture_is_nearer_to_the_sharp_one() -> None:
    psf = camera_shake(9, 3)
    photo = Blurred(blurred(psf, 90, 120).astype(np.float32))
    sharp = scene(98, 128)[4:-4, 4:-4]
    found = Latent.of(photo, 9).predict(psf, 0.01, 5.0)
    inside = (slice(10, -10), slice(10, -10))
    before = np.square(photo.plane - sharp)[inside].mean()
    assert np.square(found - sharp)[inside].mean() < before / 3


def test_the_true_picture_gives_the_true_kernel() -> None:
    psf = camera_shake(9, 3)
    photo = Blurred(blurred(psf, 90, 120, noise=0).astype(np.float32))
    sharp = scene(98, 128)[4:-4, 4:-4]
    found = sparse_kernel(sharp, photo, np.full((9, 9), 1 / 81), 0.0)
    assert found.min() >= 0
    # beyond the border the picture is not known
    assert kernel_similarity(found / found.sum(), psf) > 0.97


def test_a_sparser_kernel_has_less_mass() -> None:
    photo = Blurred(blurred(camera_shake(9, 3), 90, 120).astype(np.float32))
    start = np.full((9, 9), 1 / 81)
    free, sparse = (sparse_kernel(photo.plane, photo, start, g) for g in (0.0, 0.1))
    assert sparse.sum() < free.sum()
    assert np.count_nonzero(sparse) <= np.count_nonzero(free)
