"""What a session shows: layers of results, named after the photo, with where they came from."""

from typing import TYPE_CHECKING, Any

import numpy as np
from napari.layers import Image as ImageLayer

from .._typing import FloatArray, Image
from ..psf import PsfEstimate
from ..response import Gamma, ResponseCurve
from .layers import Region, beside, like
from .provenance import KEY, provenance
from .state import State

if TYPE_CHECKING:
    from .session import Session

LINEAR, SHARP, RESTORED, PSF, PREVIEW = (
    "linear",
    "deblurred linear",
    "deblurred",
    "PSF",
    "preview",
)
UNIT = (0.0, 1.0)


def light_layer(
    session: "Session",
    photo: ImageLayer,
    kind: str,
    light: FloatArray,
    region: Region,
    state: State,
) -> ImageLayer:
    """Add a layer in linear light, shown from 0 to 1 whatever its values."""
    pixels = light.astype(np.float32, copy=False)
    return _add(session, photo, kind, pixels, region, state, contrast_limits=UNIT, gamma=1.0)


def photo_layer(
    session: "Session",
    photo: ImageLayer,
    pixels: Image,
    region: Region,
    state: State,
    *,
    kind: str = RESTORED,
) -> ImageLayer:
    """Add a restored photo, shown with the contrast of the photo itself."""
    return _add(session, photo, kind, pixels, region, state)


def show_preview(
    session: "Session", photo: ImageLayer, pixels: Image, region: Region
) -> ImageLayer:
    """Show a restored part of the photo in place, instead of the last one."""
    remove_preview(session, photo)
    layer = like(photo, name_of(photo, PREVIEW), pixels, region)
    layer.metadata[KEY] = {"kind": PREVIEW}
    return _front(session, layer)


def remove_preview(session: "Session", photo: ImageLayer) -> None:
    """Take the preview of a photo away, if there is one."""
    name = name_of(photo, PREVIEW)
    if name in session.viewer.layers:
        session.viewer.layers.remove(session.viewer.layers[name])


def show_psf(session: "Session", photo: ImageLayer, psf: PsfEstimate, state: State) -> ImageLayer:
    """Show the PSF beside the photo, in the layer that it already has or in a new one."""
    metadata = {KEY: provenance(session, photo, PSF, state)}
    name = name_of(photo, PSF)
    new = beside(photo, name, psf.psf, metadata)
    if name not in session.viewer.layers:
        return _front(session, new)
    layer = session.viewer.layers[name]
    layer.data = new.data
    layer.translate, layer.contrast_limits = new.translate, new.contrast_limits
    layer.metadata = metadata
    return layer


def name_of(photo: ImageLayer, kind: str) -> str:
    """Name of a layer that was made of the photo."""
    return f"{photo.name} [{kind}]"


def curve_name(curve: ResponseCurve) -> str:
    """What a user calls a response."""
    return f"gamma {curve.exponent:g}" if isinstance(curve, Gamma) else type(curve).__name__


def _add(
    session: "Session",
    photo: ImageLayer,
    kind: str,
    pixels: Image,
    region: Region,
    state: State,
    **options: Any,
) -> ImageLayer:
    metadata = {KEY: provenance(session, photo, kind, state, region)}
    layer = like(photo, name_of(photo, kind), pixels, region, metadata=metadata, **options)
    return _front(session, layer)


def _front(session: "Session", layer: ImageLayer) -> ImageLayer:
    """Add a layer on top; it becomes the selected one."""
    session.viewer.add_layer(layer)
    return layer
