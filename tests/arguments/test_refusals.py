"""What was worst about wrong arguments: results that are no numbers, calls that never end."""

from dataclasses import replace
from importlib import import_module
from math import inf, nan, pi

import numpy as np
import pytest
from small_things import CAMERA, EDGE, KERNEL, PHOTO, PLANE, SHAPE

from napari_crfdeblur import arguments
from napari_crfdeblur.deconvolution import (
    HyperLaplacian,
    LocalShrinkage,
    RichardsonLucy,
    TotalVariation,
    Wiener,
    deconvolve,
)
from napari_crfdeblur.edges import Edge, EdgeStatus, Line, Rectangle, find_edges, refine_edges
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import KnownPsf, MaximumLikelihood
from napari_crfdeblur.large import restore_large
from napari_crfdeblur.profiles import ByOrientation, ProfileSource, sample_profiles
from napari_crfdeblur.profiles.group import cluster
from napari_crfdeblur.psf import camera_shake, disk, gaussian, line, projection
from napari_crfdeblur.response import Gamma, linearize, reapply
from napari_crfdeblur.simulate import (
    CameraMotion,
    ProfileCase,
    Scene,
    simulate,
    slanted_edges,
    step_image,
    street,
)

HUGE = np.full((3, 3), 1.7e308)


