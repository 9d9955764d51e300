"""The guard: right restorations stay as they are, wrong ones are taken back as far as needed."""

import numpy as np
import pytest
from leaves import leaves, recorded

from napari_crfdeblur.deconvolution import (
    LocalShrinkage,
    RichardsonLucy,
    Swing,
    Wiener,
    deconvolve,
    guard,
    judge,
    swing_of,
)
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import GivenResponse
from napari_crfdeblur.pipeline import DeblurOptions, deblur
from napari_crfdeblur.psf import GivenPsf, as_psf, gaussian, kernel_a, line
from napari_crfdeblur.response import Identity, clipped_light

METHODS = [LocalShrinkage(), Wiener(), Wiener(weight=1e-3), RichardsonLucy(10)]
SIDES = kernel_a().shape


def streets(shape=(150, 190)):
    return leaves(shape, count=400, smallest=3, lights=(0, 0.9))


def photographed(sharp, psf, noise=0.003):
    return recorded(sharp, psf, noise, seed=5).clip(0, 1).astype(np.float32)


def error(plane, sharp):
    inside = (slice(10, -10),) * 2
    return float(np.sqrt(np.mean((plane - sharp)[inside] ** 2)))


def stripes(shape):
    rows = 5 * np.sin(np.arange(shape[0]))[:, None]
    return np.broadcast_to(rows, shape).astype(np.float32)


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_with_the_true_psf_hardly_anything_changes(method):
    sharp, psf = streets(), as_psf(kernel_a())
    plane = photographed(sharp, psf)
    free = deconvolve(plane, psf, method)
    found = guard(plane, free, psf.shape)
    assert error(free, sharp) < error(plane, sharp)
    assert error(found.sharp, sharp) < 1.01 * error(free, sharp)
    assert (found.kept == 1).mean() > 0.95
    np.testing.assert_array_equal(found.sharp[found.kept == 1], free[found.kept == 1])


@pytest.mark.parametrize("psf", [line(15.0, 2.0), gaussian(3.0)], ids=["turned", "another"])
@pytest.mark.parametrize("method", [LocalShrinkage(), Wiener(weight=1e-3)], ids=repr)
def test_with_a_wrong_psf_hardly_any_harm_is_done(method, psf):
    sharp, wrong = streets(), as_psf(psf)
    plane = photographed(sharp, as_psf(kernel_a()))
    free = deconvolve(plane, wrong, method)
    found = guard(plane, free, wrong.shape).sharp
    harm = error(free, sharp) - error(plane, sharp)
    assert harm > 0.2
    assert error(found, sharp) - error(plane, sharp) < 0.1 * harm


def test_garbage_is_taken_back():
    sharp, psf = streets(), as_psf(kernel_a())
    plane = photographed(sharp, psf)
    found = guard(plane, plane + stripes(plane.shape), psf.shape)
    np.testing.assert_allclose(found.sharp, plane, atol=1e-6)
    np.testing.assert_array_equal(found.kept, np.zeros(plane.shape))


def test_in_a_part_of_a_picture_only_what_is_wrong_there_is_taken_back():
    sharp = streets((150, 300))
    plane = photographed(sharp, as_psf(kernel_a()))
    half_wrong = sharp.astype(np.float32)
    half_wrong[:, 200:] += stripes((150, 100))
    found = guard(plane, half_wrong, SIDES, whole=Swing(0.0, 0.0, 0.01)).sharp
    np.testing.assert_array_equal(found[:, :150], half_wrong[:, :150])
    assert error(found[:, 230:], plane[:, 230:]) < 0.05


def test_what_is_wrong_in_most_places_is_doubted_everywhere():
    sharp = streets((150, 300))
    plane = photographed(sharp, as_psf(kernel_a()))
    mostly_wrong = sharp.astype(np.float32)
    mostly_wrong[:, 100:] += 0.2 * stripes((150, 200))
    found = guard(plane, mostly_wrong, SIDES)
    assert found.kept[:, :60].max() < 0.5


def test_dark_places_that_are_below_zero_by_a_constant_are_possible():
    ink = (streets() > 0.3).astype(np.float32)
    plane = photographed(0.1 + 0.8 * ink, as_psf(kernel_a()))
    darker = 0.9 * ink - 0.1 * (1 - ink)
    assert (darker < -0.05).mean() > 0.1
    np.testing.assert_array_equal(guard(plane, darker, SIDES).kept, 1)


