"""A camera that turns: blur that varies, from the motion alone."""

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.response import Identity
from napari_crfdeblur.simulate import (
    Camera,
    CameraMotion,
    camera_turn,
    simulate,
    slanted_edges,
    step_image,
)

SHAPE = (121, 161)


@pytest.fixture(scope="module")
def motion():
    return camera_turn(9, 0.06, 3, SHAPE)


def test_without_a_turn_it_is_one_psf():
    still = camera_turn(9, 0.0, 3, SHAPE)
    middle = still.psf_at((0.0, 0.0))
    np.testing.assert_allclose(still.psf_at((-50.0, 70.0)), middle, atol=1e-12)  # rounding
    scene = slanted_edges((140, 180), seed=2, pitch=60)
    blurred = simulate(scene, still, Camera(Identity(), bits=None)).blurred_linear
    known = simulate(scene, middle, Camera(Identity(), bits=None)).blurred_linear
    trim = [(large - small) // 2 for large, small in zip(blurred.shape, known.shape, strict=True)]
    inner = blurred[trim[0] :, trim[1] :][: known.shape[0], : known.shape[1]]
    # sums of as many linearly interpolated pictures, in single precision
    np.testing.assert_allclose(inner[:90, :90], known[:90, :90], atol=2e-5)


def test_a_point_becomes_the_psf_of_its_place(motion):
    point = np.zeros(SHAPE, dtype=np.float32)
    point[35, 130] = 1
    offset = 35 - 60.0, 130 - 80.0
    psf = motion.psf_at(offset)
    down, right = np.rint(motion.path(offset).mean(axis=0)).astype(int)
    row, column = 35 + down, 130 + right
    half = [side // 2 for side in psf.shape]
    seen = motion.blurred(point)[
        row - half[0] : row + half[0] + 1, column - half[1] : column + half[1] + 1
    ]
    # the PSF is centered exactly, the picture to a pixel
    shift = np.array(ndimage.center_of_mass(psf)) - ndimage.center_of_mass(seen)
    assert np.abs(shift).max() < 0.6
    aligned = ndimage.shift(seen, shift, order=1)
    assert np.vdot(aligned, psf) / np.linalg.norm(aligned) / np.linalg.norm(psf) > 0.9


def test_the_turn_moves_light_around_the_middle():
    motion = CameraMotion(np.zeros((2, 2)), np.array([0.0, 0.1]))
    # from the column axis towards the row axis: what is right of the middle goes down
    np.testing.assert_allclose(
        motion.path((0.0, 50.0))[1], [50 * np.sin(0.1), 50 * (np.cos(0.1) - 1)]
    )
    np.testing.assert_array_equal(motion.path((0.0, 50.0))[0], [0, 0])


def test_only_pixels_whose_light_is_known_are_kept(motion):
    scene = slanted_edges((140, 180), seed=2, pitch=60)
    result = simulate(scene, motion, Camera(Identity(), bits=None), seed=1)
    rows, columns = motion.reach((140, 180))
    assert result.photo.shape == (140 - 2 * rows, 180 - 2 * columns)
    assert result.motion is motion
    assert simulate(scene, camera_shake(5, 1), Camera(Identity())).motion is None


def test_the_reach_leaves_the_size_that_was_asked_for(motion):
    rows, columns = motion.reach_for((100, 150))
    assert motion.reach((100 + 2 * rows, 150 + 2 * columns)) == (rows, columns)


def test_the_motion_repeats_and_fills_its_size(motion):
    again = camera_turn(9, 0.06, 3, SHAPE)
    np.testing.assert_array_equal(again.shifts, motion.shifts)
    assert np.ptp(motion.turns) == pytest.approx(0.06, rel=0.05)  # the first pose is a step in
    assert max(motion.psf_at((0.0, 0.0)).shape) == 9


@pytest.mark.parametrize(
    ("shifts", "turns"),
    [
        (np.zeros((3, 2)), np.zeros(2)),
        (np.zeros((0, 2)), np.zeros(0)),
        (np.full((1, 2), np.nan), np.zeros(1)),
    ],
)
def test_an_impossible_motion_is_refused(shifts, turns):
    with pytest.raises(ValueError, match="expected"):
        CameraMotion(shifts, turns)


def test_a_scene_smaller_than_the_motion_is_refused(motion):
    with pytest.raises(ValueError, match="larger than"):
        simulate(step_image((6, 40)), motion, Camera(Identity()))
