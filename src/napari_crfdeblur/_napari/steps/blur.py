"""Steps that change the PSF."""

from collections.abc import Sequence

from napari.layers import Image as ImageLayer

from ..._typing import FloatArray
from ...progress import Job, Progress
from ...psf import PsfEstimate, PsfEstimator, PsfStatus, RadonFit, as_psf
from .. import jobs, outputs
from ..layers import Span, pairs
from ..state import Action
from ..step import Step, at_once
from ..workspace import Workspace


def estimating_psf(
    session: Workspace,
    method: PsfEstimator | RadonFit | None = None,
    *,
    region: Sequence[Span] | None = None,
) -> Step[PsfEstimate, PsfEstimate]:
    """Step of :meth:`Session.estimate_psf`."""
    photo, source = session.source()
    fitted = session.required_response()
    where = session.plane(None) if region is None else session.region(region)
    action = Action.of(
        "estimate_psf", method=method, region=None if region is None else pairs(where)
    )

    @at_once
    def finish(psf: PsfEstimate) -> PsfEstimate:
        _put(session, photo, psf, action)
        session.say_trust(psf=psf)
        return psf

    job = jobs.seeking_psf(source, where, fitted.curve, method, found=session.state.edges)
    return Step("estimating the PSF", job, finish)


def setting_psf(
    session: Workspace, psf: FloatArray, *, edited: bool = False
) -> Step[PsfEstimate, PsfEstimate]:
    """Step of :meth:`Session.set_psf`."""
    photo, _ = session.source()
    given = PsfEstimate(as_psf(psf), PsfStatus.EDITED if edited else PsfStatus.GIVEN)
    action = Action.of("set_psf", psf=given.psf, edited=edited)

    def job() -> Job[PsfEstimate]:
        yield Progress("given PSF", 0, 1)
        return given

    @at_once
    def finish(estimate: PsfEstimate) -> PsfEstimate:
        return _put(session, photo, estimate, action)

    return Step("taking the PSF", job(), finish)


def _put(session: Workspace, photo: ImageLayer, psf: PsfEstimate, action: Action) -> PsfEstimate:
    state = session.state_of(photo).after(action, psf=psf)
    outputs.show_psf(session, photo, psf, state)
    session.commit(photo, state)
    return psf
