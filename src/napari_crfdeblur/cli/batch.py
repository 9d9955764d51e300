"""``crfdeblur batch``: many photos, one response, and one PSF if that is wanted."""

from argparse import Namespace

from ..batch import Batch, BatchResult, Fate, PsfOf, deblurring_files
from ..pipeline import DeblurOptions
from .bar import run
from .choices import DECONVOLVERS, psf_estimator, response_fits

WHOSE = {each.name.lower(): each for each in PsfOf}


def batch(arguments: Namespace) -> bool:
    """``crfdeblur batch``; whether no photo was passed over."""
    result = run(deblurring_files(_batch(arguments), scheduler=arguments.scheduler))
    for number, response in enumerate(result.responses):
        name = "response" if len(result.responses) == 1 else f"response {'RGB'[number]}"
        print(f"{name}: {response.status.value}")
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


def _say_outcomes(result: BatchResult) -> None:
    for each in result.of(Fate.FAILED):
        print(f"{each.photo}: {each.fate.value}: {each.reason}")
    print(result.sentence)
