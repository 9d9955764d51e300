"""PSFs of the parts of a picture: a known motion is found, and doubtful parts borrow."""

import numpy as np
import pytest
from blurred_shapes import scene as shapes

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import (
    GivenPsf,
    Poses,
    PsfField,
    PsfStatus,
    XuJia,
    camera_shake,
    estimate_psf,
    estimate_psf_field,
)
from napari_crfdeblur.psf.field.base import offset_from_middle, part_centers
from napari_crfdeblur.psf.field.poses import fit_poses, turns_within
from napari_crfdeblur.psf.parts import grid_of
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Identity
from napari_crfdeblur.simulate import Camera, Scene, camera_turn, simulate, street

SHAPE, GRID = (300, 420), (2, 3)


def square(psf, size):
    return np.pad(psf, [((size - side) // 2,) * 2 for side in psf.shape])


@pytest.fixture(scope="module")
def motion():
    return camera_turn(9, 0.06, 4, SHAPE)


@pytest.fixture(scope="module")
def true_field(motion):
    offsets = [offset_from_middle(c, SHAPE) for c in part_centers(SHAPE, GRID).reshape(-1, 2)]
    psfs = [motion.psf_at(offset) for offset in offsets]
    size = max(max(psf.shape) for psf in psfs)
    stacked = np.stack([square(psf, size) for psf in psfs])
    return np.array(offsets), stacked


def field_of(psfs, **options):
    statuses = tuple((PsfStatus.GOOD,) * GRID[1] for _ in range(GRID[0]))
    return PsfField(psfs.reshape(*GRID, *psfs.shape[1:]), statuses, SHAPE, **options)


def test_the_motion_behind_known_psfs_is_found(motion, true_field):
    offsets, psfs = true_field
    turns = turns_within(psfs.shape[1] / 4, np.hypot(*offsets.T).max())
    poses = fit_poses(psfs, offsets, np.ones(len(psfs)), turns)
    assert poses.times.sum() == pytest.approx(1, abs=1e-12)  # rounding
    assert poses.spread == pytest.approx(motion.turns.std(), rel=0.2)
    for offset, psf in zip(offsets, psfs, strict=True):
        # shifts between pixels are shared by four of them, which broadens a PSF
        assert kernel_similarity(poses.psf_at(tuple(offset)), psf) > 0.9


def test_a_part_without_a_psf_borrows_from_the_others(motion, true_field):
    offsets, psfs = true_field
    weights = np.ones(len(psfs))
    weights[0] = 0
    turns = turns_within(psfs.shape[1] / 4, np.hypot(*offsets.T).max())
    borrowed = fit_poses(psfs, offsets, weights, turns).psf_at(tuple(offsets[0]))
    middle = square(motion.psf_at((0.0, 0.0)), psfs.shape[1])
    assert kernel_similarity(borrowed, psfs[0]) > kernel_similarity(middle, psfs[0]) + 0.15


def test_between_its_parts_a_field_interpolates(true_field):
    _, psfs = true_field
    field = field_of(psfs)
    for index in np.ndindex(GRID):
        np.testing.assert_allclose(field.at(*field.centers[index]), field.psfs[index], atol=1e-12)
    half = field.at(*(field.centers[0, 0] + field.centers[0, 1]) / 2)
    np.testing.assert_allclose(half, (field.psfs[0, 0] + field.psfs[0, 1]) / 2, atol=1e-12)
    np.testing.assert_allclose(field.at(-5.0, 1e4), field.psfs[0, -1], atol=1e-12)
    assert field.spread > 0.02


def test_the_map_shows_every_psf_in_its_place(true_field):
    _, psfs = true_field
    sheet = field_of(psfs).picture()
    size = psfs.shape[1]
    assert sheet.shape == (2 * (size + 1) - 1, 3 * (size + 1) - 1)
    np.testing.assert_allclose(sheet[-size:, -size:], psfs[-1] / psfs[-1].max())
    assert not sheet[size].any()


@pytest.mark.parametrize(
    ("regions", "expected"), [(4, (3, 4)), (1, (1, 1)), ((2, 5), (2, 5)), (6, (4, 6))]
)
def test_parts_are_about_square(regions, expected):
    assert grid_of(regions, (300, 420)) == expected


@pytest.mark.parametrize("regions", [0, -1, (0, 3), (2, 2, 2), 1.5, True, "2", 10**400, None])
def test_an_impossible_grid_is_refused(regions):
    with pytest.raises(ValueError, match=r"expected a whole number of parts.* got"):
        grid_of(regions, SHAPE)


def test_an_impossible_field_is_refused(true_field):
    _, psfs = true_field
    with pytest.raises(ValueError, match="odd H and W"):
        field_of(psfs[:, :-1])
    with pytest.raises(ValueError, match="a status for each"):
        PsfField(psfs[None], ((PsfStatus.GOOD,),), SHAPE)


CAMERA = Camera(Identity(), noise=0.002, bits=None)


@pytest.fixture(scope="module")
def still():
    scene = Scene(shapes(200, 260).astype(np.float32))
    return simulate(scene, camera_shake(9, 4), CAMERA, seed=2)


def test_a_turn_of_the_camera_is_found():
    scene = street((330, 450), seed=1)
    motion = camera_turn(9, 0.05, 4, scene.linear.shape[:2])
    turned = simulate(scene, motion, CAMERA, seed=2)
    whole = estimate_psf(turned.photo, XuJia(size=21))
    field = estimate_psf_field(turned.photo, XuJia(), whole, grid=GRID)
    assert field.grid == GRID
    assert field.diagnostics["turn"] > 0.2  # degrees; .75 in truth
    truth = [
        turned.motion.psf_at(offset_from_middle(center, field.shape))
        for center in field.centers.reshape(-1, 2)
    ]
    found = field.psfs.reshape(-1, *field.psfs.shape[2:])
    own = np.mean([kernel_similarity(a, b) for a, b in zip(found, truth, strict=True)])
    one = np.mean([kernel_similarity(whole.psf, b) for b in truth])
    assert own > one + 0.05


def test_without_a_turn_the_psf_of_the_whole_stays(still):
    whole = estimate_psf(still.photo, XuJia(size=11))
    field = estimate_psf_field(still.photo, XuJia(), whole, grid=(2, 2))
    assert field.diagnostics["turn"] == 0
    for psf in field.psfs.reshape(-1, *field.psfs.shape[2:]):
        assert kernel_similarity(psf, whole.psf) > 1 - 1e-9  # padded, no more


def test_what_has_no_size_cannot_search_parts(still):
    whole = estimate_psf(still.photo, GivenPsf(camera_shake(9, 4)))
    with pytest.raises(ValueError, match="blind estimator"):
        estimate_psf_field(still.photo, GivenPsf(whole.psf), whole, grid=2)


def test_parts_too_small_for_the_psf_are_refused_with_advice(still):
    whole = estimate_psf(still.photo, GivenPsf(camera_shake(9, 4)))
    with pytest.raises(CrfDeblurError, match="fewer parts"):
        estimate_psf_field(still.photo, XuJia(), whole, grid=20)


def test_poses_are_kept_as_they_are():
    poses = Poses(np.array([0.0]), np.ones((1, 3, 3)) / 9)
    assert poses.spread == 0
    with pytest.raises(ValueError, match="read-only"):
        poses.times[0, 0, 0] = 1
