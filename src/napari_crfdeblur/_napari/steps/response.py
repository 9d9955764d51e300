"""Steps that change the response."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from napari.layers import Image as ImageLayer

from ...errors import CrfDeblurError
from ...estimate import GivenResponse, MaximumLikelihood, ResponseFit
from ...io import to_record
from ...progress import Job, Progress
from ...response import Response, ResponseCurve
from .. import jobs
from ..jobs import Other
from ..pixels import source_of, unwrapped
from ..regions import shown_plane
from ..state import Action, Fitted
from ..step import Step, at_once
from ..workspace import Workspace


def estimating_response(
    session: Workspace,
    method: ResponseFit | None = None,
    *,
    per_channel: bool = False,
    others: Sequence[ImageLayer | Path | str] = (),
) -> Step[Fitted, Fitted]:
    """Step of :meth:`Session.estimate_response`."""
    photo, source = session.source()
    edges = session.required_edges()
    further = [_other(session, other) for other in others]
    named = tuple(other.name for other in further)
    fit = method or MaximumLikelihood()
    action = Action.of(
        "estimate_response", method=unless_default(fit), per_channel=per_channel, others=named
    )

    @at_once
    def finish(fitted: Fitted) -> Fitted:
        session.commit(photo, session.state_of(photo).after(action, fitted=fitted))
        session.say_trust(fitted)
        return fitted

    job = jobs.fitting_response(source, edges, [fit] * 3 if per_channel else fit, further)
    return Step("estimating the response", job, finish)


def following_edges(
    session: Workspace, stay: Collection[int] | None = None
) -> Step[Fitted | None, Fitted | None]:
    """The response after a change of the edges, at once from the last one.

    It is kept beside the response, which it changes no more than the record of what was done.

    Parameters
    ----------
    session : Workspace
    stay : collection of int, optional
        Numbers of the edges that count; all of them by default.

    Raises
    ------
    CrfDeblurError
        There are no edges, or the response is none that can follow them.
    """
    photo, _ = session.source()
    edges, fitted = session.required_edges(), session.required_response()
    last = session.state.live or fitted
    if not last.fits:
        raise CrfDeblurError("only a response of maximum likelihood can follow the edges")

    @at_once
    def finish(live: Fitted | None) -> Fitted | None:
        state = session.state_of(photo)
        if live is not None and state.edges is edges and state.fitted is fitted:
            session.commit(photo, replace(state, live=live))
        return live

    return Step("following the edges", jobs.following_edges(last, edges, stay), finish)


def unless_default(fit: ResponseFit) -> ResponseFit | None:
    """How the response was found, or None for the default, which needs no mention."""
    if not isinstance(fit, MaximumLikelihood):
        return fit
    # Methods that hold arrays do not compare, but their records do.
    return None if to_record(fit) == to_record(MaximumLikelihood()) else fit


def setting_response(session: Workspace, curve: Response) -> Step[Fitted, Fitted]:
    """Step of :meth:`Session.set_response`."""
    photo, source = session.source()
    curves = (curve,) if isinstance(curve, ResponseCurve) else tuple(curve)
    if len(curves) not in (1, 3):
        raise ValueError(f"expected one curve or 3, one for each channel, got {len(curves)}")
    if len(curves) == 3 and not source.rgb:
        raise CrfDeblurError(
            f"this response has three channels, but “{photo.name}” is gray: choose a response of "
            "one curve"
        )
    action = Action.of("set_response", curve=curves[0] if len(curves) == 1 else curves)

    def job() -> Job[Fitted]:
        yield Progress("given response", 0, 1)
        return Fitted(tuple(GivenResponse(one).estimate() for one in curves))

    @at_once
    def finish(fitted: Fitted) -> Fitted:
        session.commit(photo, session.state_of(photo).after(action, fitted=fitted))
        return fitted

    return Step("taking the response", job(), finish)


def _other(session: Workspace, other: ImageLayer | Path | str) -> Other:
    """A further photo, by layer, by the name of a layer, or by file."""
    if isinstance(other, str) and other in session.viewer.layers:
        other = session.viewer.layers[other]
    if isinstance(other, str | Path):
        return Other.of_file(Path(other))
    other = unwrapped(other)
    source = source_of(other, session.white_of(other))
    edges = session.state_of(other).edges
    plane = edges.plane if edges else shown_plane(session.viewer, other)
    return Other(other.name, partial(source.photo, plane), edges.edges if edges else None)
