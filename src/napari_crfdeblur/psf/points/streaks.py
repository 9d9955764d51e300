"""The PSF from the streaks that lamps leave on a photo taken at night."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import ndimage

from ... import arguments
from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...progress import Job, Progress
from ..base import Evidence, PsfEstimate, PsfEstimator
from ..status import PsfStatus
from .agreement import SPREAD, alike_sets, area
from .alignment import Aligned
from .at import without_margins
from .candidates import isolated_things
from .cutout import Cutout
from .regular import are_equal, stand_in_rows

FEWEST = 3  # streaks that agree: two can be the two same letters of a sign
SURE = 0.95  # agreement of streaks whose PSF is good; those of one shake mostly agree to .98
CLIPPED = 0.2  # of the light of a streak in clipped pixels, above which it does not show its shape
# Nothing can be smaller than a point that is blurred: things below this share of the area of the
# PSF speak against it, if they are seen at least half as well. One in six streaks may be
# contradicted, by a dead pixel or a light that moved.
SMALLER, SEEN, MOST_STRANGE = 0.7, 0.5, 1 / 6
# Pixels of standard deviation along the longest direction: points with a half width of 2 pixels
# are what a good lens makes of a lamp or a star.
SHARPEST = 0.9
# Of the light above a quarter of the peak, what lies where a square of so many pixels fits in: a
# moving point draws a line. Out of focus it does not, but alike windows look like that, too.
THICK, MOST_THICK = 5, 0.5
# Pixels that a PSF covers, as a share of the square of its length: up to .37 for shakes of 7 pixels
# and more, .45 to .7 for the small round lamps of six photos that were sharp already.
ROUND = 0.4
NONE = (
    "no light streaks that agree were found; draw a box around one, or let the picture tell the PSF"
)
SHARP = (
    "the lights of the photo are points, hardly wider than a pixel: there is no blur to be found "
    "in them; let the picture tell the PSF"
)


@dataclass(frozen=True, slots=True)
class Streaks(PsfEstimator):
    """The PSF as the small lamps of a night photo show it, each of which leaves a streak.

    A point of light becomes the PSF itself (Hu, Cho, Wang and Yang 2014, Deblurring low-light
    images with light streaks). Small bright things that are alone on dark ground and do not
    clip are laid on each other; the greatest set that agrees, each with the mean of the others
    to a normalised correlation of .9, is explained by one PSF: ``light_i = a_i S_i k``, with
    the shift `S_i` and the power `a_i` of each lamp.

    Parameters
    ----------
    size : int, optional
        Longest side of a streak in pixels, odd, at least 3; found by itself if not given.
    """

    needs_picture: ClassVar[bool] = False  # of any part: few have three streaks

    size: int | None = None

    def __post_init__(self) -> None:
        if self.size is not None:
            arguments.odd(self.size, "PSF size")

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: find the streaks, and the PSF that they show.

        Raises
        ------
        CrfDeblurError
            Fewer than 3 streaks agree, or they are points.
        """
        yield Progress("light streaks", 0, 2)
        found = [
            (place, thing)
            for place, thing in isolated_things(evidence.picture, evidence.clipped, self.size)
            if thing.clipped <= CLIPPED
        ]
        things, places = [thing for _, thing in found], [place for place, _ in found]
        yield Progress("light streaks", 1, 2)
        sets = alike_sets(things, FEWEST)
        lamps = [own for own in sets if not _is_made(own[0], things, places)]
        if not lamps:
            raise CrfDeblurError(NONE)
        # Those of the smallest things come first: larger ones, such as windows, are blurred by it.
        first = next((own for own in lamps if _agreement(own[1]) >= SURE), lamps[0])
        yield Progress("light streaks", 2, 2)
        return _estimate(things, *first)


def _estimate(things: list[Cutout], members: list[int], aligned: Aligned) -> PsfEstimate:
    """The PSF of some of the things.

    Raises
    ------
    CrfDeblurError
        It cannot be one.
    """
    psf = without_margins(aligned.psf())
    if _spread(psf) < SHARPEST:
        raise CrfDeblurError(SHARP)
    smaller = _contradicting(things, members, area(psf))
    if smaller > MOST_STRANGE * len(members):
        raise CrfDeblurError(NONE)
    agreement = _agreement(aligned)
    thick, roundness = _thick(psf), _roundness(psf)
    good = agreement >= SURE and thick <= MOST_THICK and roundness <= ROUND
    status = PsfStatus.GOOD if good else PsfStatus.DOUBTFUL
    figures = {
        "streaks": float(len(members)),
        "things": float(len(things)),
        "smaller": float(smaller),
        "agreement": agreement,
        "thick": thick,
        "roundness": roundness,
    }
    return PsfEstimate(psf, status, figures)


def _agreement(aligned: Aligned) -> float:
    return float(np.median(aligned.agreement()))


def _spread(psf: FloatArray) -> float:
    """Standard deviation of a PSF along its longest direction, in pixels."""
    places = np.indices(psf.shape).reshape(2, -1)
    return float(np.sqrt(np.linalg.eigvalsh(np.cov(places, aweights=psf.ravel(), ddof=0))[-1]))


def _thick(psf: FloatArray) -> float:
    """Share of the light that is not in a line."""
    bright = psf >= psf.max() / 4
    broad = ndimage.binary_opening(np.pad(bright, THICK), np.ones((THICK, THICK)))
    inner = broad[THICK:-THICK, THICK:-THICK]
    return float(psf[inner].sum() / psf[bright].sum())


def _roundness(psf: FloatArray) -> float:
    """Pixels that the light covers, as a share of the square of its length."""
    places = np.nonzero(psf >= psf.max() / 10)
    length = max(int(np.ptp(axis)) + 1 for axis in places)
    return area(psf) / length**2


def _is_made(members: list[int], things: list[Cutout], places: list[FloatArray]) -> bool:
    """Whether some of the things are windows or letters: in rows, or equally bright."""
    if are_equal(np.array([things[i].light.sum() for i in members])):
        return True
    # Others of their row may agree less, and are not much larger.
    largest = SPREAD * float(np.median([area(things[i].light) for i in members]))
    near = [i for i, thing in enumerate(things) if area(thing.light) <= largest]
    others = [places[i] for i in near if i not in members]
    return stand_in_rows(
        np.array([places[i] for i in members]), np.array(others).reshape(len(others), 2)
    )


def _contradicting(things: list[Cutout], members: list[int], covered: float) -> int:
    """How many things are smaller than a PSF that covers so many pixels."""
    least = SEEN * float(np.median([things[i].signal for i in members]))
    others = [thing for i, thing in enumerate(things) if i not in members]
    seen = [thing for thing in others if thing.signal >= least]
    return sum(area(thing.light) < SMALLER * covered for thing in seen)
