"""Steps on many photos: the response and PSF of the session, applied to layers or files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from napari.layers import Image as ImageLayer

from ..._typing import FloatArray, Image
from ...deconvolution import Deconvolver
from ...errors import CrfDeblurError
from ...io import images, make_folder, read_photo, write_photo
from ...linear import Response
from ...pipeline import suited_deconvolver
from ...progress import Job, Progress
from .. import jobs, outputs
from ..layers import Source, source_of, unwrapped
from ..step import Effects, Level, Step, at_once
from ..workspace import Workspace


@dataclass(frozen=True, slots=True, eq=False)
class BatchResult:
    """What became of each photo.

    Parameters
    ----------
    done : dict
        Layer or file of the result, by the name of the photo.
    failed : dict of str to str
        Why a photo was passed over, by its name.
    """

    done: dict[str, ImageLayer | Path]
    failed: dict[str, str]

    @property
    def sentence(self) -> str:
        """How many photos were deblurred, and why the others were not."""
        reasons = [f"{name} was passed over: {why}" for name, why in self.failed.items()]
        return "; ".join(
            [f"deblurred {len(self.done)} of {len(self.done) + len(reasons)}", *reasons]
        )


def restoring_layers(
    session: Workspace, photos: Sequence[ImageLayer], method: Deconvolver | None = None
) -> Step[dict[int, Image | str], BatchResult]:
    """Step of :meth:`Session.restore_layers`."""
    curve, psf, used = _tools(session, method)
    chosen = [unwrapped(photo) for photo in photos]
    if not chosen:
        raise CrfDeblurError("no photo is chosen: choose one or more image layers")
    sources = [source_of(photo, session.white_of(photo)) for photo in chosen]
    fitted, estimate = session.required_response(), session.required_psf()

    def finish(found: dict[int, Image | str]) -> Effects[BatchResult]:
        result = BatchResult({}, {})
        for number, made in found.items():
            photo = chosen[number]
            if isinstance(made, str):
                result.failed[photo.name] = made
                continue
            state = session.state_of(photo).with_tools(fitted, estimate)
            whole = sources[number].whole
            result.done[photo.name] = outputs.photo_layer(session, photo, made, whole, state)
            yield
        session.say(result.sentence, Level.ERROR if result.failed else Level.INFO)
        return result

    job = _each_layer(sources, curve, psf, used)
    return Step(f"deblurring {len(chosen)} layers", job, finish)


def restoring_files(
    session: Workspace,
    paths: Sequence[Path | str],
    folder: Path | str,
    method: Deconvolver | None = None,
) -> Step[BatchResult, BatchResult]:
    """Step of :meth:`Session.restore_files`."""
    curve, psf, used = _tools(session, method)
    files = [Path(path) for path in paths]
    if not files:
        raise CrfDeblurError("no file is chosen: choose one or more photos")

    @at_once
    def finish(result: BatchResult) -> BatchResult:
        session.say(result.sentence, Level.ERROR if result.failed else Level.INFO)
        return result

    job = _each_file(files, Path(folder), curve, psf, used)
    return Step(f"deblurring {len(files)} files", job, finish)


def _tools(
    session: Workspace, method: Deconvolver | None
) -> tuple[Response, FloatArray, Deconvolver]:
    psf = session.required_psf()
    return session.required_response().curve, psf.psf, method or suited_deconvolver(psf)


def _each_layer(
    sources: Sequence[Source], curve: Response, psf: FloatArray, method: Deconvolver
) -> Job[dict[int, Image | str]]:
    """Long job: restored pixels by number, or why there are none."""
    found: dict[int, Image | str] = {}
    for number, source in enumerate(sources):
        yield Progress(source.name, number, len(sources))
        try:
            made = yield from jobs.restoring(source, source.whole, curve, psf, method)
            found[number] = made.photo
        except CrfDeblurError as error:
            found[number] = str(error)
    return found


def _each_file(
    files: Sequence[Path], folder: Path, curve: Response, psf: FloatArray, method: Deconvolver
) -> Job[BatchResult]:
    """Long job: every file restored and written; a bad one never stops the others."""
    make_folder(folder)
    result = BatchResult({}, {})
    for number, path in enumerate(files):
        yield Progress(path.name, number, len(files))
        suffix = path.suffix if path.suffix.lower() in images.WRITABLE else ".png"
        output = folder / f"{path.stem}-deblurred{suffix}"
        try:
            photo = read_photo(path)
            source = Source(photo, photo.ndim == 3, None, path.name)
            made = yield from jobs.restoring(source, source.whole, curve, psf, method)
            write_photo(output, made.photo, like=path)
        except (CrfDeblurError, OSError) as error:
            result.failed[path.name] = str(error)
        else:
            result.done[path.name] = output
    return result
