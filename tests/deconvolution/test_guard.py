"""The guard: right restorations stay as they are, wrong ones are taken back as far as needed."""

from dataclasses import dataclass

import numpy as np
import pytest
from leaves import leaves, recorded

from napari_crfdeblur.deconvolution import (
    Deconvolver,
    Guarded,
    LocalShrinkage,
    RichardsonLucy,
    Tiled,
    Wiener,
    deconvolve,
)
from napari_crfdeblur.pipeline import DeblurOptions
from napari_crfdeblur.psf import as_psf, gaussian, kernel_a, line

METHODS = [LocalShrinkage(), Wiener(), Wiener(weight=1e-3), RichardsonLucy(10)]
METHODS += [Tiled(LocalShrinkage(), side=180)]


def streets(shape=(150, 190)):
    return leaves(shape, count=400, smallest=3, lights=(0, 0.9))


def photographed(sharp, psf, noise=0.003):
    return recorded(sharp, psf, noise, seed=5).clip(0, 1).astype(np.float32)


def error(plane, sharp):
    inside = (slice(10, -10),) * 2
    return float(np.sqrt(np.mean((plane - sharp)[inside] ** 2)))


@dataclass(frozen=True, slots=True)
class Fixed(Deconvolver):
    """Gives a picture that is known."""

    picture: np.ndarray

    def run(self, plane, psf, *, clipped=None, statistics=None):  # noqa: ARG002
        yield from ()
        return self.picture.astype(plane.dtype)


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_with_the_true_psf_nothing_changes(method):
    sharp, psf = streets(), as_psf(kernel_a())
    plane = photographed(sharp, psf)
    free, guarded = (deconvolve(plane, psf, each) for each in (method, Guarded(method)))
    assert error(free, sharp) < error(plane, sharp)
    np.testing.assert_array_equal(guarded, free)


@pytest.mark.parametrize("psf", [line(15.0, 2.0), gaussian(3.0)], ids=["turned", "another"])
@pytest.mark.parametrize("method", [LocalShrinkage(), Wiener(weight=1e-3)], ids=repr)
def test_with_a_wrong_psf_much_less_harm_is_done(method, psf):
    sharp, wrong = streets(), as_psf(psf)
    plane = photographed(sharp, as_psf(kernel_a()))
    free, guarded = (deconvolve(plane, wrong, each) for each in (method, Guarded(method)))
    harm = error(free, sharp) - error(plane, sharp)
    assert harm > 0.2
    assert error(guarded, sharp) - error(plane, sharp) < 0.6 * harm


def test_garbage_is_taken_back():
    sharp, psf = streets(), as_psf(kernel_a())
    plane = photographed(sharp, psf)
    garbage = plane + 5 * np.sin(np.arange(150))[:, None]
    back = deconvolve(plane, psf, Guarded(Fixed(garbage)))
    assert error(garbage, plane) > 3
    assert error(back, plane) < 0.05


def test_only_where_it_is_wrong_it_is_taken_back():
    sharp, psf = streets((150, 300)), as_psf(kernel_a())
    plane = photographed(sharp, psf)
    half_wrong = sharp.copy()
    half_wrong[:, 200:] += 5 * np.sin(np.arange(150))[:, None]
    found = deconvolve(plane, psf, Guarded(Fixed(half_wrong)))
    np.testing.assert_array_equal(found[:, :150], sharp[:, :150].astype(np.float32))
    assert error(found[:, 230:], plane[:, 230:]) < 0.05


def test_more_is_taken_back_the_less_is_tolerated():
    sharp, wrong = streets(), as_psf(line(15.0, 2.0))
    plane = photographed(sharp, as_psf(kernel_a()))
    errors = [
        error(deconvolve(plane, wrong, Guarded(Wiener(weight=1e-3), share)), plane)
        for share in (0.001, 0.01, 0.04, 0.2)
    ]
    assert sorted(set(errors)) == errors


def test_noise_about_zero_is_not_impossible():
    rng = np.random.default_rng(7)
    plane = rng.normal(0, 0.01, (90, 110)).clip(-0.01, None)
    sharp = plane + rng.normal(0, 0.01, plane.shape)
    found = deconvolve(plane, as_psf(kernel_a()), Guarded(Fixed(sharp)))
    np.testing.assert_array_equal(found, sharp)


@pytest.mark.parametrize("factor", [0.01, 300.0])
def test_the_unit_does_not_matter(factor):
    sharp, wrong = streets(), as_psf(line(15.0, 2.0))
    plane = photographed(sharp, as_psf(kernel_a())).astype(np.float64)
    here, there = (deconvolve(each, wrong, Guarded(Wiener())) for each in (plane, factor * plane))
    np.testing.assert_allclose(there, factor * here, rtol=1e-6, atol=1e-6 * factor)


@pytest.mark.parametrize(
    ("shape", "psf_shape"), [((9, 40), (9, 3)), ((12, 30, 28), (3, 5, 5)), ((40, 51, 3), (5, 7))]
)
def test_narrow_planes_volumes_and_colors_are_judged_too(shape, psf_shape):
    rng = np.random.default_rng(6)
    plane, psf = rng.random(shape).astype(np.float32), as_psf(rng.random(psf_shape))
    found = deconvolve(plane, psf, Guarded(Wiener()))
    assert found.shape == shape
    assert found.dtype == np.float32
    assert np.isfinite(found).all()


def test_a_plane_with_an_offset_is_judged_by_its_darkest_light():
    sharp, psf = streets(), as_psf(kernel_a())
    plane = photographed(sharp, psf) - np.float32(0.4)
    free, guarded = (deconvolve(plane, psf, each) for each in (Wiener(), Guarded(Wiener())))
    inside = (slice(10, -10),) * 2
    assert np.abs(guarded - free)[inside].mean() < 0.05 * np.abs(free - plane)[inside].mean()


def test_a_guard_of_a_guard_is_refused_and_the_path_makes_none():
    with pytest.raises(ValueError, match="guarded already"):
        Guarded(Guarded(Wiener()))
    options = DeblurOptions()
    assert options.guarding(Wiener()) == Guarded(Wiener())
    assert options.guarding(Guarded(Wiener())) == Guarded(Wiener())
    assert options.guarding(Tiled(Wiener(), side=90)) == Tiled(Guarded(Wiener()), side=90)
    assert DeblurOptions(guard=False).guarding(Wiener()) == Wiener()
