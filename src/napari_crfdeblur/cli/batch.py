"""``crfdeblur batch``: many photos, one response, and one PSF if that is wanted."""

from argparse import Namespace
from pathlib import Path

from ..batch import Batch, BatchResult, Fate, PsfOf, deblurring_files, journal, shared
from ..estimate import GivenResponse, ResponseFit
from ..io import check_apart
from ..pipeline import DeblurOptions
from .bar import run
from .choices import DECONVOLVERS, psf_estimator, response_fits
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
    whose = WHOSE.get(arguments.psf)
    size = arguments.psf_size
    given = psf_estimator("auto" if whose else arguments.psf, size)
    options = DeblurOptions(
        response=response_fits(arguments),
        blur_extent=arguments.blur_extent,
        psf=given,
        method=DECONVOLVERS[arguments.method](),
    )
    return Batch(
        photos=arguments.photos,
        folder=arguments.output,
        options=options,
        psf_of=whose or PsfOf.EACH,
        suffix=arguments.suffix,
    )


def _shared_files(asked: Batch) -> list[Path]:
    """What a batch writes into its folder beside the photos, whatever those are called."""
    fits = asked.options.response
    methods = [fits] if isinstance(fits, ResponseFit) else fits
    names = [journal.NAME]
    if not all(isinstance(method, GivenResponse) for method in methods):
        names.append(shared.RESPONSE)
    if asked.psf_of is not PsfOf.EACH:
        names.append(shared.PSF)
    return [asked.folder / name for name in names]


def _say_outcomes(result: BatchResult) -> None:
    for each in result.of(Fate.FAILED):
        say(f"{each.photo}: {each.fate.value}: {each.reason}")
    say(result.sentence)
