"""Many photos deblurred one after the other: the verb, its options, and what became of each."""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

from .._typing import Image
from ..crew.alone import alone, taking_turn
from ..crew.stamp import Stamp
from ..crew.workers import ClusterError, Workers, WorkersDied, workers
from ..errors import REFUSALS, CrfDeblurError, in_words
from ..estimate import ResponseEstimate
from ..io import images, make_folder, write_photo
from ..io.files import check_input
from ..io.limits import LIMITS, Limits
from ..pipeline import DeblurOptions, deblurring
from ..progress import Job, Progress, drain, nth
from ..psf import GivenPsf
from .journal import Journal, fingerprint
from .shared import PsfOf, load, settings_of, sharing_psf, sharing_response

PLANE = 2  # axes
UNFINISHED = ".crfdeblur-unfinished"


class Fate(Enum):
    """What became of a photo; the value is what the user reads."""

    DONE = "deblurred"
    KEPT = "done before"
    FAILED = "passed over"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one photo.

    Parameters
    ----------
    photo : Path
    fate : Fate
    result : Path, optional
        Where the deblurred photo is.
    reason : str
        Why it was passed over.
    """

    photo: Path
    fate: Fate
    result: Path | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class BatchResult:
    """What became of all photos.

    Parameters
    ----------
    outcomes : tuple of Outcome
        In the order of the photos.
    responses : tuple of ResponseEstimate
        Found from all photos; empty if it was given or found before.
    """

    outcomes: tuple[Outcome, ...]
    responses: tuple[ResponseEstimate, ...] = ()

    def of(self, fate: Fate) -> tuple[Outcome, ...]:
        """Those to which this has happened."""
        return tuple(each for each in self.outcomes if each.fate is fate)

    @property
    def sentence(self) -> str:
        """How many photos were deblurred, and how many were not."""
        counts = {fate: len(self.of(fate)) for fate in Fate}
        others = [
            f"{counts[fate]} {fate.value}" for fate in (Fate.KEPT, Fate.FAILED) if counts[fate]
        ]
        return ", ".join([f"deblurred {counts[Fate.DONE]} of {len(self.outcomes)}", *others])


@dataclass(frozen=True, slots=True)
class Batch:
    """Photos to be deblurred into a folder.

    Parameters
    ----------
    photos : sequence of Path
        PNG, JPEG or TIFF; of one camera, unless the response is given for all.
    folder : Path
        For the results and the journal; made if it is missing.
    options : DeblurOptions
        How. A response that is to be estimated is estimated once, from the photos together.
    psf_of : PsfOf
        Whose PSF is used, if it is to be estimated.
    suffix : str
        What is added to the name of a photo. Where a name is taken, a number follows.
    limits : Limits
        For the size of each photo.
    """

    photos: Sequence[Path]
    folder: Path
    options: DeblurOptions = field(default_factory=DeblurOptions)
    psf_of: PsfOf = PsfOf.EACH
    suffix: str = "-deblurred"
    limits: Limits = LIMITS

    def __post_init__(self) -> None:
        if not self.photos:
            raise CrfDeblurError("no file is chosen: choose one or more photos")
        given = self.options.psf
        if isinstance(given, GivenPsf) and given.psf.ndim > PLANE:
            raise CrfDeblurError(
                "the PSF has three dimensions, and is for stacks: restore them one by one, or give "
                "a PSF with rows and columns"
            )
        if any(part in self.suffix for part in "/\\\0"):
            raise CrfDeblurError(f'"{self.suffix}": cannot be a part of the name of a file')


def deblur_files(batch: Batch, *, scheduler: str | None = None) -> BatchResult:
    """Deblur many photos, each into a file of its own.

    What was done before, from the same photo and by the same settings, is not done again. A
    photo that cannot be deblurred is passed over. Whatever happens, results are whole files.

    Parameters
    ----------
    batch : Batch
        What, where to and how.
    scheduler : str, optional
        Address of the scheduler of a ``dask.distributed`` cluster, whose workers then deblur
        several photos at a time; they get the pixels, and need not see the files.

    Raises
    ------
    CrfDeblurError
        The folder cannot be written, or another batch is at work in it; the scheduler does not
        answer; or no photo at all tells the response or the PSF that all are to have.
    """
    return drain(deblurring_files(batch, scheduler=scheduler))


def deblurring_files(batch: Batch, *, scheduler: str | None = None) -> Job[BatchResult]:
    """Job of :func:`deblur_files`: reports progress, can be stopped."""
    lock = yield from taking_turn(batch.folder)
    try:
        make_folder(batch.folder)
        with alone(batch.folder):
            return (yield from _deblurring_files(batch, scheduler))
    finally:
        lock.release()


def _deblurring_files(batch: Batch, scheduler: str | None) -> Job[BatchResult]:
    """Long job: the batch, once it is alone in its folder."""
    yield Progress("reading the journal", 0, 1)
    photos = list(dict.fromkeys(path.absolute() for path in batch.photos))
    journal = Journal.of(batch.folder)
    options, responses = yield from sharing_response(batch.options, photos, journal, batch.limits)
    options = yield from sharing_psf(options, batch.psf_of, photos, journal, batch.limits)
    with _unfinished(batch.folder) as aside:
        settings = fingerprint(settings_of(options))
        given = frozenset(photo.resolve() for photo in photos)
        work = _Work(journal, aside, options, settings, batch.suffix, batch.limits, given)
        if scheduler is None:
            outcomes = yield from _one_by_one(work, photos)
        else:
            with workers(scheduler) as crew:
                outcomes = yield from _by_workers(work, photos, crew)
    return BatchResult(tuple(outcomes[photo] for photo in photos), responses)


@dataclass(frozen=True, slots=True, eq=False)
class _Work:
    """What is done with each photo, but for the computing."""

    journal: Journal
    aside: Path
    options: DeblurOptions
    settings: str
    suffix: str
    limits: Limits
    given: frozenset[Path]

    def begin(self, photo: Path) -> tuple[str, Image, Stamp] | Outcome:
        """Name of the result, pixels and stamp of a photo; or its fate, if it is clear."""
        name = self.journal.claim(photo, self.suffix, _ending(photo))
        try:
            check_input(photo)
            if self.journal.is_done(name, Stamp.of(photo), self.settings):
                return Outcome(photo, Fate.KEPT, self.journal.folder / name)
            if (self.journal.folder / name).resolve() in self.given:
                raise CrfDeblurError(f"its result, {name}, was given as a photo; leave that out")
            return name, *load(photo, self.limits)
        except REFUSALS as error:
            return failed(photo, error)

    def finish(self, photo: Path, name: str, stamp: Stamp, sharp: Image) -> Outcome:
        """Write a result, whole or not at all, and note it."""
        result = self.journal.folder / name
        try:
            stamp.check()
            write_photo(self.aside / name, sharp, like=photo)
            (self.aside / name).replace(result)
        except REFUSALS as error:
            return failed(photo, error)
        self.journal.finish(name, stamp, self.settings)
        return Outcome(photo, Fate.DONE, result)


def _one_by_one(work: _Work, photos: Sequence[Path]) -> Job[dict[Path, Outcome]]:
    """Job: each photo after the other in this process."""
    outcomes: dict[Path, Outcome] = {}
    for number, photo in enumerate(photos):
        yield Progress(photo.name, number, len(photos))
        begun = work.begin(photo)
        if isinstance(begun, Outcome):
            outcomes[photo] = begun
            continue
        name, pixels, stamp = begun
        try:
            job = nth(deblurring(pixels, work.options), number, len(photos), "photo")
            sharp = (yield from job).photo
        except REFUSALS as error:
            outcomes[photo] = failed(photo, error)
        else:
            outcomes[photo] = work.finish(photo, name, stamp, sharp)
    return outcomes


def _by_workers(work: _Work, photos: Sequence[Path], crew: Workers) -> Job[dict[Path, Outcome]]:
    """Job: several photos at a time on a cluster.

    Workers that die take several photos down. Each of these gets them once more to itself, so
    that only the one at which they die is passed over.
    """
    outcomes: dict[Path, Outcome] = {}
    suspects = yield from _shared_out(work, photos, crew, outcomes)
    for photo in suspects:
        for each in (yield from _shared_out(work, [photo], crew, outcomes)):
            outcomes[each] = failed(each, suspects[photo])
    return {photo: outcomes[photo] for photo in photos}


def _shared_out(
    work: _Work, photos: Sequence[Path], crew: Workers, outcomes: dict[Path, Outcome]
) -> Job[dict[Path, WorkersDied]]:
    """Job: adds what became of the photos; returns those at which workers died."""
    waiting = iter(photos)
    pending: dict[Any, tuple[Path, str, Stamp]] = {}
    suspects: dict[Path, WorkersDied] = {}
    total = len(outcomes) + len(photos)
    try:
        while len(outcomes) + len(suspects) < total:
            while len(pending) <= crew.size and (photo := next(waiting, None)):
                begun = work.begin(photo)
                if isinstance(begun, Outcome):
                    outcomes[photo] = begun
                    continue
                name, pixels, stamp = begun
                pending[crew.call(sharpened, pixels, work.options)] = photo, name, stamp
            for task in crew.done(pending) if pending else ():
                photo, name, stamp = pending.pop(task)
                try:
                    sharp = crew.result(task)
                except ClusterError:
                    raise
                except WorkersDied as error:
                    suspects[photo] = error
                except REFUSALS as error:
                    outcomes[photo] = failed(photo, error)
                else:
                    outcomes[photo] = work.finish(photo, name, stamp, sharp)
            yield Progress("photos", len(outcomes), total)
    finally:
        crew.drop(pending)
    return suspects


def sharpened(pixels: Image, options: DeblurOptions) -> Image:
    """A deblurred photo, without anything else of what was found."""
    return drain(deblurring(pixels, options)).photo


def failed(photo: Path, error: BaseException) -> Outcome:
    """A photo that is passed over, and why."""
    return Outcome(photo, Fate.FAILED, reason=in_words(error).removeprefix(f"{photo}: "))


def _ending(photo: Path) -> str:
    return photo.suffix if photo.suffix.lower() in images.WRITABLE else ".png"


@contextmanager
def _unfinished(folder: Path) -> Iterator[Path]:
    """A folder for what is being written; what a killed batch has left there is dropped."""
    aside = folder / UNFINISHED
    shutil.rmtree(aside, ignore_errors=True)
    aside.mkdir()
    try:
        yield aside
    finally:
        shutil.rmtree(aside, ignore_errors=True)
