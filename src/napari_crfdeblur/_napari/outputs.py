"""What a session shows: layers of results, named after the photo, with where they came from."""

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from napari.layers import Image as ImageLayer
from napari.layers import Layer

from .._typing import FloatArray, Image
from ..deconvolution import Trust
from ..deconvolution.tiles import Region
from ..pipeline import Record, Stage
from ..psf import PsfField
from ..response import Gamma, ResponseCurve
from .pixels import KEY, source_of
from .placing import beside, layer_like, placed
from .provenance import provenance
from .session.state import State
from .session.way import record_of, way_of
from .session.workspace import Workspace

LINEAR, SHARP, RESTORED, TRUST, PSF, PREVIEW = (
    "linear",
    "deblurred linear",
    "deblurred",
    "trust",
    "PSF",
    "preview",
)
UNIT = (0.0, 1.0)


def light_layer(
    session: Workspace,
    photo: ImageLayer,
    kind: str,
    light: FloatArray,
    region: Region,
    state: State,
    record: Record,
) -> ImageLayer:
    """Add a layer in linear light, shown from 0 to 1 whatever its values."""
    pixels = light.astype(np.float32, copy=False)
    metadata = {KEY: provenance(photo, kind, state, record)}
    shown = {"contrast_limits": UNIT, "gamma": 1.0}
    return _add(session, photo, kind, pixels, region, metadata, **shown)


def trust_layer(
    session: Workspace,
    photo: ImageLayer,
    trust: Trust,
    region: Region,
    state: State,
    record: Record,
) -> ImageLayer:
    """Add a layer of what can be believed, from black, nothing, to white; hidden at first."""
    layer = ImageLayer(
        trust.believed,
        name=name_of(photo, TRUST),
        rgb=False,
        multiscale=False,
        contrast_limits=UNIT,
        colormap="gray",
        visible=False,
        metadata={KEY: provenance(photo, TRUST, state, record)},
        **placed(photo, region),
    )
    return _front(session, photo, TRUST, layer)


def photo_layer(
    session: Workspace,
    photo: ImageLayer,
    pixels: Image,
    region: Region,
    state: State,
    record: Record,
    *,
    kind: str = RESTORED,
) -> ImageLayer:
    """Add a restored photo, shown with the contrast of the photo itself."""
    metadata = {KEY: provenance(photo, kind, state, record)}
    return _add(session, photo, kind, pixels, region, metadata)


def show_preview(
    session: Workspace, photo: ImageLayer, pixels: Image, region: Region
) -> ImageLayer:
    """Show a restored part of the photo in place, instead of the last one."""
    remove_preview(session, photo)
    layer = layer_like(photo, name_of(photo, PREVIEW), pixels, region)
    layer.metadata[KEY] = {"kind": PREVIEW}
    return _front(session, photo, PREVIEW, layer)


def remove_preview(session: Workspace, photo: ImageLayer) -> None:
    """Take the preview of a photo away, if there is one."""
    layer = newest(session, photo, PREVIEW)
    if layer is not None:
        session.viewer.layers.remove(layer)


def show_psf(session: Workspace, photo: ImageLayer, state: State) -> ImageLayer:
    """Show the PSF beside the photo, in the layer that it already has or in a new one.

    Those of all parts are shown as a map, each scaled to its peak.
    """
    record = record_of(source_of(photo, session.white_of(photo)), way_of(state), Stage.FIELD)
    metadata = {KEY: provenance(photo, PSF, state, record)}
    blur = state.blur
    kernel = blur.picture() if isinstance(blur, PsfField) else np.asarray(blur)
    new = beside(photo, name_of(photo, PSF), kernel, metadata)
    layer = newest(session, photo, PSF)
    if layer is not None and layer.ndim != new.ndim:  # napari keeps the axes of a layer
        session.viewer.layers.remove(layer)
        layer = None
    if layer is None:
        return _front(session, photo, PSF, new)
    layer.data = new.data
    layer.translate, layer.contrast_limits = new.translate, new.contrast_limits
    layer.metadata = metadata
    return layer


def put_below(session: Workspace, layer: Layer, restored: ImageLayer | None) -> None:
    """Move what would hide the restored photo below it: that is what stays in view."""
    layers = session.viewer.layers
    if restored is not None and restored in layers:
        layers.move(layers.index(layer), layers.index(restored))
        layers.selection.active = restored


def made_of(session: Workspace, photo: ImageLayer) -> dict[ImageLayer, str]:
    """The layers made of a photo that are still there, and their kinds, the newest last."""
    made = dict(session.made.get(photo) or {})
    return {layer: kind for layer, kind in made.items() if layer in session.viewer.layers}


def newest(session: Workspace, photo: ImageLayer, kind: str) -> ImageLayer | None:
    """The newest layer of a kind, whatever the user calls it now."""
    layers = [layer for layer, own in made_of(session, photo).items() if own == kind]
    return layers[-1] if layers else None


def shown(session: Workspace, photo: ImageLayer) -> str | None:
    """What is seen where the photo is: a kind of result, ``photo``, or None for neither."""
    kinds = {photo: "photo"} | made_of(session, photo)
    seen = [kinds[layer] for layer in session.viewer.layers if layer.visible and layer in kinds]
    seen = [kind for kind in seen if kind != PSF]  # lies beside it
    return seen[-1] if seen else None


def name_of(photo: ImageLayer, kind: str) -> str:
    """Name of a layer that was made of the photo."""
    return f"{photo.name} [{kind}]"


def curve_name(curve: ResponseCurve) -> str:
    """What a user calls a response."""
    return f"gamma {curve.exponent:g}" if isinstance(curve, Gamma) else type(curve).__name__


def _add(
    session: Workspace,
    photo: ImageLayer,
    kind: str,
    pixels: Image,
    region: Region,
    metadata: dict[str, Any],
    **options: Any,
) -> ImageLayer:
    layer = layer_like(photo, name_of(photo, kind), pixels, region, metadata=metadata, **options)
    return _front(session, photo, kind, layer)


def _front(session: Workspace, photo: ImageLayer, kind: str, layer: ImageLayer) -> ImageLayer:
    """Add a layer on top; it becomes the selected one."""
    session.made.setdefault(photo, WeakKeyDictionary())[layer] = kind
    session.viewer.add_layer(layer)
    return layer
