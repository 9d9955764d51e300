"""The portfolio: the most plausible of several searches."""

from functools import cache

import numpy as np
import pytest
from blurred_shapes import blurred
from scipy.signal import fftconvolve

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.psf import (
    Evidence,
    L0Gradient,
    MinimalPixels,
    Portfolio,
    PsfEstimate,
    PsfStatus,
    Variational,
    camera_shake,
    estimate_psf,
)
from napari_crfdeblur.quality import kernel_similarity

LARGE = camera_shake(31, 6)


@cache
def of_large_blur() -> PsfEstimate:
    return estimate_psf(blurred(LARGE, 230, 290), Portfolio())


def test_a_large_blur_is_found_without_its_size() -> None:
    assert kernel_similarity(of_large_blur().psf, LARGE) > 0.8
    assert max(of_large_blur().psf.shape) < 2 * len(LARGE)


def test_it_tells_how_far_the_searches_agree() -> None:
    figures = of_large_blur().diagnostics
    assert 0 < figures["agreement"] <= 1
    assert figures["margin"] > -0.1


@pytest.mark.parametrize("method", [L0Gradient, MinimalPixels])
def test_large_blur_is_seen_in_all_of_the_picture(method) -> None:
    photo = blurred(LARGE, 230, 290)
    found = estimate_psf(photo, method(size=47, region=120))
    assert kernel_similarity(found.psf, LARGE) > 0.75


def test_on_a_night_photo_the_streaks_of_lamps_are_the_psf() -> None:
    psf = camera_shake(19, 4)
    random = np.random.default_rng(3)
    night = np.full((220, 300), 0.01)
    for row, column in ((40, 50), (60, 230), (150, 90), (170, 250), (110, 170)):
        night[row, column] = random.uniform(8, 30)
    photo = fftconvolve(night, psf, mode="same") + random.normal(0, 0.002, night.shape)
    found = estimate_psf(photo, Portfolio())
    assert found.status is PsfStatus.GOOD
    assert found.diagnostics["streaks"] >= 3
    assert kernel_similarity(found.psf, psf) > 0.95


def test_a_photo_smaller_than_three_psfs_is_refused() -> None:
    with pytest.raises(CrfDeblurError, match="choose a smaller PSF size"):
        estimate_psf(blurred(camera_shake(9, 3), 60, 90), Portfolio(size=21))


def test_one_search_is_enough_where_light_is_linear_and_the_picture_agrees() -> None:
    photo = blurred(camera_shake(13, 2), 220, 260)
    alone, found = (estimate_psf(photo, method) for method in (Variational(), Portfolio()))
    assert alone.status is PsfStatus.GOOD
    assert np.array_equal(found.psf, alone.psf)


def test_where_light_is_a_guess_one_search_is_not_enough() -> None:
    photo = blurred(camera_shake(13, 2), 220, 260)
    found = estimate_psf(Evidence(photo, certain=False), Portfolio())
    assert kernel_similarity(found.psf, camera_shake(13, 2)) > 0.85
    assert "agreement" in found.diagnostics
