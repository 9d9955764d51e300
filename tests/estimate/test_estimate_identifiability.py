"""Which profiles cannot tell the response, and what the user is told."""

import numpy as np
import pytest

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    KnownPsf,
    MeanProfile,
    PolynomialFit,
    RankMinimization,
    ResponseStatus,
    estimate_response,
)
from napari_crfdeblur.estimate.identifiability import (
    LEAST_COLLINEARITY,
    collinearity,
    levels_apart,
)
from napari_crfdeblur.response import Gamma, Identity
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles
from napari_crfdeblur.simulate.profiles import constant_contrast, from_black

ALONE = PolynomialFit(resamples=0)
CAMERA = Camera(Gamma(2.0), noise=0.003)
METHODS = [RankMinimization(polynomial=ALONE), MeanProfile(ALONE)]
each_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)

RANGES = np.array([0.2, 0.35, 0.5, 0.8])
FAMILIES = {
    "common dark side": (np.full(4, 0.137), RANGES),
    "common bright side": (0.9 - RANGES, RANGES),
    "constant contrast": (RANGES / 3, RANGES),
    "constant contrast beyond black": ((RANGES - 0.1234) / 3, RANGES),
    "equal ranges": (np.array([0.0, 0.1, 0.25, 0.6]), np.full(4, 0.3)),
    "common dark side, falling": (0.137 + RANGES, -RANGES),
}
families = pytest.mark.parametrize(("offsets", "ranges"), FAMILIES.values(), ids=FAMILIES)
# The point through which the lines go is found to half of the last step, .025 / 1000.
ZERO = 1.3e-5


@families
def test_collinearity_is_zero_in_every_family_that_cannot_tell(offsets, ranges):
    assert collinearity([offsets], [ranges]) == pytest.approx(0, abs=ZERO)


@families
def test_one_profile_off_the_line_can_tell(offsets, ranges):
    offsets = np.append(offsets, 0.45)
    ranges = np.append(ranges, 0.1)
    assert collinearity([offsets], [ranges]) > 0.01


@families
def test_more_groups_of_the_same_family_add_nothing(offsets, ranges):
    halves = [offsets[:2], offsets[1:]], [ranges[:2], ranges[1:]]
    assert collinearity(*halves) == pytest.approx(0, abs=ZERO)


def test_groups_of_constant_contrast_each_add_nothing():
    # Each line goes through black, whatever its slope: any power fits all of them.
    assert collinearity([RANGES / 3, RANGES / 7], [RANGES, RANGES]) == pytest.approx(0, abs=ZERO)


def test_groups_with_unlike_dark_sides_can_tell():
    # Alone each is a family; but no line through one point holds both.
    dark = [np.full(4, 0.05), np.full(4, 0.3)]
    assert collinearity(dark, [RANGES, 0.8 * RANGES]) > LEAST_COLLINEARITY


def test_both_polarities_from_one_dark_side_can_tell():
    falling = np.array([False, True, False, True])
    offsets = np.where(falling, 0.1 + RANGES, 0.1)
    assert collinearity([offsets], [np.where(falling, -RANGES, RANGES)]) > LEAST_COLLINEARITY


@pytest.mark.parametrize(
    ("levels", "able"), [(None, True), (from_black, False), (constant_contrast, False)]
)
def test_levels_apart_judges_profiles_before_the_fit(levels, able):
    case = ProfileCase() if levels is None else ProfileCase(levels=levels)
    groups = random_profiles(CAMERA, case, seed=4)
    assert (levels_apart(groups, CAMERA.response) >= LEAST_COLLINEARITY) is able
    assert levels_apart([], Identity()) == 0


@each_method
@pytest.mark.parametrize("levels", [from_black, constant_contrast])
def test_an_estimate_of_such_profiles_is_doubtful(method, levels):
    groups = random_profiles(CAMERA, ProfileCase(levels=levels), seed=4)
    estimate = estimate_response(groups, method)
    assert estimate.status is ResponseStatus.DOUBTFUL
    assert "add edges" in estimate.status.value


@each_method
@pytest.mark.parametrize("seed", [0, 1, 3])
def test_an_estimate_of_varied_profiles_is_good(method, seed):
    groups = random_profiles(CAMERA, ProfileCase(groups=3), seed=seed)
    assert estimate_response(groups, method).status is ResponseStatus.GOOD


@each_method
@pytest.mark.parametrize("profiles", [1, 2])
def test_too_few_profiles_are_refused_with_what_to_do(method, profiles):
    groups = random_profiles(CAMERA, ProfileCase(groups=4, profiles=profiles), seed=4)
    with pytest.raises(CrfDeblurError, match=r"at least 3 straight edges.*add edges, or give"):
        estimate_response(groups, method)


@each_method
def test_no_profiles_are_refused(method):
    with pytest.raises(CrfDeblurError, match="add edges, or give the response"):
        estimate_response([], method)


@each_method
@pytest.mark.parametrize("falling", [0, 0.5])
def test_one_common_range_is_refused(method, falling):
    def equal(rng, rows):  # noqa: ARG001, a drawing of levels
        return np.tile([0.2, 0.7], (rows, 1))

    case = ProfileCase(levels=equal, falling=falling)
    with pytest.raises(CrfDeblurError, match=r"same two levels.*add edges between other levels"):
        estimate_response(random_profiles(Camera(Gamma(2.0)), case, seed=4), method)


def test_a_known_psf_needs_profiles():
    with pytest.raises(CrfDeblurError, match="add straight edges"):
        estimate_response([], KnownPsf(np.ones((3, 5))))
