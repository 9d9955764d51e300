"""Verbs that make new pictures of the photo: linear, deconvolved, re-applied, compared."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from napari.layers import Image as ImageLayer

from ..._typing import Image
from ...deconvolution import Deconvolver
from ...deconvolution.tiles import Region
from ...errors import CrfDeblurError
from ...estimate import Responses, given_responses
from ...pipeline import (
    DEFAULT_METHOD,
    DeblurOptions,
    PhotoStack,
    Record,
    Restored,
    Stage,
    restoring_stack,
)
from ...pipeline.blur import Blur, widened
from ...pipeline.intermediates import made
from ...progress import Job, Progress
from ...response import Gamma, Response, ResponseCurve, clipped_share
from .. import outputs
from ..regions import AxisSpan, visible_part
from .memory import check_room
from .products import Product, making, show_all
from .state import Fitted, Linear, Sharp
from .step import Effects, Step, at_once
from .way import Way, record_of, way_of
from .workspace import Workspace

NOT_LINEAR = "there is no photo in linear light yet: linearize it first"
NOT_SHARP = "there is nothing deconvolved yet: deconvolve first"
LARGEST_PREVIEW = 512  # rows and columns: deblurred in about a third of a second


class RestoreVerbs(Workspace):
    """Verbs of a session that make new pictures of the photo."""

    def linearize(self, *, region: Sequence[AxisSpan] | None = None) -> ImageLayer:
        """Undo the response: the photo in linear light, as a layer.

        Parameters
        ----------
        region : sequence of (start, stop), optional
            For each axis of the photo; by default all of it, every slice of a stack.
        """
        return self.do(linearizing(self, region=region))

    def deconvolve(self, method: Deconvolver | None = None) -> ImageLayer:
        """Undo the blur of the linear photo, as a layer.

        Parameters
        ----------
        method : Deconvolver, optional
            By default :class:`~napari_crfdeblur.deconvolution.LocalShrinkage`.
        """
        return self.do(deconvolving(self, method))

    def reapply(self) -> ImageLayer:
        """Apply the response again: the deblurred photo in its own numbers, as a layer."""
        return self.do(reapplying(self))

    def restore(
        self, method: Deconvolver | None = None, *, region: Sequence[AxisSpan] | None = None
    ) -> ImageLayer:
        """Linearize, deconvolve and re-apply; returns the layer of the deblurred photo."""
        return self.do(restoring_photo(self, method, region=region))

    def compare_with(
        self,
        curve: ResponseCurve | None = None,
        method: Deconvolver | None = None,
        *,
        region: Sequence[AxisSpan] | None = None,
    ) -> ImageLayer:
        """Restore the photo with another response, gamma 2.2 by default, and the same PSF."""
        return self.do(comparing(self, curve, method, region=region))

    def preview(
        self, method: Deconvolver | None = None, *, curve: Response | None = None
    ) -> ImageLayer:
        """Restore what the canvas shows, and show it in place of the last preview."""
        return self.do(previewing(self, method, curve=curve))

    def flip(self) -> None:
        """Show the photo instead of its restored version, or the other way round."""
        photo, restored = self.required_pair()
        before = outputs.shown(self, photo) == "photo"
        for layer, kind in outputs.made_of(self, photo).items():
            if kind != outputs.PSF and layer is not restored:
                layer.visible = False  # what lies between them
        photo.visible, restored.visible = True, before


def linearizing(
    session: Workspace, *, region: Sequence[AxisSpan] | None = None
) -> Step[Product, ImageLayer]:
    """Step of :meth:`RestoreVerbs.linearize`."""
    photo, source = session.source()
    fitted = session.required_response()
    where = _where(session, source, region)
    way = way_of(replace(session.state, psf=None), fitted)

    @at_once
    def finish(product: Product) -> ImageLayer:
        state = session.state_of(photo)
        record = _record(source, way, Stage.LINEAR, where, product)
        light = made(product.restored.linear, "linear light")
        layer = outputs.light_layer(session, photo, outputs.LINEAR, light, where, state, record)
        linear = Linear(layer, where, fitted)
        session.commit(photo, replace(state, linear=linear, sharp=None))
        return layer

    job = making(source, where, fitted.responses, None, DeblurOptions(), until=Stage.LINEAR)
    return Step("linearizing", job, finish)


def deconvolving(
    session: Workspace, method: Deconvolver | None = None
) -> Step[Product, ImageLayer]:
    """Step of :meth:`RestoreVerbs.deconvolve`."""
    photo, source = session.source()
    linear, blur = session.state.linear, session.required_blur()
    if linear is None:
        raise CrfDeblurError(NOT_LINEAR)
    used = method or DEFAULT_METHOD
    way = way_of(session.state, linear.fitted, used)

    @at_once
    def finish(product: Product) -> ImageLayer:
        state = session.state_of(photo)
        record = _record(source, way, Stage.RESTORE, linear.region, product)
        light = made(product.restored.sharp_linear, "sharp light")
        layer = outputs.light_layer(
            session, photo, outputs.SHARP, light, linear.region, state, record
        )
        trust = made(product.restored.trust, "a judgement")
        outputs.trust_layer(session, photo, trust, linear.region, state, record)
        session.say_trust(trust=trust)
        session.commit(photo, replace(state, sharp=Sharp(layer, linear, record)))
        return layer

    job = making(
        source,
        linear.region,
        linear.fitted.responses,
        blur,
        DeblurOptions(method=used),
        start=Restored(linear=np.asarray(linear.layer.data)),
        until=Stage.RESTORE,
    )
    return Step("deconvolving", job, finish)


def reapplying(session: Workspace) -> Step[Product, ImageLayer]:
    """Step of :meth:`RestoreVerbs.reapply`."""
    photo, source = session.source()
    sharp = session.state.sharp
    if sharp is None:
        raise CrfDeblurError(NOT_SHARP)
    linear = sharp.linear

    @at_once
    def finish(product: Product) -> ImageLayer:
        state = session.state_of(photo)
        record = replace(
            sharp.record, until=Stage.REAPPLY, photo=product.photo, result=product.result
        )
        pixels = made(product.restored.photo, "a result")
        layer = outputs.photo_layer(session, photo, pixels, linear.region, state, record)
        session.commit(photo, replace(state, restored=layer, record=record))
        return layer

    start = Restored(sharp_linear=np.asarray(sharp.layer.data))
    job = making(
        source,
        linear.region,
        linear.fitted.responses,
        None,
        sharp.record.options,
        start=start,
        until=Stage.REAPPLY,
    )
    return Step("re-applying the response", job, finish)


def restoring_photo(
    session: Workspace,
    method: Deconvolver | None = None,
    *,
    region: Sequence[AxisSpan] | None = None,
) -> Step[Product, ImageLayer]:
    """Step of :meth:`RestoreVerbs.restore`: linearize, deconvolve and re-apply in one."""
    photo, source = session.source()
    fitted, blur = session.required_response(), session.required_blur()
    where = _where(session, source, region)
    used = method or DEFAULT_METHOD
    way = way_of(session.state, fitted, used)

    def finish(product: Product) -> Effects[ImageLayer]:
        layer = yield from show_all(session, photo, source, way, where, product)
        session.say_trust(trust=product.restored.trust)
        return made(layer, "a result")

    job = making(source, where, fitted.responses, blur, DeblurOptions(method=used))
    return Step("restoring the photo", job, finish)


def comparing(
    session: Workspace,
    curve: ResponseCurve | None = None,
    method: Deconvolver | None = None,
    *,
    region: Sequence[AxisSpan] | None = None,
) -> Step[Product, ImageLayer]:
    """Step of :meth:`RestoreVerbs.compare_with`."""
    photo, source = session.source()
    blur = session.required_blur()
    where = _where(session, source, region)
    assumed = curve or Gamma(2.2)
    used = method or DEFAULT_METHOD
    fitted = Fitted(given_responses(assumed))
    way = way_of(session.state, fitted, used)

    @at_once
    def finish(product: Product) -> ImageLayer:
        state = session.state_of(photo)
        record = _record(source, way, Stage.REAPPLY, where, product)
        kind = f"{outputs.RESTORED}, {outputs.curve_name(assumed)}"
        pixels, shown = made(product.restored.photo, "a result"), replace(state, fitted=fitted)
        layer = outputs.photo_layer(session, photo, pixels, where, shown, record, kind=kind)
        outputs.put_below(session, layer, state.restored)
        return layer

    job = making(source, where, fitted.responses, blur, DeblurOptions(method=used))
    return Step(f"restoring with {outputs.curve_name(assumed)}", job, finish)


def previewing(
    session: Workspace, method: Deconvolver | None = None, *, curve: Response | None = None
) -> Step[Image, ImageLayer]:
    """Step of :meth:`RestoreVerbs.preview`: what is visible, restored and shown in place."""
    photo, source = session.source()
    blur = session.required_blur()
    responses = session.required_response().responses if curve is None else given_responses(curve)
    region = visible_part(session.viewer, photo, LARGEST_PREVIEW)

    @at_once
    def finish(pixels: Image) -> ImageLayer:
        return outputs.show_preview(session, photo, pixels, region)

    options = DeblurOptions(method=method or DEFAULT_METHOD)
    return Step("preview", within(source, region, responses, blur, options), finish)


def counting_clipped(sharp: Image) -> Job[float]:
    """Long job: share of the deconvolved values that are lost when the response is applied."""
    yield Progress("counting clipped values", 0, 1)
    return clipped_share(sharp)


def _where(session: Workspace, source: PhotoStack, region: Sequence[AxisSpan] | None) -> Region:
    """The region that is restored, whose results fit into memory."""
    where = source.whole if region is None else session.region(region)
    check_room(source, where)
    return where


def _record(source: PhotoStack, way: Way, until: Stage, region: Region, product: Product) -> Record:
    return record_of(source, way, until, region=region, photo=product.photo, result=product.result)


def within(
    source: PhotoStack, region: Region, responses: Responses, blur: Blur, options: DeblurOptions
) -> Job[Image]:
    """Long job: a region restored with a margin, so that its borders are those of the whole."""
    wide = widened(region, blur, source.shape)
    whole = yield from restoring_stack(source, wide, responses, blur, options)
    inner = tuple(
        slice(part.start - outer.start, part.stop - outer.start)
        for part, outer in zip(region, wide, strict=True)
    )
    return np.ascontiguousarray(made(whole.photo, "a result")[inner])
