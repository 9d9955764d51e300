"""A known street, blurred and recovered: what the response buys, in figures and pictures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ._typing import Image
from .deconvolve import HyperLaplacian, deconvolving
from .estimate import GivenResponse
from .io import write_photo, write_psf, write_responses, write_text
from .linear import linearize, reapply
from .pipeline import Deblurred, DeblurOptions, deblurring
from .progress import Job
from .psf import GivenPsf, camera_shake
from .quality import psnr, response_error, ringing, ssim
from .report import Report, write_report
from .response import Gamma, GeneralizedGamma, Identity, ResponseCurve
from .simulate import Camera, Simulated, simulate, street

# A camera whose contrast is stronger than gamma 2.2 allows for: the local exponent goes from
# 1.2 in the shadows to 3 in the highlights.
RESPONSE = GeneralizedGamma((0.85, -0.75, 0.25))
SHAPE = 600, 900
PSF_SIZE = 21
NOISE = 0.002


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One response to assume, and the photo deblurred with it and the true PSF.

    Parameters
    ----------
    name : str
        Of the response.
    curve : ResponseCurve
        The response.
    photo : ndarray
        Deblurred.
    error : float
        Of the response (affine-aligned RMSE over the range that the edges cover).
    psnr, ssim, ringing : float
        Of the photo, against the sharp truth; ringing needs no truth.
    """

    name: str
    curve: ResponseCurve
    photo: Image
    error: float
    psnr: float
    ssim: float
    ringing: float


@dataclass(frozen=True, slots=True, eq=False)
class Demonstration:
    """Truth, the whole path from the photo alone, and the four responses compared."""

    truth: Simulated
    whole: Deblurred
    trials: tuple[Trial, ...]


def demonstrating(seed: int = 0) -> Job[Demonstration]:
    """Long job: simulate, deblur from the photo alone, and compare the responses."""
    psf = camera_shake(PSF_SIZE, seed)
    rows, columns = (side + reach - 1 for side, reach in zip(SHAPE, psf.shape, strict=True))
    camera = Camera(RESPONSE, noise=NOISE)
    truth = simulate(street((rows, columns), seed=seed), psf, camera, seed=seed)
    whole = yield from deblurring(truth.photo)
    estimate = whole.responses[0]
    curves = {
        "identity": Identity(),
        "gamma 2.2": Gamma(2.2),
        "estimated": estimate.curve,
        "true": RESPONSE,
    }
    trials = []
    for name, curve in curves.items():
        trials.append((yield from _trying(name, curve, truth, estimate.covered)))
    return Demonstration(truth, whole, tuple(trials))


def _trying(
    name: str, curve: ResponseCurve, truth: Simulated, covered: tuple[float, float]
) -> Job[Trial]:
    linear = linearize(truth.photo, curve)
    sharp_linear = yield from deconvolving(linear, truth.psf, HyperLaplacian())
    photo = reapply(sharp_linear, curve, truth.photo.dtype)
    return Trial(
        name=name,
        curve=curve,
        photo=photo,
        error=response_error(curve, truth.camera.response, covered),
        psnr=psnr(photo, truth.sharp),
        ssim=ssim(photo, truth.sharp),
        ringing=ringing(photo, truth.photo, extent=PSF_SIZE),
    )
