"""Responses from and to JSON files that state their direction."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import arguments
from .._version import __version__
from ..errors import CrfDeblurError
from ..estimate import ResponseEstimate
from ..response import Tabulated
from ..texts import brief
from .files import check_output, write_text
from .json_files import number_list, read_json
from .limits import LIMITS, Limits

FORMAT, VERSION, DIRECTION = "crfdeblur-response", 1, "inverse"
SUFFIXES = (".json",)


def write_responses(path: Path | str, estimates: Sequence[ResponseEstimate]) -> None:
    """Write inverse responses as JSON, whole or not at all: bands, status and findings, too.

    Parameters
    ----------
    path : Path
        File that ends in ``.json``.
    estimates : sequence of ResponseEstimate
        One for all channels, or one for each of R, G, B.
    """
    path = arguments.path(path)
    check_output(path, SUFFIXES)
    write_text(path, json.dumps(responses_content(estimates), indent=1) + "\n")


def responses_content(estimates: Sequence[ResponseEstimate]) -> dict[str, Any]:
    """What a response file holds, as ``json`` takes it: 1 or 3 estimates with their bands."""
    arguments.instances(estimates, ResponseEstimate, "1 or 3 estimates of a response")
    if len(estimates) not in (1, 3):
        raise ValueError(f"expected 1 or 3 estimates, got {len(estimates)}")
    names = ["all"] if len(estimates) == 1 else ["R", "G", "B"]
    return {
        "format": FORMAT,
        "version": VERSION,
        "direction": DIRECTION,
        "software": f"napari-crfdeblur {__version__}",
        "channels": [_channel(n, e) for n, e in zip(names, estimates, strict=True)],
    }


def read_responses(path: Path | str, *, limits: Limits = LIMITS) -> tuple[Tabulated, ...]:
    """Read the response of each channel, or the one of all.

    Parameters
    ----------
    path : Path
        JSON of :func:`write_responses`.
    limits : Limits, optional
        For the size of the file.

    Raises
    ------
    CrfDeblurError
        Missing, not a response of this format, of the wrong direction, not increasing.
    """
    path = arguments.path(path)
    return responses_from(
        read_json(path, limits=arguments.instance(limits, Limits, "Limits")), str(path)
    )


def responses_from(content: Any, where: str) -> tuple[Tabulated, ...]:
    """The response of each channel, or the one of all, from what a response file holds.

    Parameters
    ----------
    content : object
        As :func:`responses_content` made it, or as ``json`` read it.
    where : str
        Where it came from, for messages, such as the name of the file.

    Raises
    ------
    CrfDeblurError
        Not a response of this format, of the wrong direction, not increasing.
    """
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise CrfDeblurError(
            f'{where}: not a response file: "format" is not "{FORMAT}"; '
            "make one with `crfdeblur estimate PHOTO -o FILE.json`"
        )
    if content.get("version") != VERSION:
        raise CrfDeblurError(
            f"{where}: response files of version {brief(content.get('version'))} are not known; "
            "update napari-crfdeblur"
        )
    if content.get("direction") != DIRECTION:
        raise CrfDeblurError(
            f'{where}: the direction is "{brief(content.get("direction"))}", where "{DIRECTION}" '
            "(intensity to irradiance) is expected; swap the two lists and the direction"
        )
    channels = content.get("channels")
    if not isinstance(channels, list) or len(channels) not in (1, 3):
        raise CrfDeblurError(f"{where}: expected 1 or 3 channels; estimate the response again")
    return tuple(_curve(channel, where) for channel in channels)


def _channel(name: str, estimate: ResponseEstimate) -> dict[str, Any]:
    return {
        "name": name,
        "intensity": estimate.intensity.tolist(),
        "irradiance": estimate.curve.to_irradiance(estimate.intensity).tolist(),
        "lower": estimate.lower.tolist(),
        "upper": estimate.upper.tolist(),
        "covered": list(estimate.covered),
        "status": estimate.status.name.lower(),
        "message": estimate.status.value,
        "findings": [{"name": f.name.lower(), "message": f.value} for f in estimate.findings],
        "diagnostics": {k: float(v) for k, v in estimate.diagnostics.items()},
    }


def _curve(channel: Any, where: str) -> Tabulated:
    try:
        intensity = np.array(number_list(channel["intensity"]), dtype=np.float64)
        irradiance = np.array(number_list(channel["irradiance"]), dtype=np.float64)
    except (LookupError, OverflowError, TypeError, ValueError) as error:
        raise CrfDeblurError(
            f'{where}: a channel lacks its lists of numbers "intensity" and "irradiance"; '
            "estimate the response again"
        ) from error
    try:
        return Tabulated(irradiance=irradiance, intensity=intensity)
    except ValueError as error:
        raise CrfDeblurError(
            f"{where}: the response must increase strictly from 0 to 1 ({brief(error)}); mend the "
            "file or estimate the response again"
        ) from error