def test_all_channels_keep_the_same_share():
    sharp = streets()
    plane = photographed(sharp, as_psf(kernel_a()))
    colors = np.stack([plane, 0.8 * plane, 0.5 * plane], axis=-1)
    wrong = np.stack([sharp, sharp + stripes(plane.shape), sharp], axis=-1).astype(np.float32)
    found = guard(colors, wrong, SIDES)
    assert found.kept.shape == plane.shape
    share = found.kept[..., None]
    np.testing.assert_allclose(
        found.sharp, share * wrong + (1 - share) * colors, rtol=1e-5, atol=1e-5
    )
    assert error(found.sharp[..., 0], colors[..., 0]) < 0.05


def test_noise_about_zero_is_not_impossible():
    rng = np.random.default_rng(7)
    plane = rng.normal(0, 0.01, (90, 110)).clip(-0.01, None)
    sharp = plane + rng.normal(0, 0.01, plane.shape)
    np.testing.assert_array_equal(guard(plane, sharp, SIDES).sharp, sharp)


@pytest.mark.parametrize("factor", [0.01, 300.0])
def test_the_unit_does_not_matter(factor):
    sharp, wrong = streets(), as_psf(line(15.0, 2.0))
    plane = photographed(sharp, as_psf(kernel_a())).astype(np.float64)
    free = deconvolve(plane, wrong, Wiener())
    here, there = (guard(unit * plane, unit * free, wrong.shape) for unit in (1.0, factor))
    np.testing.assert_allclose(there.sharp, factor * here.sharp, rtol=1e-6, atol=1e-6 * factor)
    np.testing.assert_allclose(there.kept, here.kept, atol=1e-6)


@pytest.mark.parametrize(
    ("shape", "psf_shape"),
    [
        ((9, 40), (9, 3)),
        ((12, 30, 28), (3, 5, 5)),
        ((40, 51, 3), (5, 7)),
        ((4, 9, 8, 2), (1, 3, 3)),
    ],
)
def test_narrow_planes_volumes_and_colors_are_judged_too(shape, psf_shape):
    rng = np.random.default_rng(6)
    plane, psf = rng.random(shape).astype(np.float32), as_psf(rng.random(psf_shape))
    found = guard(plane, deconvolve(plane, psf, Wiener()), psf.shape)
    assert found.sharp.shape == shape
    assert found.kept.shape == shape[: len(psf_shape)]
    assert found.sharp.dtype == np.float32
    assert np.isfinite(found.sharp).all()


def test_a_plane_with_an_offset_is_judged_by_its_darkest_light():
    sharp, psf = streets(), as_psf(kernel_a())
    plane = photographed(sharp, psf) - np.float32(0.4)
    free = deconvolve(plane, psf, Wiener())
    change = np.abs(guard(plane, free, psf.shape).sharp - free)
    assert change.mean() < 0.03 * np.abs(free - plane).mean()


def test_the_swing_of_a_whole_is_the_mean_of_those_of_equal_parts():
    sharp = streets((160, 200))
    plane = photographed(sharp, as_psf(kernel_a()), noise=0.0)
    wrong = (plane + 0.2 * stripes(plane.shape)).astype(np.float64)
    whole = swing_of(plane, wrong, (8, 8))
    parts = [swing_of(plane[i : i + 80], wrong[i : i + 80], (8, 8)) for i in (0, 80)]
    joint = Swing.mean(parts)
    assert joint.changed == pytest.approx(whole.changed)
    assert joint.below == pytest.approx(whole.below, rel=0.05)
    assert joint.above == pytest.approx(whole.above, rel=0.05)


def test_what_cannot_be_judged_is_refused():
    plane = np.zeros((20, 30), np.float32)
    with pytest.raises(ValueError, match="one shape"):
        guard(plane, plane[:10], (5, 5))
    with pytest.raises(ValueError, match="fits the sides"):
        guard(plane, plane, (5, 5, 5))
    with pytest.raises(ValueError, match="sides"):
        guard(plane, plane, (5,))
    with pytest.raises(CrfDeblurError, match="finite"):
        guard(plane, plane + np.nan, (5, 5))
    with pytest.raises(ValueError, match="swing"):
        guard(plane, plane, (5, 5), whole=0.3)


def test_the_path_guards_unless_told_not_to():
    sharp, wrong = streets(), as_psf(line(15.0, 2.0))
    photo = photographed(sharp, as_psf(kernel_a()))
    given = {"response": GivenResponse(Identity()), "psf": GivenPsf(wrong), "method": Wiener()}
    free, guarded = (deblur(photo, DeblurOptions(**given, guard=on)) for on in (False, True))
    clipped = clipped_light(photo)
    expected = judge(free.linear, free.sharp_linear, wrong, clipped=clipped).sharp
    np.testing.assert_array_equal(guarded.sharp_linear, expected)
    harms = [error(each.photo, sharp) - error(photo, sharp) for each in (free, guarded)]
    assert harms[1] < 0.3 * harms[0]
