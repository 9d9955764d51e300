"""Verbs that restore other photos, layers or files, with what is known of this one."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from napari.layers import Image as ImageLayer

from ...batch import Batch, Fate, deblurring_files
from ...deconvolution import Deconvolver
from ...errors import REFUSALS, CrfDeblurError, in_words
from ...estimate import PerChannel, Responses
from ...pipeline import DEFAULT_METHOD, DeblurOptions, PhotoStack, Stage
from ...pipeline.blur import Blur, axes_of
from ...pipeline.intermediates import PLANE, made
from ...progress import Job, Progress
from ...psf import GivenPsf, PsfField
from .. import outputs
from ..pixels import source_of, unwrapped
from .products import Product, making
from .step import Effects, Level, Step, at_once
from .way import record_of, way_of
from .workspace import Workspace

ONE_PSF = (
    "files are deblurred with one PSF of rows and columns: estimate or choose one for the whole "
    "photo first, or open the files and choose their layers"
)


@dataclass(frozen=True, slots=True, eq=False)
class PhotosDone:
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


class BatchVerbs(Workspace):
    """Verbs of a session that restore other photos with what is known of this one."""

    def restore_layers(
        self, photos: Sequence[ImageLayer], method: Deconvolver | None = None
    ) -> PhotosDone:
        """Restore other photos with the response and the PSF of this one, as layers.

        Parameters
        ----------
        photos : sequence of napari.layers.Image
            Photos and stacks of the same camera with the same blur.
        method : Deconvolver, optional
            As in :meth:`deconvolve`.
        """
        return self.do(restoring_layers(self, photos, method))

    def restore_files(
        self,
        paths: Sequence[Path | str],
        folder: Path | str,
        method: Deconvolver | None = None,
    ) -> PhotosDone:
        """Restore files with the response and the PSF of this photo.

        Parameters
        ----------
        paths : sequence of Path
            Photos of the same camera with the same blur; a bad one is passed over.
        folder : Path
            Where ``NAME-deblurred`` files are written; made if it is missing.
        method : Deconvolver, optional
            As in :meth:`deconvolve`.
        """
        return self.do(restoring_files(self, paths, folder, method))


def restoring_layers(
    session: Workspace, photos: Sequence[ImageLayer], method: Deconvolver | None = None
) -> Step[dict[int, Product | str], PhotosDone]:
    """Step of :meth:`BatchVerbs.restore_layers`."""
    blur, used = session.required_blur(), method or DEFAULT_METHOD
    chosen = [unwrapped(photo) for photo in photos]
    if not chosen:
        raise CrfDeblurError("no photo is chosen: choose one or more image layers")
    for photo in chosen:
        source_of(photo, white=1.0)
    sources = [source_of(photo, session.white_of(photo)) for photo in chosen]
    fitted, estimate = session.required_response(), session.required_psf()
    parts = session.state.field

    def finish(found: dict[int, Product | str]) -> Effects[PhotosDone]:
        result = PhotosDone({}, {})
        for number, product in found.items():
            photo, source = chosen[number], sources[number]
            if isinstance(product, str):
                result.failed[photo.name] = product
                continue
            state = session.state_of(photo).with_tools(fitted, estimate, parts)
            way = way_of(state, method=used)
            record = record_of(
                source, way, Stage.REAPPLY, photo=product.photo, result=product.result
            )
            pixels = made(product.restored.photo, "a result")
            result.done[photo.name] = outputs.photo_layer(
                session, photo, pixels, source.whole, state, record
            )
            yield
        session.say(result.sentence, Level.ERROR if result.failed else Level.INFO)
        return result

    job = _each_layer(sources, fitted.responses, blur, DeblurOptions(method=used))
    return Step(f"deblurring {len(chosen)} layers", job, finish)


def restoring_files(
    session: Workspace,
    paths: Sequence[Path | str],
    folder: Path | str,
    method: Deconvolver | None = None,
) -> Step[PhotosDone, PhotosDone]:
    """Step of :meth:`BatchVerbs.restore_files`."""
    blur, used = session.required_blur(), method or DEFAULT_METHOD
    if isinstance(blur, PsfField) or axes_of(blur) != PLANE:
        raise CrfDeblurError(ONE_PSF)
    files = [Path(path) for path in paths]
    if not files:
        raise CrfDeblurError("no file is chosen: choose one or more photos")

    @at_once
    def finish(result: PhotosDone) -> PhotosDone:
        session.say(result.sentence, Level.ERROR if result.failed else Level.INFO)
        return result

    response = PerChannel.given([own.curve for own in session.required_response().estimates])
    options = DeblurOptions(response=response, psf=GivenPsf(blur), method=used)
    job = _each_file(Batch(files, Path(folder), options))
    return Step(f"deblurring {len(files)} files", job, finish)


def _each_layer(
    sources: Sequence[PhotoStack], response: Responses, blur: Blur, options: DeblurOptions
) -> Job[dict[int, Product | str]]:
    """Long job: what was made by number, or why there are none."""
    found: dict[int, Product | str] = {}
    for number, source in enumerate(sources):
        yield Progress(source.name, number, len(sources))
        try:
            found[number] = yield from making(source, source.whole, response, blur, options)
        except REFUSALS as error:
            found[number] = in_words(error)
    return found


def _each_file(batch: Batch) -> Job[PhotosDone]:
    """Long job: every file restored and written; a bad one never stops the others."""
    found = yield from deblurring_files(batch)
    names = [each.photo.name for each in found.outcomes]
    named = {
        each.photo.name if names.count(each.photo.name) == 1 else str(each.photo): each
        for each in found.outcomes
    }
    return PhotosDone(
        {name: each.result for name, each in named.items() if each.result is not None},
        {name: each.reason for name, each in named.items() if each.result is None},
        tuple(name for name, each in named.items() if each.fate is Fate.KEPT),
    )
