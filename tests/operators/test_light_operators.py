"""Light: what moves it, draws it and sees it in perspective; and sums of response curves."""

import numpy as np
import pytest
from adjoints import dot_test, linearity_test, uneven_psf, vector

from napari_crfdeblur.estimate.likelihood.family import Family
from napari_crfdeblur.estimate.paper.rows import PolynomialRows
from napari_crfdeblur.photo import luminance
from napari_crfdeblur.psf.blind.colors import channel_weights, gray_of
from napari_crfdeblur.response import Cameras, Emor, Identity
from napari_crfdeblur.response.basis import emor_sum, emor_table
from napari_crfdeblur.response.prior import NODES
from napari_crfdeblur.simulate import (
    Camera,
    CameraMotion,
    ProfileCase,
    Scene,
    camera_turn,
    random_profiles,
    simulate,
)
from napari_crfdeblur.simulate.perspective import Surface
from napari_crfdeblur.simulate.raster import coverage, paint


def mixed(operator, shape, seed, tolerance):
    """A weighted mean of two pictures in [0, 1] becomes that of what becomes of them."""
    one, other = np.random.default_rng(seed).random((2, *shape)).astype(np.float32)
    share = np.float32(0.3)
    expected = share * operator(one) + (1 - share) * operator(other)
    found = operator(share * one + (1 - share) * other)
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("shape", [(41, 60), (52, 33, 3)])
def test_a_moving_camera_blurs_linearly_and_keeps_what_is_even(shape):
    motion = camera_turn(5, 0.05, 2, shape[:2])
    mixed(motion.blurred, shape, 1, 3e-6)  # sums of a few hundred poses in single precision
    even = np.full(shape, 0.7, np.float32)
    np.testing.assert_allclose(motion.blurred(even), 0.7, rtol=3e-6)


def test_poses_of_a_moving_camera_count_alike():
    motion, picture = camera_turn(5, 0.05, 2, (41, 60)), vector((41, 60), 2, np.float32)
    picture = np.clip(0.2 * picture + 0.5, 0, 1)
    count = len(motion.turns) // 3
    parts = [slice(count), slice(count, None)]
    split = [CameraMotion(motion.shifts[p], motion.turns[p]) for p in parts]
    shares = [len(part.turns) / len(motion.turns) for part in split]
    expected = sum(s * part.blurred(picture) for s, part in zip(shares, split, strict=True))
    np.testing.assert_allclose(motion.blurred(picture), expected, atol=3e-6)


@pytest.mark.parametrize("shift", [(0, 0), (3, -2), (-1, 4)])
def test_a_shift_by_whole_pixels_moves_the_picture(shift):
    picture = np.random.default_rng(3).random((20, 31)).astype(np.float32)
    moved = CameraMotion(np.array([shift], float), np.zeros(1)).blurred(picture)
    inside = (slice(5, -5),) * 2
    np.testing.assert_allclose(moved[inside], np.roll(picture, shift, (0, 1))[inside], atol=1e-6)


def test_a_half_turn_turns_the_picture():
    picture = np.random.default_rng(4).random((20, 31)).astype(np.float32)
    turned = CameraMotion(np.zeros((1, 2)), np.array([np.pi])).blurred(picture)
    np.testing.assert_allclose(turned, picture[::-1, ::-1], atol=1e-5)


@pytest.mark.parametrize("shape", [(30, 47), (41, 28, 3)])
@pytest.mark.parametrize("sides", [(5, 3), (4, 7)])
def test_a_simulated_blur_is_linear(shape, sides):
    camera = Camera(Identity(), bits=None)

    def blurred(linear):
        return simulate(Scene(linear), uneven_psf(sides), camera).blurred_linear

    mixed(blurred, shape, 5, 2e-6)


@pytest.mark.parametrize("seed", range(3))
def test_shapes_that_tile_a_picture_cover_it_once(seed):
    rng, shape = np.random.default_rng(seed), (17, 23)
    middle = rng.uniform((3, 3), (14, 20))
    ring = [(0, 0), (0, 9.3), (0, 23), (11.6, 23), (17, 23), (17, 6.1), (17, 0), (4.4, 0)]
    total = np.zeros(shape)
    for first, second in zip(ring, [*ring[1:], ring[0]], strict=True):
        total += coverage([np.array([middle, first, second])], shape)
    np.testing.assert_allclose(total, 1, atol=2e-6)  # single precision, 8 parts


