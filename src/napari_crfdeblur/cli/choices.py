"""What the words of the command line stand for: responses, PSFs and methods."""

from argparse import Namespace
from collections.abc import Callable, Sequence
from math import radians
from pathlib import Path
from typing import TypeAlias

from .._typing import FloatArray
from ..deconvolution import (
    Deconvolver,
    HyperLaplacian,
    LocalShrinkage,
    RichardsonLucy,
    SparseIrls,
    TotalVariation,
    Wiener,
)
from ..errors import CrfDeblurError
from ..estimate import (
    GivenResponse,
    KnownPsf,
    MaximumLikelihood,
    MeanProfile,
    PerChannel,
    RankMinimization,
    ResponseFit,
    Tail,
)
from ..io import read_psf, read_responses
from ..psf import (
    Fergus,
    GivenPsf,
    PsfEstimator,
    RadonFit,
    Shan,
    Variational,
    XuJia,
    camera_shake,
    disk,
    gaussian,
    kernel_a,
    kernel_b,
    line,
)
from ..response import SRGB, Cameras, Gamma, Identity, ResponseCurve, ResponsePrior, around

Prior: TypeAlias = Cameras | ResponsePrior

DECONVOLVERS: dict[str, Callable[[], Deconvolver]] = {
    "local-shrinkage": LocalShrinkage,
    "hyper-laplacian": HyperLaplacian,
    "irls": SparseIrls,
    "total-variation": TotalVariation,
    "richardson-lucy": RichardsonLucy,
    "wiener": Wiener,
}

PSF_METHODS: dict[str, Callable[[int | None], PsfEstimator | None]] = {
    "auto": lambda size: Variational(size=size) if size else None,
    "edges": lambda size: RadonFit(size=size),
    "variational": lambda size: Variational(size=size),
    "xu-jia": lambda size: XuJia(size=size),
    "fergus": lambda size: Fergus(size=size),
    "shan": lambda size: Shan(size=size),
}


def known_response(text: str) -> tuple[ResponseCurve, ...]:
    """Curves of ``gamma:2.2``, ``srgb``, ``identity`` or a response file."""
    name, _, exponent = text.lower().partition(":")
    if name == "gamma":
        return (Gamma(_number(exponent or "2.2", text)),)
    if name in ("srgb", "identity"):
        return (SRGB() if name == "srgb" else Identity(),)
    return read_responses(Path(text))


def camera_priors(text: str | None, per_channel: bool) -> tuple[Prior, ...]:
    """What ``--prior`` says of the camera, for all channels or for each.

    A kind of camera, or curves near those of a response file.
    """
    if text is None:
        return (Cameras.DIGITAL,)
    if text.upper() in Cameras.__members__:
        return (Cameras[text.upper()],)
    if not Path(text).suffix:
        kinds = ", ".join(name.lower() for name in Cameras.__members__)
        raise CrfDeblurError(f'"{text}" is no kind of camera: write {kinds}, or a response file')
    curves = read_responses(Path(text))
    if len(curves) > 1 and not per_channel:
        raise CrfDeblurError(f"{text}: has a response for each channel: give --per-channel, too")
    return tuple(map(around, curves))


def response_fits(arguments: Namespace) -> ResponseFit:
    """Method for ``--response``, ``--prior`` and ``--per-channel``: estimation, or curves."""
    if arguments.response == "auto":
        return _likelihood(arguments, None)
    if arguments.prior is not None:
        raise CrfDeblurError("--prior is for a response that is estimated: leave out --response")
    return _of_channels([*map(GivenResponse, known_response(arguments.response))], arguments)


def fits_named(arguments: Namespace) -> ResponseFit:
    """Method for ``estimate --method``, ``--psf``, ``--prior`` and ``--per-channel``."""
    name, psf = arguments.method, arguments.psf
    if name == "likelihood":
        return _likelihood(arguments, None if psf is None else read_psf(psf))
    if arguments.prior is not None:
        raise CrfDeblurError(f"--method {name} assumes nothing of the camera: leave out --prior")
    return _of_channels([_of_the_paper(name, psf)], arguments)


def _likelihood(arguments: Namespace, psf: FloatArray | None) -> ResponseFit:
    priors = camera_priors(arguments.prior, arguments.per_channel)
    return _of_channels([MaximumLikelihood(prior, psf) for prior in priors], arguments)


def _of_channels(fits: Sequence[ResponseFit], arguments: Namespace) -> ResponseFit:
    """One method for all channels, or, if there are 3 or ``--per-channel``, one for each."""
    if len(fits) > 1:
        return PerChannel(tuple(fits))
    return PerChannel.alike(fits[0]) if arguments.per_channel else fits[0]


def _of_the_paper(name: str, psf: Path | None) -> ResponseFit:
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
    if text in PSF_METHODS:
        return PSF_METHODS[text](size)
    if size:
        raise CrfDeblurError("--psf-size is for an estimated PSF: leave it out with --psf FILE")
    return GivenPsf(read_psf(Path(text)))


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
