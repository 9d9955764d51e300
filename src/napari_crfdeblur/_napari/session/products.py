"""What the second half of the path makes of a region, and its layers."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from napari.layers import Image as ImageLayer

from ...deconvolution.tiles import Region
from ...estimate import Responses
from ...pipeline import DeblurOptions, PhotoStack, Pixels, Restored, Stage, restoring_stack
from ...pipeline.blur import Blur
from ...pipeline.intermediates import made
from ...pipeline.record import identifying, pixels_of
from ...progress import Job
from .. import outputs
from .state import Linear, Sharp
from .step import Effects
from .way import Way, record_of
from .workspace import Workspace


@dataclass(frozen=True, slots=True, eq=False)
class Product:
    """A region after some stages, and what tells it and the photo from others."""

    restored: Restored
    photo: Pixels
    result: Pixels


def making(
    source: PhotoStack,
    region: Region,
    responses: Responses,
    blur: Blur | None,
    options: DeblurOptions,
    *,
    start: Restored | None = None,
    until: Stage = Stage.REAPPLY,
) -> Job[Product]:
    """Long job: the second half of the path for a region, and what tells it from others."""
    photo = yield from identifying(source)
    restored = yield from restoring_stack(
        source, region, responses, blur, options, start=start, until=until
    )
    newest = {
        Stage.LINEAR: restored.linear,
        Stage.RESTORE: restored.sharp_linear,
        Stage.REAPPLY: restored.photo,
    }[until]
    return Product(restored, photo, pixels_of(source.name, made(newest, "a result")))


def show_all(
    session: Workspace,
    photo: ImageLayer,
    source: PhotoStack,
    way: Way,
    region: Region,
    product: Product,
    chosen: Mapping[str, Any] | None = None,
) -> Effects[ImageLayer | None]:
    """Add the layers of a restoration, one by one, and keep them; the deblurred photo, if any."""
    state, shown = session.state_of(photo), product.restored
    fitted = made(state.fitted, "a response")
    record = record_of(
        source,
        way,
        Stage.LINEAR,
        region=region,
        photo=product.photo,
        result=product.result,
        chosen=chosen,
    )
    linear, sharp, restored = state.linear, state.sharp, None
    if shown.linear is not None:
        layer = outputs.light_layer(
            session, photo, outputs.LINEAR, shown.linear, region, state, record
        )
        linear, sharp = Linear(layer, region, fitted), None
        yield
    record = replace(record, until=Stage.RESTORE)
    if shown.sharp_linear is not None and linear is not None:
        layer = outputs.light_layer(
            session, photo, outputs.SHARP, shown.sharp_linear, region, state, record
        )
        sharp = Sharp(layer, linear, record)
        yield
    record = replace(record, until=Stage.REAPPLY)
    state = replace(state, linear=linear, sharp=sharp)
    if shown.photo is not None:
        restored = outputs.photo_layer(session, photo, shown.photo, region, state, record)
        state = replace(state, restored=restored, record=record)
        yield
    session.commit(photo, state)
    return restored
