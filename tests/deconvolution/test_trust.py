"""How far a result can be believed: expected errors beside true ones, and the words for it."""

import numpy as np
import pytest
from leaves import leaves, recorded

from napari_crfdeblur.deconvolution import (
    LocalShrinkage,
    Trust,
    Verdict,
    deconvolve,
    guard,
    judge,
    verdict,
    verdict_sentence,
)
from napari_crfdeblur.psf import as_psf, camera_shake, gaussian, kernel_a, line

INSIDE = (slice(12, -12),) * 2


def scene():
    return leaves((160, 210), count=600, smallest=3, lights=(0.05, 0.9))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def restored(sharp, blurring, used, noise):
    plane = recorded(sharp, blurring, noise, seed=4).astype(np.float32)
    return plane, deconvolve(plane, used, LocalShrinkage())


@pytest.mark.parametrize("noise", [0.002, 0.01])
@pytest.mark.parametrize("psf", [kernel_a(), camera_shake(9, seed=2), gaussian(1.5)])
def test_with_the_true_psf_the_expected_error_is_about_the_true_one(psf, noise):
    sharp, psf = scene(), as_psf(psf)
    plane, free = restored(sharp, psf, psf, noise)
    found = judge(plane, free, psf)
    # the prior is of pictures of nature, and the method is better than a linear one
    assert 0.4 < rms((found.sharp - sharp)[INSIDE]) / rms(found.trust.error[INSIDE]) < 1.6


def test_what_is_believed_more_has_gained_more():
    sharp, psf = scene(), as_psf(kernel_a())
    plane, free = restored(sharp, psf, psf, 0.005)
    found = judge(plane, free, psf)
    believed = found.trust.believed[INSIDE]
    more = believed > np.median(believed)
    before, after = (np.square(each - sharp)[INSIDE] for each in (plane, found.sharp))
    gains = [before[part].mean() / after[part].mean() for part in (more, ~more)]
    assert gains[0] > 1.5 * gains[1] > 1.5


def test_what_was_taken_back_is_not_believed_and_errs_like_the_photo():
    sharp, psf, wrong = scene(), as_psf(kernel_a()), as_psf(line(15.0, 2.0))
    plane, free = restored(sharp, psf, wrong, 0.003)
    trust = judge(plane, free, wrong).trust
    assert trust.kept.max() < 0.1
    assert trust.believed.max() < 0.1
    assert 0.3 < rms((plane - sharp)[INSIDE]) / rms(trust.error[INSIDE]) < 2


@pytest.mark.parametrize("factor", [0.01, 200.0])
def test_the_unit_does_not_matter(factor):
    psf = as_psf(kernel_a())
    plane, free = restored(scene(), psf, psf, 0.005)
    one, other = (judge(unit * plane, unit * free, psf).trust for unit in (1.0, factor))
    np.testing.assert_allclose(other.error, factor * one.error, rtol=1e-3)
    np.testing.assert_allclose(other.believed, one.believed, atol=1e-3)


def test_of_clipped_light_hardly_half_is_believed():
    psf = as_psf(kernel_a())
    plane, free = restored(scene(), psf, psf, 0.005)
    clipped = np.zeros(plane.shape, dtype=bool)
    clipped[60:100, 80:130] = True
    trust = judge(plane, free, psf, clipped=clipped).trust
    assert trust.believed[70:90, 90:120].max() <= 0.5
    other = judge(plane, free, psf).trust
    assert other.believed[70:90, 90:120].max() > 0.6
    far = (slice(120, None), slice(None))
    np.testing.assert_allclose(trust.believed[far], other.believed[far], atol=0.15)


def test_a_response_that_is_not_known_adds_its_share():
    psf = as_psf(kernel_a())
    plane, free = restored(scene(), psf, psf, 0.005)
    one = judge(plane, free, psf).trust
    other = judge(plane, free, psf, slope_errors=[lambda light: 0 * light + 0.5]).trust
    added = np.sqrt(np.mean(other.error**2) - np.mean(one.error**2))
    assert added == pytest.approx(0.5 * rms(free - plane), rel=0.1)
    assert other.believed.mean() < one.believed.mean()


@pytest.mark.parametrize(
    ("shape", "sides"),
    [((40, 50, 3), (5, 7)), ((12, 30, 28), (3, 5, 5)), ((9, 20, 24, 2), (3, 3, 5))],
)
def test_colors_and_volumes_have_one_map(shape, sides):
    rng = np.random.default_rng(3)
    plane, psf = rng.random(shape).astype(np.float32), as_psf(rng.random(sides))
    trust = judge(plane, plane**2, psf).trust
    for each in (trust.kept, trust.error, trust.believed):
        assert each.shape == shape[: len(sides)]
        assert each.dtype == np.float32
        assert np.isfinite(each).all()
    assert 0 <= trust.believed.min() <= trust.believed.max() <= 1


def test_an_even_picture_is_known_exactly():
    plane = np.full((60, 70), 0.4, np.float32)
    psf = as_psf(kernel_a())
    assert judge(plane, plane.copy(), psf).trust.error.max() < 0.01


def test_it_guards_unless_told_not_to():
    sharp, psf, wrong = scene(), as_psf(kernel_a()), as_psf(line(15.0, 2.0))
    plane, free = restored(sharp, psf, wrong, 0.003)
    np.testing.assert_array_equal(
        judge(plane, free, wrong).sharp, guard(plane, free, wrong.shape).sharp
    )
    found = judge(plane, free, wrong, guarded=False)
    np.testing.assert_array_equal(found.sharp, free)
    np.testing.assert_array_equal(found.trust.kept, 1)


def of(kept):
    return Trust(kept, kept, kept)


def test_the_words_say_how_much_and_where():
    whole = np.ones((90, 120), np.float32)
    assert verdict_sentence(of(whole)) == Verdict.RESTORED.value
    assert verdict(of(0 * whole)) is Verdict.PHOTO
    for rows, columns, words in (
        (slice(30), slice(40), "upper left"),
        (slice(60, None), slice(None), "lower"),
        (slice(None), slice(80, None), "right"),
        (slice(30, 60), slice(40, 80), "about its middle"),
    ):
        kept = whole.copy()
        kept[rows, columns] = 0.2
        sentence = verdict_sentence(of(kept))
        assert verdict(of(kept)) is Verdict.PARTLY
        assert words in sentence
        assert f"{np.mean(kept < 0.5):.0%}" in sentence


def test_a_volume_is_judged_as_one():
    kept = np.ones((4, 30, 30), np.float32)
    kept[:2, :, 20:] = 0
    assert "right" in verdict_sentence(of(kept))


def test_words_of_nothing_are_refused():
    with pytest.raises(ValueError, match="Trust"):
        verdict(0.5)
