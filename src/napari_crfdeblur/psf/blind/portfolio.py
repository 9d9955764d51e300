"""The PSF of any photo: several searches compete, as many as the photo asks for."""

from collections.abc import Mapping
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
from .confidence import diagnose, judge_agreement, judge_several
from .contest import ATTEMPTS, Attempt, Contest, Found
from .estimation import BlindEstimator, Light, check_sides
from .size import extent_of, odd_size
from .small_photo import psf_scaled
from .variational.method import refining
from .variational.method import searching as variational

AGREEING = 0.9  # similarity from which two searches have found the same
ALIKE = 0.8  # and up to which they have not: a finer search makes the same of what is between
# Attempts that are made at least, for PSFs of up to so many pixels, of which nearly all are found
# at once, and for larger ones. The second looks for a much larger PSF.
EASY, LEAST_ATTEMPTS, LEAST_OF_LARGE = 25, 2, 4
# Less plausible by so much, a PSF of a small photo can become the best when it is made finer:
# two of eighteen gained .04 and .06.
NEAR = 0.06
COARSE = 0.015  # by which what was only enlarged must be more plausible than what was made finer
# By which what a small photo shows must be more plausible than what the large one shows, where
# light is known to be linear, or the parts of the large one agree. Two of six photos of real
# cameras were led astray by .005 and .012 without it.
FINE = 0.03
TELLING = 0.03  # of plausibility: a candidate that is so much worse counts a third in agreement
FINALISTS = 2
LAST_SEARCH = 2 + len(ATTEMPTS)
JOBS = LAST_SEARCH + 1 + FINALISTS  # at most
LARGE = 15  # pixels: where a larger PSF is in doubt, one of half that size is searched, too
MISSED = 1.6  # times the size that fits the best: the first search is made again with that size
ROOM = 1.3  # times the extent seen at a small scale: the array of the refinement


@dataclass(frozen=True, slots=True, eq=False)
class Contender:
    """A PSF that competes.

    Parameters
    ----------
    found : Found
        The PSF and its scale.
    seen : ndarray, shape (S, S)
        The PSF at the scale at which they are compared.
    plausibility : float
        By :class:`~.plausibility.Plausibility`, and the lead of what the large photo shows.
    attempt : Attempt, optional
        How it was found.
    """

    found: Found
    seen: FloatArray
    plausibility: float
    attempt: Attempt | None = None

    @classmethod
    def of(cls, contest: Contest, found: Found, attempt: Attempt | None = None) -> "Contender":
        """Judge a PSF."""
        seen = psf_scaled(found.psf, contest.scale / found.scale)
        lead = contest.lead if attempt is None else 0.0
        return cls(found, seen, contest.judge.judge(seen) + lead, attempt)

    def is_like(self, other: "Contender", least: float) -> bool:
        """Whether both PSFs are similar, wherever they lie."""
        return kernel_similarity(self.seen, other.seen) >= least


