import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur._typing import FloatArray
from napari_crfdeblur.psf import camera_shake, delta, disk, project

ANGLES = [0.0, 0.3, np.pi / 4, np.pi / 2, 2.0, np.pi, -0.4, -np.pi / 2, -2.5]
SHAKE = camera_shake(15, 2)[:, 1:-3]  # asymmetric, oblong, off center
SHAKE = SHAKE / SHAKE.sum()
REACH = 26


def slanted_step(angle: float, fine: int = 32) -> tuple[FloatArray, FloatArray]:
    """Distances of pixel centers from an edge, and the light that each pixel's area gets."""
    rows, columns = np.indices((2 * REACH + 1,) * 2) - REACH
    distance = np.sin(angle) * rows + np.cos(angle) * columns
    within = (np.arange(fine) + 0.5) / fine - 0.5
    light = np.zeros_like(distance)
    for down, right in np.stack(np.meshgrid(within, within), axis=-1).reshape(-1, 2):
        light += distance + down * np.sin(angle) + right * np.cos(angle) > 0
    return distance, light / fine**2


@pytest.mark.parametrize("angle", ANGLES)
def test_it_is_the_profile_of_a_convolved_step(angle: float) -> None:
    distance, light = slanted_step(angle)
    blurred = ndimage.convolve(light, SHAKE, mode="nearest")
    inside = (slice(REACH - 8, REACH + 9),) * 2
    expected = blurred[inside]
    # the step itself is counted on 32 x 32 points of each pixel: off by up to 1/64 on diagonals
    np.testing.assert_allclose(project(SHAKE, angle, distance[inside]), expected, atol=1 / 64)
    flipped = project(SHAKE[::-1, ::-1], angle, distance[inside])
    assert np.abs(flipped - expected).max() > 0.05


@pytest.mark.parametrize("angle", ANGLES)
def test_it_rises_from_0_to_1(angle: float) -> None:
    positions = np.linspace(-20, 20, 401)
    profile = project(SHAKE, angle, positions)
    assert profile[0] == 0
    assert profile[-1] == pytest.approx(1, abs=1e-9)  # closed form along the grid, see NARROWEST
    assert np.diff(profile).min() > -1e-9  # the same


@pytest.mark.parametrize("angle", ANGLES)
def test_the_opposite_polarity_sees_it_reversed(angle: float) -> None:
    positions = np.linspace(-9, 9, 37)
    opposite = project(SHAKE, angle + np.pi, positions)
    np.testing.assert_allclose(opposite, 1 - project(SHAKE, angle, -positions), atol=1e-8)


def test_its_mean_is_the_projected_centroid() -> None:
    positions = np.linspace(-20, 20, 4001)
    mean = 20 - np.trapezoid(project(SHAKE, 0.7, positions), positions)
    at = np.indices(SHAKE.shape) - np.array(SHAKE.shape)[:, None, None] // 2
    centroid = (at * SHAKE).sum(axis=(1, 2))
    assert mean == pytest.approx(centroid @ [np.sin(0.7), np.cos(0.7)], abs=1e-3)


def test_no_blur_leaves_the_pixel() -> None:
    along = project(delta(), 0.0, [-0.5, -0.25, 0, 0.25, 0.5])
    np.testing.assert_allclose(along, [0, 0.25, 0.5, 0.75, 1], atol=1e-6)  # NARROWEST
    across = project(delta(), np.pi / 4, [-(0.5**0.5), 0, 0.5**0.5 / 2])
    np.testing.assert_allclose(across, [0, 0.5, 7 / 8], atol=1e-9)


def test_a_disk_blurs_all_directions_alike() -> None:
    positions = np.linspace(-6, 6, 25)
    first = project(disk(4.5), 0.1, positions)
    # the squares of the pixels differ by direction, a hundredth of the step
    np.testing.assert_allclose(project(disk(4.5), 0.9, positions), first, atol=0.01)


def test_positions_keep_their_shape() -> None:
    assert project(SHAKE, 0.2, np.zeros((3, 5))).shape == (3, 5)
    assert project(SHAKE, 0.2, 0.0).shape == ()
