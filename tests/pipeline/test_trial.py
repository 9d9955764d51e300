"""The light of a photo whose response cannot be told: that in which the restoration rings least."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import ndimage

from napari_crfdeblur.estimate import Finding, GivenResponse
from napari_crfdeblur.pipeline import DeblurOptions, Intermediates, Stage, walking
from napari_crfdeblur.pipeline.trial import LightTrial
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import GivenPsf, camera_shake
from napari_crfdeblur.response import SRGB, Identity, dorf_mean
from napari_crfdeblur.simulate import Camera, Scene, simulate

PSF = camera_shake(15, 3)
OPTIONS = DeblurOptions(psf=GivenPsf(PSF))
CURVES = {"identity": Identity(), "dorf": dorf_mean(), "srgb": SRGB()}


def blots(colors: int) -> np.ndarray:
    """Blots without a straight edge, so that nothing tells the response."""
    noise = np.random.default_rng(0).normal(size=(240, 300, colors))
    smooth = ndimage.gaussian_filter(noise, (2, 2, 0))
    smooth = (smooth - smooth.min()) / np.ptp(smooth)
    return np.asarray((smooth > 0.55) * 0.7 + 0.05, dtype=np.float32)


@cache
def tried(name: str, colors: int = 3) -> Intermediates:
    scene = Scene(blots(colors) if colors == 3 else blots(1)[..., 0])
    photo = simulate(scene, PSF, Camera(CURVES[name], noise=0.002), seed=1).photo
    return drain(walking(Intermediates(photo), OPTIONS, until=Stage.TRIAL))


def curve_of(have: Intermediates) -> object:
    return have.response.estimates[0].curve


@pytest.mark.parametrize("colors", [1, 3])
def test_a_photo_that_is_linear_is_restored_as_it_was_recorded(colors) -> None:
    have = tried("identity", colors)
    assert have.trial.recorded > have.trial.assumed + 0.1
    assert curve_of(have) == Identity()
    assert np.allclose(have.linear, have.photo / 255, atol=1e-6)
    assert not have.response.certain


def test_the_user_reads_why_and_the_band_holds_both() -> None:
    estimate = tried("identity").response.estimates[0]
    assert estimate.findings[0] is Finding.RINGS
    assert (estimate.lower <= estimate.intensity).all()
    assert (estimate.upper >= estimate.intensity).all()
    assert np.ptp(estimate.upper - estimate.lower) > 0.1


@pytest.mark.parametrize("name", ["dorf", "srgb"])
def test_a_response_that_does_not_ring_is_kept_and_nothing_else_is_tried(name) -> None:
    have = tried(name)
    assert have.trial.assumed > 0.9
    assert have.trial.recorded is None
    assert Finding.RINGS not in have.response.estimates[0].findings


def test_a_response_that_was_given_is_not_tried() -> None:
    options = replace(OPTIONS, response=GivenResponse(dorf_mean()))
    start = Intermediates(tried("identity").photo)
    have = drain(walking(start, options, until=Stage.TRIAL))
    assert have.trial == LightTrial()
    assert curve_of(have) == dorf_mean()


def test_the_trial_can_be_left_out() -> None:
    options = replace(OPTIONS, settle_light=False)
    have = drain(walking(Intermediates(tried("identity").photo), options, until=Stage.TRIAL))
    assert have.trial == LightTrial()
    assert curve_of(have) != Identity()


@pytest.mark.parametrize("share", [-0.1, 1.1, "half", np.nan])
def test_a_share_lies_between_nothing_and_all(share) -> None:
    with pytest.raises(ValueError, match="a share"):
        LightTrial(share)
