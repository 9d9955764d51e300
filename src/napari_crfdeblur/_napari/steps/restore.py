"""Steps that make pictures: linear, deconvolved, re-applied; and the whole path at once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from napari.layers import Image as ImageLayer

from ..._typing import FloatArray, Image
from ...deconvolution import Deconvolver
from ...errors import CrfDeblurError
from ...estimate import GivenResponse, ResponseFit
from ...pipeline import DEFAULT_METHOD, DeblurOptions, edges_needed
from ...progress import Job
from ...psf import GivenPsf, PsfEstimate, PsfField
from ...response import Gamma, Response, ResponseCurve
from .. import jobs, outputs
from ..jobs import Restoration
from ..pixels import Region, Source
from ..regions import Pairs, Span, pairs, stack_index, visible_part
from ..state import Action, EdgeSet, Fitted, Linear, Sharp, State
from ..step import Effects, Step, at_once
from ..workspace import Workspace
from .large import check_room
from .response import unless_default

NOT_LINEAR = "there is no photo in linear light yet: linearize it first"
NOT_SHARP = "there is nothing deconvolved yet: deconvolve first"
LARGEST_PREVIEW = 512  # rows and columns: deblurred in about a third of a second


def linearizing(
    session: Workspace, *, region: Sequence[Span] | None = None
) -> Step[FloatArray, ImageLayer]:
    """Step of :meth:`Session.linearize`."""
    photo, source = session.source()
    fitted = session.required_response()
    where = source.whole if region is None else session.region(region)
    check_room(source, where)
    action = Action.of("linearize", region=None if region is None else pairs(where))

    @at_once
    def finish(light: FloatArray) -> ImageLayer:
        state = session.state_of(photo).after(action)
        layer = outputs.light_layer(session, photo, outputs.LINEAR, light, where, state)
        linear = Linear(layer, where, fitted)
        session.commit(photo, replace(state, linear=linear, sharp=None))
        return layer

    return Step("linearizing", jobs.linearizing_region(source, where, fitted.curve), finish)


def deconvolving(
    session: Workspace, method: Deconvolver | None = None
) -> Step[FloatArray, ImageLayer]:
    """Step of :meth:`Session.deconvolve`."""
    photo, source = session.source()
    linear, blur = session.state.linear, session.required_blur()
    if linear is None:
        raise CrfDeblurError(NOT_LINEAR)
    action = Action.of("deconvolve", method=method)

    @at_once
    def finish(light: FloatArray) -> ImageLayer:
        state = session.state_of(photo).after(action)
        layer = outputs.light_layer(session, photo, outputs.SHARP, light, linear.region, state)
        session.commit(photo, replace(state, sharp=Sharp(layer, linear)))
        return layer

    light, used = np.asarray(linear.layer.data), method or DEFAULT_METHOD
    job = jobs.sharpening(source, light, linear.region, blur, used)
    return Step("deconvolving", job, finish)


def reapplying(session: Workspace) -> Step[Image, ImageLayer]:
    """Step of :meth:`Session.reapply`."""
    photo, source = session.source()
    sharp = session.state.sharp
    if sharp is None:
        raise CrfDeblurError(NOT_SHARP)
    region = sharp.linear.region

    @at_once
    def finish(pixels: Image) -> ImageLayer:
        state = session.state_of(photo).after(Action.of("reapply"))
        layer = outputs.photo_layer(session, photo, pixels, region, state)
        session.commit(photo, replace(state, restored=layer))
        return layer

    light, curve = np.asarray(sharp.layer.data), sharp.linear.fitted.curve
    return Step("re-applying the response", jobs.recording(source, region, light, curve), finish)


def restoring(
    session: Workspace,
    method: Deconvolver | None = None,
    *,
    region: Sequence[Span] | None = None,
) -> Step[Restoration, ImageLayer]:
    """Step of :meth:`Session.restore`: linearize, deconvolve and re-apply in one."""
    photo, source = session.source()
    fitted, blur = session.required_response(), session.required_blur()
    where = source.whole if region is None else session.region(region)
    check_room(source, where)
    used = method or DEFAULT_METHOD
    actions = _restoring_actions(method, None if region is None else pairs(where))

    def finish(made: Restoration) -> Effects[ImageLayer]:
        state = session.state_of(photo).after(*actions)
        return (yield from _show_all(session, photo, state, made, where, fitted))

    job = jobs.restoring(source, where, fitted.curve, blur, used)
    return Step("restoring the photo", job, finish)


def comparing(
    session: Workspace,
    curve: ResponseCurve | None = None,
    method: Deconvolver | None = None,
    *,
    region: Sequence[Span] | None = None,
) -> Step[Restoration, ImageLayer]:
    """Step of :meth:`Session.compare_with`."""
    photo, source = session.source()
    blur = session.required_blur()
    where = source.whole if region is None else session.region(region)
    check_room(source, where)
    assumed = curve or Gamma(2.2)
    used = method or DEFAULT_METHOD
    action = Action.of(
        "compare_with",
        curve=curve,
        method=method,
        region=None if region is None else pairs(where),
    )

    @at_once
    def finish(made: Restoration) -> ImageLayer:
        state = session.state_of(photo).after(action)
        fitted = Fitted((GivenResponse(assumed).estimate(),))
        kind = f"{outputs.RESTORED}, {outputs.curve_name(assumed)}"
        shown = replace(state, fitted=fitted)
        layer = outputs.photo_layer(session, photo, made.photo, where, shown, kind=kind)
        outputs.put_below(session, layer, state.restored)
        session.commit(photo, state)
        return layer

    job = jobs.restoring(source, where, assumed, blur, used)
    return Step(f"restoring with {outputs.curve_name(assumed)}", job, finish)


def previewing(
    session: Workspace, method: Deconvolver | None = None, *, curve: Response | None = None
) -> Step[Image, ImageLayer]:
    """Step of :meth:`Session.preview`: what is visible, restored and shown in place."""
    photo, source = session.source()
    blur = session.required_blur()
    curve = session.required_response().curve if curve is None else curve
    region = visible_part(session.viewer, photo, LARGEST_PREVIEW)

    @at_once
    def finish(pixels: Image) -> ImageLayer:
        return outputs.show_preview(session, photo, pixels, region)

    used = method or DEFAULT_METHOD
    job = jobs.previewing(source, region, curve, blur, used)
    return Step("preview", job, finish)


@dataclass(frozen=True, slots=True, eq=False)
class Whole:
    """All that the whole path finds."""

    edges: EdgeSet | None
    fitted: Fitted
    psf: PsfEstimate
    field: PsfField | None
    made: Restoration


def deblurring(session: Workspace, options: DeblurOptions | None = None) -> Step[Whole, ImageLayer]:
    """Step of :meth:`Session.deblur`."""
    photo, source = session.source()
    check_room(source, source.whole)
    options = options or DeblurOptions()
    before = session.state.edges if options.edges is None else None
    plane = before.plane if before else session.plane(None)
    actions = _whole_actions(options, before, plane)

    def finish(whole: Whole) -> Effects[ImageLayer]:
        state = session.state_of(photo).after(
            *actions, fitted=whole.fitted, psf=whole.psf, field=whole.field
        )
        if whole.edges is not before:
            state = state.with_edges(whole.edges)
        session.commit(photo, state)
        yield
        outputs.show_psf(session, photo, state)
        yield
        layer = yield from _show_all(session, photo, state, whole.made, source.whole, whole.fitted)
        session.say_trust(whole.fitted, whole.psf, whole.field)
        return layer

    job = _whole_path(source, plane, before, options)
    return Step("deblurring the photo", job, finish)


def _whole_path(
    source: Source, plane: Region, found: EdgeSet | None, options: DeblurOptions
) -> Job[Whole]:
    """Long job: the path from the pixels to the restored photo, as of :func:`~.deblur`."""
    extent = options.blur_extent
    if found is None and edges_needed(options):
        if options.edges is None:
            found = yield from jobs.finding_edge_set(source, plane, extent)
        else:
            found = yield from jobs.refining_edge_set(source, plane, options.edges, extent)
    fitted = yield from jobs.fitting_response(source, found, options.response)
    psf = yield from jobs.seeking_psf(
        source, plane, fitted.curve, options.psf, found=found, extent=extent
    )
    field = yield from jobs.seeking_field(
        source, plane, fitted.curve, options.psf, psf, regions=options.regions, extent=extent
    )
    method, blur = options.method or DEFAULT_METHOD, psf.psf if field is None else field
    made = yield from jobs.restoring(source, source.whole, fitted.curve, blur, method)
    return Whole(found, fitted, psf, field, made)


def _whole_actions(options: DeblurOptions, found: EdgeSet | None, plane: Region) -> list[Action]:
    """The whole path as the steps that it consists of."""
    actions = []
    where = stack_index(plane)
    if found is None and edges_needed(options):
        if options.edges is None:
            extent = options.blur_extent
            actions += [Action.of("detect_edges", blur_extent=extent, plane=where)]
        else:
            items = tuple(options.edges)
            extent = options.blur_extent
            actions += [Action.of("set_edges", items=items, blur_extent=extent, plane=where)]
    fits = options.response
    fits = (fits,) if isinstance(fits, ResponseFit) else tuple(fits)
    given = tuple(fit.curve for fit in fits if isinstance(fit, GivenResponse))
    if len(given) == len(fits):
        actions += [Action.of("set_response", curve=given[0] if len(given) == 1 else given)]
    else:
        method, per_channel = unless_default(fits[0]), len(fits) > 1
        actions += [Action.of("estimate_response", method=method, per_channel=per_channel)]
    if isinstance(options.psf, GivenPsf) and options.regions is None:
        actions += [Action.of("set_psf", psf=options.psf.psf)]
    else:
        actions += [Action.of("estimate_psf", method=options.psf, regions=options.regions)]
    return [*actions, *_restoring_actions(options.method, None)]


def _restoring_actions(method: Deconvolver | None, region: Pairs | None) -> list[Action]:
    return [
        Action.of("linearize", region=region),
        Action.of("deconvolve", method=method),
        Action.of("reapply"),
    ]


def _show_all(
    session: Workspace,
    photo: ImageLayer,
    state: State,
    made: Restoration,
    region: Region,
    fitted: Fitted,
) -> Effects[ImageLayer]:
    """Add the three layers of a restoration, one by one, and keep them."""
    light = outputs.light_layer(session, photo, outputs.LINEAR, made.linear, region, state)
    yield
    linear = Linear(light, region, fitted)
    light = outputs.light_layer(session, photo, outputs.SHARP, made.sharp_linear, region, state)
    yield
    layer = outputs.photo_layer(session, photo, made.photo, region, state)
    yield
    sharp = Sharp(light, linear)
    session.commit(photo, replace(state, linear=linear, sharp=sharp, restored=layer))
    return layer
