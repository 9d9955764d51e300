"""The PSF of any photo: several searches compete, as many as the photo asks for."""

from dataclasses import dataclass, replace

import numpy as np

from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...progress import Job, Progress, nth
from ...quality import kernel_similarity
from ..base import Evidence, PsfEstimate, centered
from ..points import Streaks
from ..status import PsfStatus
from .colors import gray_of
from .confidence import diagnose, judge_several
from .contest import STARTS, Contest, Found, Start, psf_scaled
from .estimation import BlindEstimator, Light, check_sides
from .size import extent_of, odd_size
from .variational.method import refining
from .variational.method import searching as variational

AGREEING = 0.9  # similarity from which two searches have found the same
ALIKE = 0.8  # and up to which they have not: a finer search makes the same of what is between
# Starts, besides the first search, that are made at least: for PSFs of up to so many pixels, of
# which nearly all are found at once, and for larger ones. The second looks for a much larger PSF.
EASY, LEAST_STARTS, LEAST_OF_LARGE = 25, 2, 4
# Less plausible by so much, a PSF of a small photo can become the best when it is made finer:
# two of eighteen gained .04 and .06.
NEAR = 0.06
COARSE = 0.015  # by which what was only enlarged must be more plausible than what was made finer
TELLING = 0.03  # of plausibility: a candidate that is so much worse counts a third in agreement
FINALISTS = 2
LAST_SEARCH = 1 + len(STARTS)
JOBS = LAST_SEARCH + FINALISTS  # at most
ROOM = 1.3  # times the extent seen at a small scale: the array of the refinement


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A PSF that competes.

    Parameters
    ----------
    found : Found
        The PSF and its scale.
    seen : ndarray, shape (S, S)
        The PSF at the scale at which they are compared.
    plausibility : float
        By :class:`~.plausibility.Plausibility`.
    start : Start, optional
        How it was found.
    """

    found: Found
    seen: FloatArray
    plausibility: float
    start: Start | None = None

    @classmethod
    def of(cls, contest: Contest, found: Found, start: Start | None = None) -> "Candidate":
        """Judge a PSF."""
        seen = psf_scaled(found.psf, contest.scale / found.scale)
        return cls(found, seen, contest.judge.judge(seen), start)

    def is_like(self, other: "Candidate", least: float) -> bool:
        """Whether both PSFs are similar, wherever they lie."""
        return kernel_similarity(self.seen, other.seen) >= least


@dataclass(frozen=True, slots=True)
class Portfolio(BlindEstimator):
    """The most plausible of the PSFs that several searches find.

    No search finds every PSF. First come the streaks of lamps (:class:`~..points.Streaks`), which
    are the PSF; then :class:`~.variational.method.Variational` in the part of the photo that tells
    most; then searches in the photo made small, after Xu, Zheng & Jia (2013) and Wen et al. (2021),
    in linear and in compressed light and with more room or less, until the most plausible PSF was
    found twice (:class:`~.plausibility.Plausibility`). One that was found in the small photo is
    refined in the large one.

    Parameters
    ----------
    size, region : int
        As of :class:`~.variational.method.Variational`. Searches look for PSFs of up to two sizes.
    """

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: estimate the PSF of a linear image."""
        seen, clipped = evidence.picture, evidence.clipped
        check_sides(seen, self.size or 3)
        yield Progress("blind PSF", 0, 1)
        streaks = yield from _streaks(evidence, self.size)
        if streaks is not None:
            return streaks
        light = Light.of(*gray_of(seen, clipped), self.region)
        size = self.size or (yield from light.sizing())
        contest = Contest.of(seen, clipped, size)
        candidates = yield from _competing(light, contest, size)
        finer = []
        for number, finalist in enumerate(_finalists(candidates)):
            job = _refined(light, contest, finalist)
            finer += yield from nth(job, LAST_SEARCH + number, JOBS, "PSF, search")
        best = _best(finer)
        psf = best.found.psf
        yield Progress("PSF, search", JOBS, JOBS)
        figures = diagnose(light.around(len(psf)), psf) | _told_by(best, candidates)
        return PsfEstimate(centered(np.asarray(psf, np.float64)), judge_several(figures), figures)


def _streaks(evidence: Evidence, size: int | None) -> Job[PsfEstimate | None]:
    """Job: what the streaks of lamps show clearly, if there are any."""
    try:
        found = yield from Streaks(size).run(evidence)
    except CrfDeblurError:  # most photos have none
        return None
    return found if found.status is PsfStatus.GOOD else None


def _competing(light: Light, contest: Contest, size: int) -> Job[list[Candidate]]:
    """Long job: PSFs of several searches, until the best was found twice."""
    job = variational(light.around(size), size)
    psf = yield from nth(job, 0, JOBS, "PSF, search")
    candidates = [Candidate.of(contest, Found(psf, 1.0))]
    for number, start in enumerate(STARTS, 1):
        try:
            search = contest.searching(start)
            found = yield from nth(search, number, JOBS, "PSF, search")
        except CrfDeblurError:  # another start may see more
            continue
        candidates.append(Candidate.of(contest, found, start))
        if _found_twice(contest, candidates):
            break
    return candidates


def _found_twice(contest: Contest, candidates: list[Candidate]) -> bool:
    """Whether another search has found the same as the best; other sizes must have been tried."""
    best = _best(candidates)
    others = [own for own in candidates if own is not best]
    extent = extent_of(best.seen) / contest.scale
    least = LEAST_STARTS if extent <= EASY else LEAST_OF_LARGE
    return len(others) >= least and any(best.is_like(own, AGREEING) for own in others)


def _finalists(candidates: list[Candidate]) -> list[Candidate]:
    """The most plausible candidate, and the next that is another one but hardly less plausible."""
    best = _best(candidates)
    rivals = [own for own in candidates if not best.is_like(own, ALIKE)]
    near = [own for own in rivals if own.plausibility >= best.plausibility - NEAR]
    return [best, *([_best(near)] if near else [])]


def _best(candidates: list[Candidate]) -> Candidate:
    return max(candidates, key=lambda own: own.plausibility)


def _refined(light: Light, contest: Contest, rough: Candidate) -> Job[list[Candidate]]:
    """Long job: a PSF of a small photo in the large one, in several ways."""
    if rough.start is None:
        return [rough]
    found = yield from contest.climbing(rough.found, rough.start)
    enlarged, climbed = (
        Found(psf_scaled(own.psf, 1 / own.scale), 1.0) for own in (rough.found, found)
    )
    size = odd_size(ROOM * extent_of(climbed.psf), light.largest)
    fine = Found((yield from refining(light.around(size), climbed.psf, size)), 1.0)
    made = [Candidate.of(contest, own, rough.start) for own in (enlarged, climbed, fine)]
    made[0] = replace(made[0], plausibility=made[0].plausibility - COARSE)
    return made


def _told_by(best: Candidate, candidates: list[Candidate]) -> dict[str, float]:
    """What the other candidates say of the best one.

    ``agreement``: the mean similarity to the others, in which the more plausible count more.
    ``margin``: how much more plausible it is than those that are others, at most 1.
    """
    others = [own for own in candidates if own.found is not best.found]
    likeness = np.array([kernel_similarity(best.seen, own.seen) for own in others])
    plausibility = np.array([own.plausibility for own in others])
    weights = np.exp((plausibility - plausibility.max()) / TELLING)
    rivals = plausibility[likeness < ALIKE]
    return {
        "agreement": float(np.average(likeness, weights=weights)),
        "margin": float(best.plausibility - rivals.max()) if len(rivals) else 1.0,
    }