def test_painting_is_linear_in_canvas_and_light():
    outline = [(2.3, 4.1), (15.8, 7.7), (9.2, 20.4)]

    def painted(both):
        canvas = both[:-1].copy()
        paint(canvas, [outline], both[-1, 0], opacity=0.7)
        return canvas

    linearity_test(painted, (19, 23, 3), np.float32, tolerance=50)


CORNERS = [(0.1, 0.2), (0.05, 0.9), (0.8, 0.7), (0.95, 0.15)]


def test_perspective_maps_corners_to_corners_and_lines_to_lines():
    surface = Surface(np.zeros((60, 90, 3)), CORNERS)
    corners = surface.to_image([(0, 0), (1, 0), (1, 1), (0, 1)])
    np.testing.assert_allclose((corners + 0.5) / (60, 90), CORNERS, atol=1e-12)
    start, end = np.random.default_rng(5).random((2, 2))
    points = start + np.linspace(-0.5, 1.5, 9)[:, None] * (end - start)
    seen = surface.to_image(points)
    along = (seen[-1] - seen[0]) / np.linalg.norm(seen[-1] - seen[0])
    off = (seen - seen[0]) @ np.array([-along[1], along[0]])
    np.testing.assert_allclose(off, 0, atol=1e-9)


def test_a_part_of_a_surface_is_seen_where_the_surface_has_it():
    surface = Surface(np.zeros((60, 90, 3)), CORNERS)
    left, top, right, bottom = 0.15, 0.3, 0.8, 0.55
    points = np.random.default_rng(6).random((20, 2))
    inside = points * (right - left, bottom - top) + (left, top)
    np.testing.assert_allclose(
        surface.part((left, top, right, bottom)).to_image(points),
        surface.to_image(inside),
        atol=1e-9,
    )
    flat = Surface(np.zeros((60, 90, 3)), [(0, 0), (0, 1), (1, 1), (1, 0)])
    np.testing.assert_allclose(flat.to_image(points), points[:, ::-1] * (60, 90) - 0.5, atol=1e-9)


def test_gray_is_linear_in_the_channels():
    linearity_test(luminance, (12, 17, 3), np.float32)
    picture = np.random.default_rng(7).random((30, 41, 3))
    weights = channel_weights(picture)
    assert np.abs(weights).sum() == pytest.approx(1, rel=1e-6)
    np.testing.assert_allclose(gray_of(picture)[0], picture @ weights, atol=1e-6)


def test_the_curves_of_emor_are_orthonormal_and_leave_both_ends():
    table = emor_table()
    # printed with six digits, and 0 at both ends where the published ones are not quite
    np.testing.assert_allclose(table[1:] @ table[1:].T, np.eye(25), atol=1e-3)
    np.testing.assert_array_equal(table[0, [0, -1]], [0, 1])
    assert not table[1:, [0, -1]].any()


def test_sums_of_emor_are_linear_in_their_weights_and_are_its_responses():
    linearity_test(emor_sum, (26,))
    irradiance, weights = np.linspace(0, 1, 1024), (0.4, -0.3, 0.05)
    curve = Emor(weights)
    np.testing.assert_allclose(
        curve.to_intensity(irradiance), emor_sum((1.0, *weights)), atol=1e-12
    )
    found = emor_table()[1:4] @ (curve.to_intensity(irradiance) - emor_table()[0])
    np.testing.assert_allclose(found, weights, atol=1e-3)


@pytest.mark.parametrize("cameras", Cameras)
def test_what_a_family_records_is_linear_in_its_coefficients(cameras):
    prior = cameras.prior
    light = np.linspace(0, 1, 77)
    mean = Family(prior, np.zeros(prior.size)).record(light)

    def change(coefficients):
        return Family(prior, coefficients).record(light) - mean

    linearity_test(change, (prior.size,), tolerance=50)
    sensitivity = Family(prior, np.zeros(prior.size)).expose(light).sensitivity
    c = vector((prior.size,), 8)
    np.testing.assert_allclose(change(c), sensitivity @ c, atol=1e-12)
    np.testing.assert_array_equal(Family(prior, c).record(NODES[[0, -1]]), [0, 1])


def test_rows_of_a_polynomial_response_have_their_adjoint():
    camera, case = Camera(Identity(), bits=None), ProfileCase(profiles=6, falling=0.5)
    (group,) = random_profiles(camera, case, seed=9)
    rows = PolynomialRows(group, 5)
    dot_test(rows.raw, rows.raw_slope, (6,), group.intensity.shape)
    linearity_test(rows.offsets, (6,))
