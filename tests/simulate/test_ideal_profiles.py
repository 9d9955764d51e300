"""Profiles drawn from the model obey the model, with the variance they claim."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.response import Gamma, Identity, dorf_mean
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles
from napari_crfdeblur.simulate.profiles import (
    any_levels,
    constant_contrast,
    edge_shape,
    from_black,
    recorded,
)

EXACT = Camera(dorf_mean(), bits=None)


def linear_rows(group, camera):
    """Profiles in linear light, freed of offset and range: all alike."""
    light = camera.response.to_irradiance(group.intensity)
    sides = camera.response.to_irradiance(group.sides)
    return (light - sides[:, :1]) / np.diff(sides, axis=1)


@pytest.mark.parametrize("falling", [0, 0.5, 1])
def test_profiles_of_a_group_share_one_shape_in_linear_light(falling):
    for group in random_profiles(EXACT, ProfileCase(groups=3, falling=falling), seed=8):
        shapes = linear_rows(group, EXACT)
        # float32 intensities, divided by ranges of at least 0.2.
        np.testing.assert_allclose(shapes, shapes[:1].repeat(8, axis=0), atol=1e-5)
        np.testing.assert_allclose(shapes[:, [0, -1]], [[0, 1]] * 8, atol=1e-5)
        assert np.all(np.diff(shapes[0]) > -1e-5)


def test_without_the_response_undone_the_shapes_differ():
    (group,) = random_profiles(EXACT, ProfileCase(), seed=8)
    shapes = linear_rows(group, Camera(Identity()))
    assert np.ptp(shapes, axis=0).max() > 0.1


@pytest.mark.parametrize(("falling", "polarity"), [(0, 1), (0.5, 0), (1, -1)])
def test_polarity_says_whether_rows_rise_or_fall(falling, polarity):
    (group,) = random_profiles(EXACT, ProfileCase(falling=falling), seed=1)
    assert group.polarity == polarity
    assert (np.diff(group.sides)[:, 0] < 0).sum() == round(8 * falling)


def test_the_seed_decides_the_profiles():
    draws = [random_profiles(EXACT, ProfileCase(groups=2), seed=s) for s in (3, 3, 4)]
    np.testing.assert_array_equal(draws[0][1].intensity, draws[1][1].intensity)
    assert np.abs(draws[0][1].intensity - draws[2][1].intensity).max() > 0.05


def test_cameras_see_the_same_edges():
    case = ProfileCase(groups=2)
    for one, other in zip(
        random_profiles(EXACT, case, seed=5),
        random_profiles(Camera(Gamma(1.5), bits=None), case, seed=5),
        strict=True,
    ):
        light = [dorf_mean().to_irradiance(one.sides), Gamma(1.5).to_irradiance(other.sides)]
        np.testing.assert_allclose(*light, atol=1e-5)


@pytest.mark.parametrize("response", [Gamma(2.2), dorf_mean()], ids=repr)
@pytest.mark.parametrize("noise", [0.0, 0.0005, 0.001, 0.003, 0.02])
@pytest.mark.parametrize("averaged", [1, 16])
def test_variance_is_the_mean_squared_error(response, noise, averaged):
    camera = Camera(response, noise=noise)
    light = np.random.default_rng(0).uniform(0.1, 0.9, size=(30, 300))
    sides = np.repeat(light[:, :1], 2, axis=1)
    group = recorded(light, sides, camera, np.random.default_rng(1), averaged=averaged)
    error = group.intensity - response.to_intensity(light)
    # 9000 samples: a mean square is known within 1.5 %; the curvature of the response adds
    # a squared bias, at most a tenth of the variance at the largest noise.
    ratio = np.mean(error**2 / group.variance)
    assert ratio == pytest.approx(1, abs=0.15)
    if noise <= 0.003:
        assert ratio == pytest.approx(1, abs=0.06)


def test_averaging_reduces_the_variance_and_is_counted():
    camera = Camera(dorf_mean(), noise=0.01)
    one, many = (random_profiles(camera, ProfileCase(averaged=n), seed=2)[0] for n in (1, 25))
    np.testing.assert_array_equal(many.count, 25)
    np.testing.assert_allclose(many.variance * 25, one.variance, rtol=1e-3)
    assert np.all(many.sides_variance < many.variance.max())


def test_levels_lie_in_range_and_differ_enough():
    for levels in (any_levels, from_black, constant_contrast):
        sides = levels(np.random.default_rng(0), 500)
        assert sides.min() >= 0
        assert sides.max() <= 1
        assert np.diff(sides).min() >= 0.19


def cloud(levels):
    sides = levels(np.random.default_rng(0), 50)
    points = np.stack([sides[:, 0], sides[:, 1] - sides[:, 0]], axis=1)
    return np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1]


def test_only_levels_of_any_kind_determine_a_response():
    # Collinear (dark side, range) leave a family of wrong answers.
    assert cloud(any_levels) > 0.5
    assert cloud(from_black) < 1e-9
    assert cloud(constant_contrast) < 1e-9


def test_a_share_of_the_profiles_can_be_bad():
    case = ProfileCase(profiles=20, bad=0.25)
    (group,) = random_profiles(EXACT, case, seed=6)
    shapes = linear_rows(group, EXACT)
    off = np.abs(shapes - np.median(shapes, axis=0)).max(axis=1)
    assert np.sum(off > 1e-3) == 5
    assert np.sort(off)[14] < 1e-4


def test_groups_have_their_own_orientation_and_blur():
    groups = random_profiles(EXACT, ProfileCase(groups=4), seed=0)
    assert len({g.orientation for g in groups}) == 4
    first, second = (linear_rows(g, EXACT)[0] for g in groups[:2])
    assert np.abs(first - second).max() > 0.02


def test_edge_shape_of_a_still_camera_is_a_pixel_wide_ramp():
    position = np.array([-1.0, -0.25, 0.0, 0.5, 2.0])
    np.testing.assert_allclose(edge_shape(position, np.zeros(7)), [0, 0.25, 0.5, 1, 1])


@pytest.mark.parametrize(
    "options",
    [
        {"groups": 0},
        {"profiles": 0},
        {"averaged": 0},
        {"samples": 3},
        {"bad": 1.5},
        {"falling": -1},
    ],
)
def test_impossible_cases_are_refused(options):
    with pytest.raises(ValueError, match="expected"):
        replace(ProfileCase(), **options)
