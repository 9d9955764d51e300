"""Where a result came from, as JSON: kept in every layer, saved, loaded and repeated."""

import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

from napari.layers import Image as ImageLayer

from .._version import __version__
from ..errors import CrfDeblurError
from ..io.edges import edges_content
from ..io.files import check_input, check_output, write_text
from ..io.records import from_record, to_record
from ..io.responses import responses_content
from .pixels import Region, file_of, source_of
from .regions import pairs
from .state import Action, State

KEY = "napari-crfdeblur"
FORMAT, VERSION = "crfdeblur-session", 1
SUFFIXES = (".json",)
LIBRARIES = ("numpy", "scipy", "scikit-image", "napari")


def provenance(
    photo: ImageLayer,
    kind: str,
    state: State,
    white: float | None = None,
    region: Region | None = None,
) -> dict[str, Any]:
    """What a layer was made of and how, JSON-safe.

    Parameters
    ----------
    photo : napari.layers.Image
        The photo.
    kind : str
        What the layer shows, such as ``deblurred``.
    state : State
        What was known of the photo, the step that made the layer included.
    white : float, optional
        Value of the photo that stands for intensity 1, if it is not the full scale.
    region : tuple of slice, optional
        Part of the photo that the layer holds.
    """
    source = source_of(photo, white=1.0)
    edges = state.edges
    return {
        "format": FORMAT,
        "version": VERSION,
        "kind": kind,
        "software": {KEY: __version__} | {name: version(name) for name in LIBRARIES},
        "source": {
            "name": photo.name,
            "path": file_of(photo),
            "reader": photo.source.reader_plugin,
            "sample": list(photo.source.sample) if photo.source.sample else None,
            "shape": [int(side) for side in source.data.shape],
            "rgb": source.rgb,
            "dtype": str(source.dtype),
            "white": white,
        },
        "region": None if region is None else [list(pair) for pair in pairs(region)],
        "plane": None if edges is None else [list(pair) for pair in pairs(edges.plane)],
        "actions": [
            {"verb": action.verb, "arguments": to_record(action.arguments)}
            for action in state.actions
        ],
        "edges": None if edges is None else edges_content(edges.edges),
        "response": None if state.fitted is None else responses_content(state.fitted.estimates),
        "psf": None if state.psf is None else state.psf.psf.tolist(),
        "psf_status": None if state.psf is None else state.psf.status.value,
        "psf_field": to_record(state.field),
    }


def write_session(path: Path, content: dict[str, Any]) -> None:
    """Write what was done as JSON, whole or not at all."""
    check_output(path, SUFFIXES)
    write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def read_session(path: Path) -> tuple[Action, ...]:
    """Read what was done from a session file.

    Raises
    ------
    CrfDeblurError
        Missing, or not a session of this format.
    """
    check_input(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise CrfDeblurError(f"{path}: not a JSON file ({error}); give a session file") from error
    return actions_of(content, str(path))


def actions_of(content: Any, where: str) -> tuple[Action, ...]:
    """The actions of a session file, or of the metadata of a layer.

    Raises
    ------
    CrfDeblurError
        Not a session of this format and version.
    """
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise CrfDeblurError(
            f'{where}: not a session: "format" is not "{FORMAT}"; save one from the plugin'
        )
    if content.get("version") != VERSION:
        raise CrfDeblurError(
            f"{where}: sessions of version {content.get('version')} are not known; "
            "update napari-crfdeblur"
        )
    try:
        return tuple(
            Action(str(entry["verb"]), dict(from_record(entry["arguments"])))
            for entry in content["actions"]
        )
    except (KeyError, TypeError, ValueError) as error:
        raise CrfDeblurError(f"{where}: the list of actions is damaged ({error})") from error
