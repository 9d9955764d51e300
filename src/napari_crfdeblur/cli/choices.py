"""What the words of the command line stand for: responses, PSFs and methods."""

from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import TypeAlias

from .._typing import FloatArray
from ..deconvolution import Strengthened
from ..errors import CrfDeblurError
from ..estimate import (
    GivenResponse,
    KnownPsf,
    MaximumLikelihood,
    PerChannel,
    ResponseFit,
)
from ..io import read_edges, read_psf, read_responses
from ..io.limits import LIMITS, Limits
from ..methods import DECONVOLUTIONS, PSFS, RESPONSES, named, words
from ..pipeline import DeblurOptions
from ..psf import (
    Beads,
    GivenPsf,
    Portfolio,
    PsfAt,
    PsfEstimator,
    camera_shake,
    disk,
    gaussian,
    kernel_a,
    kernel_b,
    line,
)
from ..response import SRGB, Cameras, Gamma, Identity, ResponseCurve, ResponsePrior, around

Prior: TypeAlias = Cameras | ResponsePrior

SHARED = ("each", "first", "one")  # words of ``batch --psf``: whose PSF is used


def deblur_options(arguments: Namespace) -> DeblurOptions:
    """All that the arguments of a command say of how a photo is deblurred, made once.

    What a command has no argument for is left to the default, and what it does by itself, such
    as the response in ``estimate`` and the PSF of each photo in ``batch``, too.
    """
    given = vars(arguments)
    edges, psf = given.get("edges"), given.get("psf")
    options = DeblurOptions(
        edges=read_edges(edges) if edges else None,
        blur_extent=given.get("blur_extent"),
        regions=given.get("varying"),
    )
    if "response" in given:
        options = replace(options, response=response_fits(arguments))
        word = "auto" if arguments.command == "batch" and psf in SHARED else str(psf)
        places = given.get("psf_at")
        method = (
            estimator_at(places, arguments) if places else psf_estimator(word, arguments.psf_size)
        )
        options = replace(options, psf=method)
    if arguments.command in ("deblur", "batch"):
        undone = named(DECONVOLUTIONS, arguments.method).make()
        if arguments.strength != 1:
            undone = Strengthened(undone, arguments.strength)
        options = replace(
            options, method=undone, guard=arguments.guard, settle_light=arguments.settle_light
        )
    return options


def limits_of(arguments: Namespace) -> Limits:
    """How large the files may be: ``--largest-photo``."""
    megapixels = arguments.largest_photo
    return LIMITS if megapixels is None else LIMITS.with_photos_of(megapixels)


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
    method: ResponseFit = named(RESPONSES, name).make()
    return method


def psf_estimator(text: str, size: int | None) -> PsfEstimator | None:
    """Method for ``--psf`` and ``--psf-size``; None if the size is to be judged, too."""
    if text == "auto":
        return Portfolio(size=size) if size else None
    if text in words(PSFS):
        method: PsfEstimator = named(PSFS, text).make(size=size)
        return method
    if size:
        raise CrfDeblurError("--psf-size is for an estimated PSF: leave it out with --psf FILE")
    return GivenPsf(read_psf(Path(text)))


def estimator_at(places: Sequence[tuple[float, float, int]], arguments: Namespace) -> PsfEstimator:
    """Method for ``--psf-at``: one streak, or the mean of several."""
    if arguments.psf != "auto" or arguments.psf_size:
        option = "--from" if arguments.command == "psf" else "--psf"
        other = "--psf-size" if arguments.psf == "auto" else option
        raise CrfDeblurError(f"--psf-at tells the PSF already: leave out {other}")
    if len(places) == 1:
        return PsfAt(*places[0])
    sizes = {size for _, _, size in places}
    if len(sizes) > 1:
        raise CrfDeblurError("the boxes of --psf-at differ in size: give one SIZE for all of them")
    return Beads(tuple((row, column) for row, column, _ in places), sizes.pop())


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
