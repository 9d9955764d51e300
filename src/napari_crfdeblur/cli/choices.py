"""What the words of the command line stand for: responses, PSFs and methods."""

from collections.abc import Callable, Sequence
from math import radians
from pathlib import Path

from .._typing import FloatArray
from ..deconvolution import Deconvolver, HyperLaplacian, RichardsonLucy, SparseIrls, Wiener
from ..errors import CrfDeblurError
from ..estimate import (
    GivenResponse,
    KnownPsf,
    MaximumLikelihood,
    MeanProfile,
    RankMinimization,
    ResponseFit,
    Tail,
)
from ..io import read_psf, read_responses
from ..pipeline import BLIND_ERROR
from ..psf import (
    GivenPsf,
    PsfEstimator,
    XuJia,
    camera_shake,
    disk,
    gaussian,
    kernel_a,
    kernel_b,
    line,
)
from ..response import SRGB, Cameras, Gamma, Identity, ResponseCurve, ResponsePrior, around

# Methods with a prior, whose weight allows for the errors of the PSF.
PRIORS: dict[str, type[HyperLaplacian | SparseIrls | Wiener]] = {
    "hyper-laplacian": HyperLaplacian,
    "irls": SparseIrls,
    "wiener": Wiener,
}


def deconvolver(name: str, psf: str) -> Deconvolver:
    """Method for ``--method``; an estimated PSF is less certain than a given one."""
    if name == "richardson-lucy":
        return RichardsonLucy()
    return PRIORS[name](model_error=BLIND_ERROR) if psf == "auto" else PRIORS[name]()


def known_response(text: str) -> tuple[ResponseCurve, ...]:
    """Curves of ``gamma:2.2``, ``srgb``, ``identity`` or a response file."""
    name, _, exponent = text.lower().partition(":")
    if name == "gamma":
        return (Gamma(_number(exponent or "2.2", text)),)
    if name in ("srgb", "identity"):
        return (SRGB() if name == "srgb" else Identity(),)
    return read_responses(Path(text))


def camera_prior(text: str) -> Cameras | ResponsePrior:
    """What ``--prior`` says of the camera: a kind, or curves near that of a response file."""
    if text.upper() in Cameras.__members__:
        return Cameras[text.upper()]
    return around(read_responses(Path(text))[0])


def response_fits(text: str, per_channel: bool, prior: str) -> ResponseFit | Sequence[ResponseFit]:
    """Method for ``--response``, ``--prior`` and ``--per-channel``: estimation, or curves."""
    fits: list[ResponseFit] = (
        [MaximumLikelihood(camera_prior(prior))]
        if text == "auto"
        else [*map(GivenResponse, known_response(text))]
    )
    if per_channel and len(fits) == 1:
        fits *= 3
    return fits[0] if len(fits) == 1 else fits


def fit_named(name: str, psf: Path | None, prior: str) -> ResponseFit:
    """Method for ``estimate --method``, ``--psf`` and ``--prior``."""
    if name == "likelihood":
        return MaximumLikelihood(camera_prior(prior), None if psf is None else read_psf(psf))
    if name == "known-psf":
        if psf is None:
            raise CrfDeblurError("--method known-psf needs the PSF: give --psf FILE")
        return KnownPsf(read_psf(psf))
    if psf is not None:
        raise CrfDeblurError(f"--method {name} does not use a PSF: leave out --psf")
    if name == "mean":
        return MeanProfile()
    return RankMinimization(Tail.ALL if name == "rank-all" else Tail.SECOND)


def psf_estimator(text: str, size: int | None) -> PsfEstimator | None:
    """Method for ``--psf`` and ``--psf-size``; None if the size is to be judged, too."""
    if text != "auto":
        if size:
            raise CrfDeblurError("--psf-size is for an estimated PSF: leave it out with --psf FILE")
        return GivenPsf(read_psf(Path(text)))
    return XuJia(size=size) if size else None


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise CrfDeblurError(f'"{whole}" is no response: write gamma:2.2, for example') from None


def simulated_psf(text: str, size: int, seed: int) -> FloatArray:
    """PSF for ``simulate --psf``: a shape of the given extent, or a file."""
    shapes: dict[str, Callable[[], FloatArray]] = {
        "shake": lambda: camera_shake(size, seed),
        "kernel-a": kernel_a,
        "kernel-b": kernel_b,
        "line": lambda: line(size, radians(30)),
        "disk": lambda: disk(size / 2),
        "gaussian": lambda: gaussian(size / 6),
    }
    return shapes[text]() if text in shapes else read_psf(Path(text))
