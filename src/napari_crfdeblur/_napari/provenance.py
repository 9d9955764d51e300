"""Where a result came from, as JSON: its record, and what was known, kept in every layer."""

from typing import Any

from napari.layers import Image as ImageLayer

from ..io import record_content, to_record
from ..io.edges import edges_content
from ..io.responses import responses_content
from ..pipeline import Record
from .pixels import file_of
from .placing import place_content
from .session.state import State


def provenance(photo: ImageLayer, kind: str, state: State, record: Record) -> dict[str, Any]:
    """What a layer was made of and how, JSON-safe.

    Parameters
    ----------
    photo : napari.layers.Image
        The photo.
    kind : str
        What the layer shows, such as ``deblurred``.
    state : State
        What was known of the photo, the step that made the layer included.
    record : Record
        How it is done again.
    """
    edges = state.edges
    return {
        **record_content(record),
        "kind": kind,
        "source": {
            "name": photo.name,
            "path": file_of(photo),
            "reader": photo.source.reader_plugin,
            "sample": list(photo.source.sample) if photo.source.sample else None,
            "rgb": bool(photo.rgb),
            **place_content(photo),
        },
        "edges": None if edges is None else edges_content(edges.edges),
        "response": None if state.fitted is None else responses_content(state.fitted.estimates),
        "psf": None if state.psf is None else state.psf.psf.tolist(),
        "psf_status": None if state.psf is None else state.psf.status.value,
        "psf_field": to_record(state.field),
    }
