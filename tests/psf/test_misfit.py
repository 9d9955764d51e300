"""What the PSF leaves unexplained: noise and no more where all is known, more where it errs."""

import io
from functools import cache

import imageio.v3 as imageio
import numpy as np
import pytest
from scipy.signal import fftconvolve

from napari_crfdeblur.deconvolution import LocalShrinkage, PlaneStatistics, deconvolve, measure
from napari_crfdeblur.psf import as_psf, camera_shake, disk, line
from napari_crfdeblur.psf.misfit import misfit
from napari_crfdeblur.simulate import street

PSFS = {"shake": camera_shake(17, 3), "line": line(13, 0.6), "disk": disk(5.5)}
SHAPE = (262, 345)


@cache
def drawn():
    return street((330, 420), seed=5).linear[..., 1]


def blurred(psf, noise, seed=0):
    """Sharp scene, and what is recorded of it with white noise."""
    scene = drawn()
    clean = fftconvolve(scene, psf, mode="valid")[: SHAPE[0], : SHAPE[1]]
    top, left = (side - 1 - side // 2 for side in psf.shape)
    sharp = scene[top : top + SHAPE[0], left : left + SHAPE[1]]
    return sharp, clean + np.random.default_rng(seed).normal(0, noise, clean.shape)


@pytest.mark.parametrize("name", PSFS)
@pytest.mark.parametrize("noise", [0.003, 0.01, 0.03])
def test_with_the_true_psf_it_is_the_noise(name, noise):
    psf = as_psf(PSFS[name])
    found = misfit([blurred(psf, noise)[1]], psf)
    # measured within 14 %: the scene has not quite the same power in a whole cell of frequencies
    assert found == pytest.approx(noise, rel=0.2)


@pytest.mark.parametrize("name", PSFS)
@pytest.mark.parametrize("other", PSFS)
def test_another_psf_leaves_more(name, other):
    if name != other:
        plane = blurred(as_psf(PSFS[name]), 0.003)[1]
        right, wrong = (misfit([plane], as_psf(PSFS[each])) for each in (name, other))
        # measured 1.4 (a disk taken for a shake) to 5 times
        assert wrong > 1.2 * right


@pytest.mark.parametrize("name", ["shake", "line"])
def test_a_motion_the_other_way_leaves_much_more(name):
    psf = as_psf(PSFS[name])
    plane = blurred(psf, 0.003)[1]
    assert misfit([plane], as_psf(psf[:, ::-1])) > 2 * misfit([plane], psf)


def test_a_point_blocks_nothing_so_that_noise_cannot_be_told_from_the_picture():
    plane = blurred(as_psf(PSFS["shake"]), 0.01)[1]
    assert misfit([plane], np.ones((1, 1))) is None
    assert misfit([plane], np.ones((1, 1)), least_blocked=0.0) < 0.011


def test_compression_shows_where_the_finest_details_hide_it():
    psf = as_psf(PSFS["shake"])
    _, plane = blurred(psf, 0.002)
    file = io.BytesIO()
    pixels = np.clip(np.rint(255 * plane), 0, 255).astype(np.uint8)
    imageio.imwrite(file, pixels, extension=".jpg", quality=80)
    stored = imageio.imread(file.getvalue(), extension=".jpg") / 255
    assert measure(stored).noise < measure(plane).noise
    assert misfit([stored], psf) > 2 * misfit([plane], psf)


@pytest.mark.parametrize(("factor", "shift"), [(3.0, 0.0), (0.01, -7.0)])
def test_it_has_the_unit_of_the_plane(factor, shift):
    psf = as_psf(PSFS["disk"])
    _, plane = blurred(psf, 0.01)
    # the shift costs three digits of the plane's fifteen, and squares three more
    assert misfit([factor * plane + shift], psf) == pytest.approx(
        factor * misfit([plane], psf), rel=1e-7
    )


@pytest.mark.parametrize("name", PSFS)
def test_rounding_does_not_show(name):
    psf = as_psf(PSFS[name])
    _, plane = blurred(psf, 0.01)
    rounded = plane * (1 + 1e-15 * np.random.default_rng(0).standard_normal(SHAPE))
    # pixels of 16 bits are alike, whatever the processor's order of additions
    assert misfit([rounded], psf) == pytest.approx(misfit([plane], psf), rel=1e-7)


def test_parts_tell_as_much_as_the_whole():
    psf = as_psf(PSFS["shake"])
    _, plane = blurred(psf, 0.01)
    parts = [plane[:, :170], plane[:, -170:]]
    assert misfit(parts, psf) == pytest.approx(misfit([plane], psf), rel=0.1)


def test_clipped_pixels_are_left_out():
    psf = as_psf(PSFS["shake"])
    _, plane = blurred(psf, 0.003)
    plane[100:140, 50:90] *= 8
    clipped = plane > 1.2
    recorded = np.minimum(plane, 1.2)
    free = misfit([blurred(psf, 0.003)[1]], psf)
    assert misfit([recorded], psf, [clipped]) < 1.3 * free
    assert misfit([recorded], psf) > 1.5 * free


def test_where_all_is_clipped_it_is_measured_all_the_same():
    psf = as_psf(PSFS["shake"])
    _, plane = blurred(psf, 0.003)
    assert misfit([plane], psf, [np.ones(SHAPE, dtype=bool)]) == misfit([plane], psf)


@pytest.mark.parametrize(
    ("plane", "psf"),
    [
        (np.zeros((40, 300)), disk(2)),
        (np.zeros((100, 100)), np.full((51, 51), 1.0)),
        (np.zeros((70, 80, 90)), np.full((3, 3, 3), 1.0)),
    ],
    ids=["narrow", "wide PSF", "volume"],
)
def test_too_small_and_volumes_tell_nothing(plane, psf):
    assert misfit([plane], as_psf(psf)) is None


def test_an_even_plane_has_none():
    # but for rounding
    assert misfit([np.full((100, 120), 0.3)], as_psf(disk(2))) == pytest.approx(0, abs=1e-15)
    assert misfit([np.zeros((100, 120))], as_psf(disk(2))) == 0


def test_what_is_unexplained_sets_the_weight():
    known = PlaneStatistics(0.006, 1.0, misfit=0.006)
    worse = PlaneStatistics(0.006, 1.0, misfit=0.02)
    assert known.relative_noise() == pytest.approx(0.006)
    assert worse.relative_noise() > 0.02
    assert worse.relative_noise(0.001) == pytest.approx(0.006)
    assert PlaneStatistics(0.0, 1.0).relative_noise() > 0


def test_a_wrong_psf_is_used_with_caution():
    psf = as_psf(PSFS["shake"])
    sharp, plane = blurred(psf, 0.003)
    by_itself, bold = (
        deconvolve(plane, as_psf(PSFS["line"]), method)[20:-20, 20:-20] - sharp[20:-20, 20:-20]
        for method in (LocalShrinkage(), LocalShrinkage(model_error=0.004))
    )
    # much of the error is ringing
    assert np.square(by_itself).mean() < 0.8 * np.square(bold).mean()
