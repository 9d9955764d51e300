"""Steps that change the PSF."""

from collections.abc import Sequence
from typing import TypeAlias

from napari.layers import Image as ImageLayer

from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...progress import Job, Progress
from ...psf import PsfEstimate, PsfEstimator, PsfField, PsfStatus, RadonFit, as_psf
from ...response import Response
from .. import jobs, outputs
from ..blurs import check_fit
from ..pixels import Region, Source
from ..regions import Span, pairs
from ..state import Action, EdgeSet
from ..step import Step, at_once
from ..workspace import Workspace

ALL_OF_IT = (
    "PSFs of parts are found in the whole picture: leave out the region, or look for one PSF"
)
Found: TypeAlias = tuple[PsfEstimate, PsfField | None]


def estimating_psf(
    session: Workspace,
    method: PsfEstimator | RadonFit | None = None,
    *,
    region: Sequence[Span] | None = None,
    regions: int | tuple[int, int] | None = None,
) -> Step[Found, PsfEstimate]:
    """Step of :meth:`Session.estimate_psf`."""
    photo, source = session.source()
    fitted = session.required_response()
    where = session.plane(None) if region is None else session.region(region)
    if regions is not None and where[-2:] != source.whole[-2:]:
        raise CrfDeblurError(ALL_OF_IT)
    action = Action.of(
        "estimate_psf",
        method=method,
        region=None if region is None else pairs(where),
        regions=regions,
    )

    @at_once
    def finish(found: Found) -> PsfEstimate:
        psf = _put(session, photo, *found, action)
        session.say_trust(None, *found)
        return psf

    job = _seeking(source, where, fitted.curve, method, session.state.edges, regions)
    return Step("estimating the PSF", job, finish)


def setting_psf(
    session: Workspace,
    psf: FloatArray,
    *,
    edited: bool = False,
    field: PsfField | None = None,
) -> Step[PsfEstimate, PsfEstimate]:
    """Step of :meth:`Session.set_psf`."""
    photo, source = session.source()
    given = PsfEstimate(as_psf(psf), PsfStatus.EDITED if edited else PsfStatus.GIVEN)
    check_fit(given.psf if field is None else field, source)
    action = Action.of("set_psf", psf=given.psf, edited=edited, field=field)

    def job() -> Job[PsfEstimate]:
        yield Progress("given PSF", 0, 1)
        return given

    @at_once
    def finish(estimate: PsfEstimate) -> PsfEstimate:
        return _put(session, photo, estimate, field, action)

    return Step("taking the PSF", job(), finish)


def _seeking(
    source: Source,
    where: Region,
    curve: Response,
    method: PsfEstimator | RadonFit | None,
    found: EdgeSet | None,
    regions: int | tuple[int, int] | None,
) -> Job[Found]:
    """Long job: the PSF of the whole, and those of its parts if it is to be divided."""
    psf = yield from jobs.seeking_psf(source, where, curve, method, found=found)
    field = yield from jobs.seeking_field(source, where, curve, method, psf, regions=regions)
    return psf, field


def _put(
    session: Workspace,
    photo: ImageLayer,
    psf: PsfEstimate,
    field: PsfField | None,
    action: Action,
) -> PsfEstimate:
    state = session.state_of(photo).after(action, psf=psf, field=field)
    outputs.show_psf(session, photo, state)
    session.commit(photo, state)
    return psf
