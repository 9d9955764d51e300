"""What the photos of a batch share: the response of their camera, and maybe their PSF."""

from collections.abc import Sequence
from dataclasses import fields, replace
from enum import Enum
from pathlib import Path

import numpy as np

from .._typing import FloatArray, Image
from ..crew.stamp import Stamp
from ..errors import REFUSALS, CrfDeblurError
from ..estimate import PerChannel, ResponseEstimate, estimating_responses
from ..io import read_photo, read_psf, read_responses, write_psf, write_responses
from ..io.limits import Limits
from ..photo import check_photo
from ..pipeline import DeblurOptions, Intermediates, Stage, profiling, walking
from ..pipeline.intermediates import made
from ..profiles import ProfileGroup
from ..progress import Job, Progress, nth
from ..psf import GivenPsf, PsfEstimate
from ..quality import kernel_similarity
from .journal import Journal, fingerprint

RESPONSE, PSF = "crfdeblur-response.json", "crfdeblur-psf.npy"
MOST = 24  # photos from which a response is found: more of them hardly narrow its band
COMPARED = 5  # photos of which the PSFs are compared


class PsfOf(Enum):
    """Whose PSF each photo is restored with, if it is not given."""

    EACH = "its own"
    FIRST = "that of the first photo"
    ONE = "of those of several photos the one that agrees best with the others"


def load(photo: Path, limits: Limits) -> tuple[Image, Stamp]:
    """A photo that can be deblurred, and its stamp; refused if it changes meanwhile."""
    stamp = Stamp.of(photo)
    pixels = read_photo(photo, limits=limits)
    stamp.check()
    check_photo(pixels)
    return pixels, stamp


def sharing_response(
    options: DeblurOptions, photos: Sequence[Path], journal: Journal, limits: Limits
) -> Job[tuple[DeblurOptions, tuple[ResponseEstimate, ...]]]:
    """Long job: the options with one response for all photos, and how it was found.

    What was found before from the same photos, or from more, is taken again.
    """
    method = options.response
    if not method.needs_profiles:
        return options, ()
    path = journal.folder / RESPONSE
    way = fingerprint({"response": method, "blur_extent": options.blur_extent})
    found: tuple[ResponseEstimate, ...] = ()
    if not (path.exists() and journal.found("response", way, [*photos])):
        groups = yield from _pooling(options, _spread(photos, MOST), limits)
        found = (yield from estimating_responses(groups, method)).estimates
        write_responses(path, found)
        journal.keep("response", way, [*photos])
    # as the file has it, so that another run gets the same numbers
    return replace(options, response=PerChannel.given(read_responses(path))), found


def sharing_psf(
    options: DeblurOptions,
    psf_of: PsfOf,
    photos: Sequence[Path],
    journal: Journal,
    limits: Limits,
) -> Job[DeblurOptions]:
    """Long job: the options with one PSF for all photos, if that is wanted."""
    if psf_of is PsfOf.EACH or isinstance(options.psf, GivenPsf):
        return options
    path = journal.folder / PSF
    asked = photos[:1] if psf_of is PsfOf.FIRST else photos
    way = fingerprint({"whose": psf_of.name, "options": settings_of(options)})
    if not (path.exists() and journal.found("psf", way, [*asked])):
        count = 1 if psf_of is PsfOf.FIRST else COMPARED
        candidates = photos if psf_of is PsfOf.FIRST else _spread(photos, COMPARED)
        found = yield from _measuring(options, candidates, count, limits)
        write_psf(path, _most_alike([each.psf for each in found]))
        journal.keep("psf", way, [*asked])
    return replace(options, psf=GivenPsf(read_psf(path)))


def settings_of(options: DeblurOptions) -> dict[str, object]:
    """What decides how a photo is restored, for its fingerprint."""
    return {each.name: getattr(options, each.name) for each in fields(options)}


def _pooling(
    options: DeblurOptions, photos: Sequence[Path], limits: Limits
) -> Job[list[ProfileGroup]]:
    """Job: profiles of all photos that permit it."""
    groups: list[ProfileGroup] = []
    good = 0
    for index, path in enumerate(photos):
        yield Progress(f"edges of {path.name}", index, len(photos))
        try:
            pixels, _ = load(path, limits)
            job = profiling(pixels, options, index)
            groups += (yield from nth(job, index, len(photos), "photo")).groups or ()
        except REFUSALS:
            continue  # it will be reported when its turn comes
        good += 1
    if not good:
        raise CrfDeblurError("none of the photos can be read; give at least one whole photo")
    return groups


def _measuring(
    options: DeblurOptions, photos: Sequence[Path], count: int, limits: Limits
) -> Job[list[PsfEstimate]]:
    """Job: the PSFs of the first `count` photos that permit it."""
    found: list[PsfEstimate] = []
    for index, path in enumerate(photos):
        yield Progress(f"PSF of {path.name}", index, len(photos))
        try:
            pixels, _ = load(path, limits)
            job = walking(Intermediates(pixels), options, until=Stage.PSF)
            found.append(made((yield from nth(job, index, len(photos), "photo")).psf, "a PSF"))
        except REFUSALS:
            continue
        if len(found) == count:
            break
    if not found:
        raise CrfDeblurError("the PSF can be found from none of the photos; give one")
    return found


def _most_alike(psfs: Sequence[FloatArray]) -> FloatArray:
    """Of several PSFs the one that is most similar to all others."""
    alike = [sum(kernel_similarity(one, other) for other in psfs) for one in psfs]
    return psfs[int(np.argmax(alike))]


def _spread(photos: Sequence[Path], most: int) -> list[Path]:
    """At most `most` of the photos, evenly spread over all of them."""
    count = min(most, len(photos))
    return [photos[i * len(photos) // count] for i in range(count)]
