"""What the second half of the path makes of a region, and its layers."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from napari.layers import Image as ImageLayer

from ..._typing import Image
from ...deconvolution.tiles import Region
from ...estimate import Responses
from ...pipeline import DeblurOptions, PhotoStack, Pixels, Record, Restored, Stage, restoring_stack
from ...pipeline.blur import Blur
from ...pipeline.intermediates import made
from ...pipeline.record import identifying, result_of
from ...progress import Job
from .. import outputs
from .state import Linear, Sharp
from .step import Effects
from .way import Way, record_of
from .workspace import Workspace


@dataclass(frozen=True, slots=True, eq=False)
class Product:
    """A region after some stages, and what tells the photo and the last layer from others."""

    restored: Restored
    photo: Pixels
    result: Pixels | None


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
    """Long job: the second half of the path for a region."""
    photo = yield from identifying(source)
    restored = yield from restoring_stack(
        source, region, responses, blur, options, start=start, until=until
    )
    return Product(restored, photo, result_of(source, restored))


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

    def record(until: Stage, later: Image | None = None) -> Record:
        result = product.result if later is None else None  # it tells of the last layer
        return record_of(
            source, way, until, region=region, photo=product.photo, result=result, chosen=chosen
        )

    linear, sharp, restored = state.linear, state.sharp, None
    if shown.linear is not None:
        how = record(Stage.LINEAR, shown.sharp_linear)
        layer = outputs.light_layer(
            session, photo, outputs.LINEAR, shown.linear, region, state, how
        )
        linear, sharp = Linear(layer, region, fitted), None
        yield
    if shown.sharp_linear is not None and linear is not None:
        how = record(Stage.RESTORE, shown.photo)
        layer = outputs.light_layer(
            session, photo, outputs.SHARP, shown.sharp_linear, region, state, how
        )
        sharp = Sharp(layer, linear, how)
        yield
    if shown.trust is not None:
        outputs.trust_layer(session, photo, shown.trust, region, state, record(Stage.RESTORE))
        yield
    state = replace(state, linear=linear, sharp=sharp)
    if shown.photo is not None:
        how = record(Stage.REAPPLY)
        restored = outputs.photo_layer(session, photo, shown.photo, region, state, how)
        state = replace(state, restored=restored, record=how)
        yield
    session.commit(photo, state)
    return restored
