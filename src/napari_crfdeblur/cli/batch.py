"""``crfdeblur batch``: many photos, one response, and one PSF if that is wanted."""

from argparse import Namespace
from pathlib import Path

from ..batch import Batch, BatchResult, Fate, PsfOf, deblurring_files, journal, shared
from ..io import check_apart
from .bar import run
from .choices import deblur_options, limits_of
from .files import files_read
from .terminal import say

WHOSE = {each.name.lower(): each for each in PsfOf}


def batch(arguments: Namespace) -> bool:
    """``crfdeblur batch``; whether no photo was passed over."""
    asked = _batch(arguments)
    check_apart(files_read(arguments), _shared_files(asked))
    result = run(deblurring_files(asked, scheduler=arguments.scheduler))
    for number, response in enumerate(result.responses):
        name = "response" if len(result.responses) == 1 else f"response {'RGB'[number]}"
        say(f"{name}: {response.status.value}")
    _say_outcomes(result)
    return not result.of(Fate.FAILED)


def _batch(arguments: Namespace) -> Batch:
    return Batch(
        photos=arguments.photos,
        folder=arguments.output,
        options=deblur_options(arguments),
        psf_of=WHOSE.get(arguments.psf, PsfOf.EACH),
        suffix=arguments.suffix,
        limits=limits_of(arguments),
    )


def _shared_files(asked: Batch) -> list[Path]:
    """What a batch writes into its folder beside the photos, whatever those are called."""
    names = [journal.NAME]
    if asked.options.response.needs_profiles:
        names.append(shared.RESPONSE)
    if asked.psf_of is not PsfOf.EACH:
        names.append(shared.PSF)
    return [asked.folder / name for name in names]


def _say_outcomes(result: BatchResult) -> None:
    for each in result.of(Fate.FAILED):
        say(f"{each.photo}: {each.fate.value}: {each.reason}")
    say(result.sentence)
