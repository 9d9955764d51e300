"""Steps on many photos: the response and PSF of the session, applied to layers or files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from napari.layers import Image as ImageLayer

from ..._typing import Image
from ...batch import Batch, Fate, deblurring_files
from ...deconvolution import Deconvolver
from ...errors import CrfDeblurError
from ...estimate import GivenResponse
from ...pipeline import DEFAULT_METHOD, DeblurOptions
from ...progress import Job, Progress
from ...psf import GivenPsf, PsfField
from ...response import Response, ResponseCurve
from .. import jobs, outputs
from ..blurs import PLANE, Blur, axes_of
from ..pixels import Source, source_of, unwrapped
from ..step import Effects, Level, Step, at_once
from ..workspace import Workspace

ONE_PSF = (
    "files are deblurred with one PSF of rows and columns: estimate or choose one for the whole "
    "photo first, or open the files and choose their layers"
)


@dataclass(frozen=True, slots=True, eq=False)
class BatchResult:
    """What became of each photo.

    Parameters
    ----------
    done : dict
        Layer or file of the result, by the name of the photo.
    failed : dict of str to str
        Why a photo was passed over, by its name.
    kept : tuple of str
        Those of `done` that were there from an earlier time.
    """

    done: dict[str, ImageLayer | Path]
    failed: dict[str, str]
    kept: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """How many photos were deblurred, and why the others were not."""
        reasons = [f"{name} was passed over: {why}" for name, why in self.failed.items()]
        total = len(self.done) + len(reasons)
        counted = f"deblurred {len(self.done) - len(self.kept)} of {total}"
        before = [f"{len(self.kept)} done before"] if self.kept else []
        return "; ".join([counted, *before, *reasons])


def restoring_layers(
    session: Workspace, photos: Sequence[ImageLayer], method: Deconvolver | None = None
) -> Step[dict[int, Image | str], BatchResult]:
    """Step of :meth:`Session.restore_layers`."""
    curve, blur, used = _tools(session, method)
    chosen = [unwrapped(photo) for photo in photos]
    if not chosen:
        raise CrfDeblurError("no photo is chosen: choose one or more image layers")
    sources = [source_of(photo, session.white_of(photo)) for photo in chosen]
    fitted, estimate = session.required_response(), session.required_psf()
    parts = session.state.field

    def finish(found: dict[int, Image | str]) -> Effects[BatchResult]:
        result = BatchResult({}, {})
        for number, made in found.items():
            photo = chosen[number]
            if isinstance(made, str):
                result.failed[photo.name] = made
                continue
            state = session.state_of(photo).with_tools(fitted, estimate, parts)
            whole = sources[number].whole
            result.done[photo.name] = outputs.photo_layer(session, photo, made, whole, state)
            yield
        session.say(result.sentence, Level.ERROR if result.failed else Level.INFO)
        return result

    job = _each_layer(sources, curve, blur, used)
    return Step(f"deblurring {len(chosen)} layers", job, finish)


def restoring_files(
    session: Workspace,
    paths: Sequence[Path | str],
    folder: Path | str,
    method: Deconvolver | None = None,
) -> Step[BatchResult, BatchResult]:
    """Step of :meth:`Session.restore_files`."""
    curve, blur, used = _tools(session, method)
    if isinstance(blur, PsfField) or axes_of(blur) != PLANE:
        raise CrfDeblurError(ONE_PSF)
    files = [Path(path) for path in paths]
    if not files:
        raise CrfDeblurError("no file is chosen: choose one or more photos")

    @at_once
    def finish(result: BatchResult) -> BatchResult:
        session.say(result.sentence, Level.ERROR if result.failed else Level.INFO)
        return result

    curves = [curve] if isinstance(curve, ResponseCurve) else curve
    fits = [GivenResponse(each) for each in curves]
    response = fits[0] if len(fits) == 1 else fits
    options = DeblurOptions(response=response, psf=GivenPsf(blur), method=used)
    job = _each_file(Batch(files, Path(folder), options))
    return Step(f"deblurring {len(files)} files", job, finish)


def _tools(session: Workspace, method: Deconvolver | None) -> tuple[Response, Blur, Deconvolver]:
    used = method or DEFAULT_METHOD
    return session.required_response().curve, session.required_blur(), used


def _each_layer(
    sources: Sequence[Source], curve: Response, blur: Blur, method: Deconvolver
) -> Job[dict[int, Image | str]]:
    """Long job: restored pixels by number, or why there are none."""
    found: dict[int, Image | str] = {}
    for number, source in enumerate(sources):
        yield Progress(source.name, number, len(sources))
        try:
            made = yield from jobs.restoring(source, source.whole, curve, blur, method)
            found[number] = made.photo
        except CrfDeblurError as error:
            found[number] = str(error)
    return found


def _each_file(batch: Batch) -> Job[BatchResult]:
    """Long job: every file restored and written; a bad one never stops the others."""
    found = yield from deblurring_files(batch)
    names = [each.photo.name for each in found.outcomes]
    named = {
        each.photo.name if names.count(each.photo.name) == 1 else str(each.photo): each
        for each in found.outcomes
    }
    return BatchResult(
        {name: each.result for name, each in named.items() if each.result is not None},
        {name: each.reason for name, each in named.items() if each.result is None},
        tuple(name for name, each in named.items() if each.fate is Fate.KEPT),
    )
