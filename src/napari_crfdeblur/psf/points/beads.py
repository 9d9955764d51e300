"""The PSF of a microscope from several beads that the user points to."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ... import arguments
from ...progress import Job, Progress
from ..base import Evidence, PsfEstimate, PsfEstimator
from ..status import PsfStatus
from .alignment import Aligned
from .at import CUT, LOST, SECOND, check_box, check_thing, thing_at, without_margins
from .cutout import SURE, Cutout

STRANGE = 0.05  # below the usual agreement: another bead shines into the box, or it is no bead
AGREEING = 0.9  # normalised correlation with the mean of the others that is enough in any case
FEWEST = 2  # beads that confirm each other


@dataclass(frozen=True, slots=True)
class Beads(PsfEstimator):
    """The mean of what several beads, stars or streaks show of the PSF.

    Each is cut out as by :class:`PsfAt`, and moved so that it fits the mean of all to a fraction
    of a pixel. Beads that overlap others, are clipped or reach the border of their box are left
    out, and so are those that do not agree with the rest. One PSF is fitted to what remains:
    ``light_i = a_i S_i k``, with the shift `S_i` and the power `a_i` of each bead (as for the
    star images of Anderson and King 2000, Toward high-precision astrometry with WFPC2).

    Parameters
    ----------
    places : sequence of (row, column)
        Middles of the beads in pixels of the picture, one or more.
    size : int
        Side of the box around each in pixels, odd, at least 7.
    """

    needs_picture: ClassVar[bool] = False  # of any part: it knows of some places only

    places: tuple[tuple[float, float], ...]
    size: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "places", as_places(self.places, "places (row, column)"))
        for place in self.places:
            arguments.numbers(place, "a place (row, column)", count=2, least=0)
        if not self.places:
            raise arguments.refusal("at least one place", self.places)
        check_box(self.size)

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: cut the beads out, and fit one PSF to them.

        Raises
        ------
        CrfDeblurError
            A box reaches beyond the picture, or no bead can be used.
        """
        total = len(self.places)
        things = []
        for done, place in enumerate(self.places):
            yield Progress("beads", done, total)
            things.append(thing_at(evidence, place, self.size))
        usable = [thing for thing in things if _is_usable(thing)]
        if not usable:
            check_thing(max(things, key=lambda thing: thing.peak))
        aligned = _agreeing(Aligned.of(usable))
        yield Progress("beads", total, total)
        count = len(aligned.light)
        fits = aligned.agreement()
        good = count >= FEWEST and float(np.median(fits)) >= AGREEING - STRANGE
        figures = {
            "beads": float(count),
            "left_out": float(total - count),
            "agreement": float(np.median(fits)) if count > 1 else 0.0,
        }
        status = PsfStatus.GOOD if good else PsfStatus.DOUBTFUL
        return PsfEstimate(without_margins(aligned.psf()), status, figures)


def as_places(values: Sequence[Sequence[float]], what: str) -> tuple[tuple[float, float], ...]:
    """Pairs of numbers as tuples of floats."""
    if isinstance(values, np.ndarray):
        values = values.tolist()
    arguments.instances(values, (Sequence, np.ndarray), what)
    found = (arguments.numbers(value, what, count=2) for value in values)
    return tuple((first, second) for first, second in found)


def _is_usable(thing: Cutout) -> bool:
    """Whether it is one bead, whole, and not clipped."""
    whole = thing.cut <= CUT and thing.second <= SECOND and thing.clipped <= LOST
    return thing.peak >= SURE and bool(thing.inside.any()) and whole


def _agreeing(aligned: Aligned) -> Aligned:
    """Without those that are unlike the others, the strangest first."""
    aligned = aligned.refined()
    while len(aligned.light) > FEWEST:
        fits = aligned.agreement()
        worst = int(fits.argmin())
        if fits[worst] >= min(AGREEING, float(np.median(fits)) - STRANGE):
            break
        aligned = aligned.chosen([i for i in range(len(fits)) if i != worst]).refined()
    return aligned