@dataclass(frozen=True, slots=True)
class Portfolio(BlindEstimator):
    """The most plausible of the PSFs that several searches find.

    No search finds every PSF. First come the streaks of lamps (:class:`~..points.Streaks`), which
    are the PSF; then :class:`~.variational.method.Variational` in the part of the photo that tells
    most, and that is all where light is known to be linear and the parts of the picture agree.
    Otherwise half of the size is searched, too, if they do not agree, and the photo made small,
    after Xu, Zheng & Jia (2013) and Wen et al. (2021), in linear and in compressed light and with
    more room or less, until the most plausible PSF was found twice
    (:class:`~.plausibility.Plausibility`). One that was found in the small photo is refined in the
    large one.

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
        alone = light.growing(variational, size)
        first, size = yield from nth(alone, 0, JOBS, "PSF, search")
        figures = diagnose(light.around(size), first)
        agreed = judge_agreement(figures) is PsfStatus.GOOD
        if evidence.certain and agreed:
            yield Progress("PSF, search", JOBS, JOBS)
            return _estimate(first, PsfStatus.GOOD, figures)
        lead = FINE if evidence.certain or agreed else 0.0
        contest = Contest.of(seen, clipped, size, certain=evidence.certain, lead=lead)
        fine = {size: first}
        if not agreed and size > LARGE:
            narrow = odd_size(size / 2, light.largest)
            search = variational(light.around(narrow), narrow)
            fine[narrow] = yield from nth(search, 1, JOBS, "PSF, search")
        return (yield from _contested(light, contest, fine))


def _contested(light: Light, contest: Contest, fine: Mapping[int, FloatArray]) -> Job[PsfEstimate]:
    """Long job: the most plausible of the PSFs that several searches find, made finer.

    Parameters
    ----------
    light : Light
    contest : Contest
    fine : mapping of int to ndarray
        PSFs found in the large photo, by the size that was looked for.
    """
    contenders, finer = (yield from _competing(light, contest, fine)), []
    for number, finalist in enumerate(_finalists(contenders)):
        job = _refined(light, contest, finalist)
        finer += yield from nth(job, LAST_SEARCH + 1 + number, JOBS, "PSF, search")
    best = _best(finer)
    psf = best.found.psf
    yield Progress("PSF, search", JOBS, JOBS)
    figures = diagnose(light.around(len(psf)), psf) | _told_by(best, contenders)
    return _estimate(psf, judge_several(figures), figures)


def _estimate(psf: FloatArray, status: PsfStatus, figures: dict[str, float]) -> PsfEstimate:
    return PsfEstimate(centered(np.asarray(psf, np.float64)), status, figures)


def _streaks(evidence: Evidence, size: int | None) -> Job[PsfEstimate | None]:
    """Job: what the streaks of lamps show clearly, if there are any."""
    try:
        found = yield from Streaks(size).run(evidence)
    except CrfDeblurError:  # most photos have none
        return None
    return found if found.status is PsfStatus.GOOD else None


def _competing(
    light: Light, contest: Contest, fine: Mapping[int, FloatArray]
) -> Job[list[Contender]]:
    """Long job: PSFs of several searches, until the best was found twice."""
    contenders = [Contender.of(contest, Found(psf, 1.0)) for psf in fine.values()]
    for number, attempt in enumerate(ATTEMPTS, 2):
        try:
            search = contest.searching(attempt)
            found = yield from nth(search, number, JOBS, "PSF, search")
        except CrfDeblurError:  # another attempt may see more
            continue
        contenders.append(Contender.of(contest, found, attempt))
        if _found_twice(contest, contenders):
            break
    fitting = odd_size(ROOM * extent_of(_best(contenders).seen) / contest.scale, light.largest)
    if all(max(fitting / size, size / fitting) > MISSED for size in fine):
        job = variational(light.around(fitting), fitting)
        psf = yield from nth(job, LAST_SEARCH, JOBS, "PSF, search")
        contenders.append(Contender.of(contest, Found(psf, 1.0)))
    return contenders


def _found_twice(contest: Contest, contenders: list[Contender]) -> bool:
    """Whether another search has found the same as the best; other sizes must have been tried."""
    best = _best(contenders)
    attempts = sum(own.attempt is not None for own in contenders)
    extent = extent_of(best.seen) / contest.scale
    least = LEAST_ATTEMPTS if extent <= EASY else LEAST_OF_LARGE
    others = [own for own in contenders if own is not best]
    return attempts >= least and any(best.is_like(own, AGREEING) for own in others)


def _finalists(contenders: list[Contender]) -> list[Contender]:
    """The most plausible contender, and the next that is another one but hardly less plausible.

    Where a search in the large photo has found nearly the same, its PSF is taken: it is finer; and
    if the best was found twice, it alone.
    """
    best = _best(contenders)
    fine = [own for own in contenders if own.attempt is None and best.is_like(own, ALIKE)]
    if fine and any(best.is_like(own, AGREEING) for own in contenders if own is not best):
        return [_best(fine)]
    rivals = [own for own in contenders if not best.is_like(own, ALIKE)]
    near = [own for own in rivals if own.plausibility >= best.plausibility - NEAR]
    return [_best(fine or [best]), *([_best(near)] if near else [])]


def _best(contenders: list[Contender]) -> Contender:
    return max(contenders, key=lambda own: own.plausibility)


def _refined(light: Light, contest: Contest, rough: Contender) -> Job[list[Contender]]:
    """Long job: a PSF of a small photo in the large one, in several ways."""
    if rough.attempt is None:
        return [rough]
    found = yield from contest.climbing(rough.found, rough.attempt)
    enlarged, climbed = (
        Found(psf_scaled(own.psf, 1 / own.scale), 1.0) for own in (rough.found, found)
    )
    size = odd_size(ROOM * extent_of(climbed.psf), light.largest)
    fine = Found((yield from refining(light.around(size), climbed.psf, size)), 1.0)
    made = [Contender.of(contest, own, rough.attempt) for own in (enlarged, climbed, fine)]
    made[0] = replace(made[0], plausibility=made[0].plausibility - COARSE)
    return made


def _told_by(best: Contender, contenders: list[Contender]) -> dict[str, float]:
    """What the other contenders say of the best one.

    ``agreement``: the mean similarity to the others, in which the more plausible count more.
    ``margin``: how much more plausible it is than those that are others, at most 1.
    """
    others = [own for own in contenders if own.found is not best.found]
    if best.attempt is not None:  # what it was made finer of says nothing
        others = [own for own in others if own.attempt is not best.attempt]
    if not others:
        return {"agreement": 0.0, "margin": 0.0}
    likeness = np.array([kernel_similarity(best.seen, own.seen) for own in others])
    plausibility = np.array([own.plausibility for own in others])
    weights = np.exp((plausibility - plausibility.max()) / TELLING)
    rivals = plausibility[likeness < ALIKE]
    return {
        "agreement": float(np.average(likeness, weights=weights)),
        "margin": float(best.plausibility - rivals.max()) if len(rivals) else 1.0,
    }