@pytest.mark.parametrize("method", [RichardsonLucy(), RichardsonLucy(damping=2.0)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_negative_light_counts_as_none_in_richardson_lucy(method, dtype):
    plane = (PLANE - 0.5).astype(dtype)
    assert plane.mean() < 0
    restored = deconvolve(plane, KERNEL, method)
    assert np.isfinite(restored).all()
    assert restored.min() >= 0
    if method.damping == 0:  # otherwise by the noise, which is that of the plane as it came
        np.testing.assert_array_equal(restored, deconvolve(np.maximum(plane, 0), KERNEL, method))


@pytest.mark.parametrize(
    "use",
    [
        lambda: deconvolve(PLANE, HUGE, Wiener()),
        lambda: simulate(Scene(PLANE), HUGE, CAMERA),
        lambda: KnownPsf(HUGE),
        lambda: MaximumLikelihood(psf=HUGE),
        lambda: restore_large(PHOTO, Gamma(), HUGE, Wiener()),
    ],
)
def test_a_psf_whose_sum_overflows_is_refused(use):
    with pytest.raises(ValueError, match=r"expected a PSF .*whose sum is finite"):
        use()


@pytest.mark.parametrize("sides", [(24, 33), (7, 41), (41, 7)])
def test_of_a_wide_psf_only_pixels_near_an_edge_are_projected_one_by_one(monkeypatch, sides):
    psf = np.random.default_rng(3).random(sides) + 0.1
    psf /= psf.sum()
    positions = np.linspace(-30, 30, 81)
    seen = []

    plain = projection.project_pixel

    def counted(distances, normal):
        seen.append(distances.size)
        return plain(distances, normal)

    grid = np.stack(np.mgrid[: sides[0], : sides[1]], axis=-1) - np.array(sides) // 2
    for angle in (0.0, 0.37, pi / 2, 2.5):
        normal = np.array([np.sin(angle), np.cos(angle)])
        distances = positions[:, np.newaxis, np.newaxis] - grid @ normal
        expected = (plain(distances, normal) * psf).sum(axis=(1, 2))
        with monkeypatch.context() as patch:
            patch.setattr(projection, "project_pixel", counted)
            found = projection.project(psf, angle, positions)
        np.testing.assert_allclose(found, expected, atol=1e-12)
    # Of a row of pixels, or of a column, two at most lie within reach of an edge.
    assert max(seen) <= 2 * max(sides) * positions.size


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_pixels_that_are_no_number_are_refused_at_both_ends_of_the_path(dtype):
    photo = PLANE.astype(dtype)
    photo[5, 7] = nan
    with pytest.raises(CrfDeblurError, match="not a number"):
        linearize(photo, Gamma())
    for kind in (np.uint8, np.uint16, np.float32):
        with pytest.raises(CrfDeblurError, match="not a number"):
            reapply(photo, Gamma(), kind)


@pytest.mark.parametrize("value", [nan, inf, 1e30])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_pixels_of_which_nothing_can_be_made_are_refused(value, dtype):
    plane = PLANE.astype(dtype)
    plane[5, 7] = value
    for use in (
        lambda: deconvolve(plane, KERNEL, LocalShrinkage()),
        lambda: find_edges(plane, blur_extent=5.0),
        lambda: sample_profiles(plane, [EDGE]),
    ):
        with pytest.raises(CrfDeblurError, match=r"not finite|full scale"):
            use()


@pytest.mark.parametrize("method", [Wiener, HyperLaplacian, LocalShrinkage, TotalVariation])
@pytest.mark.parametrize("weight", [1e-15, 1e-9, 1e15])
def test_any_weight_that_is_accepted_gives_a_finite_picture(method, weight):
    for dtype in (np.float32, np.float64):
        restored = deconvolve(PLANE.astype(dtype), KERNEL, method(weight=weight))
        assert np.isfinite(restored).all()


def test_edges_of_unknown_contrast_give_the_profiles_of_known_ones():
    unknown = replace(EDGE, contrast=0.0)
    (group,) = sample_profiles(PHOTO, [unknown])
    (expected,) = sample_profiles(PHOTO, [EDGE])
    np.testing.assert_array_equal(group.intensity, expected.intensity)
    assert group.orientation == expected.orientation


@pytest.mark.parametrize("seed", range(5))
def test_every_orientation_belongs_to_one_cluster_whatever_its_weight(seed):
    rng = np.random.default_rng(seed)
    angles = rng.uniform(0, pi, size=60)
    weights = rng.choice([0.0, 0.0, 1e-320, 1.0], size=60)
    for tolerance in (0.02, 0.5, 1.5):
        found = cluster(angles, weights, tolerance)
        assert sorted(i for each in found for i in each.members) == list(range(60))


def test_a_line_beside_the_photo_is_outside_and_one_in_another_country_is_refused():
    (edge,) = refine_edges(PHOTO, [Line((2, 60), (20, 62))], blur_extent=5.0)
    assert edge.status is EdgeStatus.OUTSIDE
    far = [Line((2, 3), (9, 1e9)), Rectangle(((0, 0), (0, 1e6), (9, 1e6), (9, 0)))]
    for shape in far:
        with pytest.raises(ValueError, match="expected lines within or near a photo"):
            refine_edges(PHOTO, [shape], blur_extent=5.0)
    with pytest.raises(ValueError, match="expected lines within or near a photo"):
        sample_profiles(PHOTO, [Edge((-1e6, 3), (20, 3), contrast=0.5)])


def test_an_extent_far_wider_than_the_photo_is_refused():
    for call in (
        lambda extent: find_edges(PHOTO, blur_extent=extent),
        lambda extent: refine_edges(PHOTO, [], blur_extent=extent),
    ):
        call(40.0)
        with pytest.raises(ValueError, match=r"expected a positive blur extent.* at most 330"):
            call(1e9)


@pytest.mark.parametrize(
    "make",
    [
        lambda: slanted_edges((10**6, 10**6)),
        lambda: step_image((1, 10**10)),
        lambda: street((10**5, 10**5)),
        lambda: camera_shake(10**7 + 1, 0),
        lambda: disk(1e9),
        lambda: gaussian(1e12),
        lambda: line(1e300, 0.3),
        lambda: ProfileCase(groups=10**5, profiles=10**5),
        lambda: RichardsonLucy(iterations=10**12),
        lambda: HyperLaplacian(stages=10**3),
        lambda: CameraMotion(np.full((2, 2), 1e9), np.zeros(2)),
    ],
)
def test_what_would_take_all_memory_or_time_is_refused_before(make):
    with pytest.raises(ValueError, match="expected"):
        make()


@pytest.mark.parametrize(
    "library", ["numpy", pytest.param("torch", marks=pytest.mark.torch), "array_api_strict"]
)
def test_arrays_of_every_library_pass_as_they_are(library):
    array = import_module(library).asarray(PLANE)
    assert arguments.array(array, "a plane", axes=(2,), finite=True) is array


@pytest.mark.parametrize("array", [PLANE.astype(np.float16), PHOTO > 100], ids=["half", "bool"])
def test_arrays_of_every_kind_pass_as_they_are(array):
    assert arguments.array(array, "a plane", axes=(2,), finite=True) is array
    arguments.check_pixels(array)


@pytest.mark.parametrize(
    "values",
    [
        "x",
        None,
        object(),
        [[1], [2, 3]],
        [None],
        [10**400],
        PLANE + 1j,
        np.ma.array(PLANE),
        PLANE[0],
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_is_no_array_of_real_numbers_is_refused(values):
    with pytest.raises(ValueError, match="expected a plane, got"):
        arguments.array(values, "a plane", axes=(2,))


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.int64(2)])
def test_numbers_within_their_bounds_come_back(value):
    assert arguments.number(value, "a width", least=2, below=2.5) is value
    assert arguments.number(value, "a width", above=1, most=2) is value


@pytest.mark.parametrize("value", [nan, inf, -inf, 10**400, True, "2", None, 1j, np.ones(1), 3.0])
def test_what_is_no_number_within_the_bounds_is_refused(value):
    with pytest.raises(ValueError, match="expected a width above 0 and at most 2, got"):
        arguments.number(value, "a width", above=0, most=2)


@pytest.mark.parametrize("value", [2.0, "2", None, True, 0, 4, np.float64(2), 10**400])
def test_what_is_no_whole_number_within_the_bounds_is_refused(value):
    with pytest.raises(ValueError, match="expected a side of at least 1 and at most 3, got"):
        arguments.whole(value, "a side", least=1, most=3)


def test_messages_stay_short_whatever_came():
    for value in (
        "x" * 10**6,
        list(range(10**6)),
        {i: i for i in range(10**5)},
        np.ones((999, 99)),
    ):
        with pytest.raises(ValueError, match="expected an edge, got") as caught:
            arguments.instance(value, Edge, "an edge")
        assert len(str(caught.value)) < 130


def test_a_class_is_no_instance_of_itself():
    with pytest.raises(ValueError, match="expected a method of deconvolution"):
        deconvolve(PLANE, KERNEL, Wiener)
    with pytest.raises(ValueError, match="expected a rule of grouping"):
        sample_profiles(PHOTO, [EDGE], grouping=ByOrientation)
    with pytest.raises(ValueError, match="expected the number of a channel"):
        ProfileSource(0, 0, -1)


def test_shapes_are_pairs_of_whole_numbers():
    assert slanted_edges(SHAPE, pitch=12.0).linear.shape == SHAPE
    for shape in ((24,), (24, 33, 3), (24.5, 33), "2433", None):
        with pytest.raises(ValueError, match="expected a shape"):
            slanted_edges(shape)
