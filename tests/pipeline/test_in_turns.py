"""The response in the light of the PSF: only where the photo speaks for it."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.estimate import GivenResponse, MaximumLikelihood
from napari_crfdeblur.pipeline import DeblurOptions, Intermediates, Stage, walking
from napari_crfdeblur.pipeline.in_turns import MOST_LEFT, find_psf_in_turns, unexplained
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import GivenPsf, camera_shake
from napari_crfdeblur.quality import response_error
from napari_crfdeblur.response import Gamma, linearize
from napari_crfdeblur.simulate import Camera, simulate, street

PSF = camera_shake(15, 8)


def taken(seed, truth):
    scene = street((300, 380), seed=seed)
    return simulate(scene, PSF, Camera(truth, noise=0.002), seed=1).photo


def both(seed, truth, psf=PSF):
    """What there is with the response from the edges alone, and in turns with the PSF."""
    options = DeblurOptions(response=MaximumLikelihood(), blur_extent=15.0, psf=GivenPsf(psf))
    have = drain(walking(Intermediates(taken(seed, truth)), options, until=Stage.PSF))
    start = replace(have, psf=None)
    return have, drain(walking(start, options, until=Stage.PSF, replaced=IN_TURNS))


IN_TURNS = {Stage.PSF: find_psf_in_turns}


def test_a_response_that_explains_the_photo_better_is_taken():
    truth = Gamma(2.6)
    have, found = both(3, truth)
    assert unexplained(found) < MOST_LEFT * unexplained(have)
    covered = have.response.estimates[0].covered
    old, new = (response_error(own.response.curve, truth, covered) for own in (have, found))
    assert new < old / 2
    np.testing.assert_array_equal(found.linear, linearize(found.photo, found.response.curve))


@pytest.mark.parametrize("psf", [PSF, PSF[::-1, ::-1]], ids=["true", "turned"])
def test_a_response_that_does_not_is_left_alone(psf):
    have, found = both(4, Gamma(1.5), psf)
    assert found.response.curve == have.response.curve
    np.testing.assert_array_equal(found.linear, have.linear)


def test_a_given_response_stays():
    options = DeblurOptions(response=GivenResponse(Gamma(2.2)), psf=GivenPsf(PSF))
    have = Intermediates(taken(3, Gamma(2.6)))
    found = drain(walking(have, options, until=Stage.PSF, replaced=IN_TURNS))
    assert found.response.curve == Gamma(2.2)


def test_the_right_response_leaves_least_unexplained():
    photo, left = taken(3, Gamma(1.5)), {}
    for power in (1.0, 1.5, 2.4):
        have = Intermediates(photo, linear=linearize(photo, Gamma(power)))
        options = DeblurOptions(psf=GivenPsf(PSF))
        found = drain(walking(have, options, start=Stage.PSF, until=Stage.PSF))
        left[power] = unexplained(found)
    assert min(left, key=left.get) == 1.5
