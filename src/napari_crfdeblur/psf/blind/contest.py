"""Attempts to find one PSF in the photo made small, and the judge of what they find."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..._typing import BoolArray, FloatArray
from ...errors import CrfDeblurError
from ...progress import Job, Progress
from .l0_gradient import SCHEDULE as STEPS_ALONE
from .l0_gradient import searching
from .minimal_pixels import SCHEDULE as DARKEST
from .plausibility import Plausibility
from .pyramid import RATIO, level_sizes, recentered
from .size import extent_of, odd_size
from .small_photo import WIDEST, SmallPhoto, psf_scaled
from .turns import Schedule, turning

SCALED = 21  # pixels that a PSF has in the small photo in which it is searched
# Pixels that a PSF has where PSFs are compared, at least. Where light is known to be linear, finer
# is better (a street: .99 instead of .49); where it is not, coarser (12 photos: .78, not .77).
JUDGED, JUDGED_IN_THE_DARK = 21, 10
# PSFs in a side of a part of the photo that is enough to make them finer: 9 led astray where all of
# the photo, made smaller, did not; 20 did no harm.
NARROW = 12
RESOLVED = 6  # pixels of a PSF in a small photo: what is smaller there is seen in a larger one
UNRESOLVED = "the PSF is too small to be seen in the photo made small"
CLIMBING_ROOM = 2.0  # times the extent of the PSF that is made finer
TOO_SMALL = "the photo is too small for a PSF of this size; choose a smaller PSF size"


@dataclass(frozen=True, slots=True)
class Attempt:
    """One way to search.

    Parameters
    ----------
    times : float
        Extent of the PSF that is expected, in that found in the beginning.
    room : float
        Side of the array in PSFs.
    schedule : Schedule
        Of the turns.
    compressed : bool
        Whether light is compressed as in a photo as recorded, or linear.
    """

    times: float
    room: float
    schedule: Schedule
    compressed: bool


STRONGEST = replace(STEPS_ALONE, first=0.05)  # finds the largest blur, of which little else is seen
WEAKER = replace(STEPS_ALONE, first=0.004)  # finds what strong steps, such as lamps, mislead
# The best in the mean come first, among them a much larger PSF: the size found can be that of a
# dead end. More room lets a search out of one; neither light always wins.
ATTEMPTS = (
    Attempt(1, 2.25, DARKEST, compressed=True),
    Attempt(4, 1.5, STRONGEST, compressed=True),
    Attempt(1, 1.5, DARKEST, compressed=True),
    Attempt(2.25, 2.25, DARKEST, compressed=True),
    Attempt(1, 1.5, DARKEST, compressed=False),
    Attempt(0.5, 2.25, DARKEST, compressed=True),
    Attempt(1, 2.25, STEPS_ALONE, compressed=True),
    Attempt(2.25, 2.25, STEPS_ALONE, compressed=True),
    Attempt(1, 2.25, STEPS_ALONE, compressed=False),
    Attempt(1, 1.5, WEAKER, compressed=True),
)


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A PSF of a small photo.

    Parameters
    ----------
    psf : ndarray, shape (S, S)
    scale : float
        Sides of the small photo in those of the photo.
    """

    psf: FloatArray
    scale: float


@dataclass(frozen=True, slots=True, eq=False)
class Contest:
    """What searches look at, and the judge of what they find.

    Parameters
    ----------
    light : ndarray, shape (M, N) or (M, N, 3)
        Linear.
    clipped : ndarray of bool, shape (M, N), optional
    size : int
        Pixels of the PSF that is expected.
    lead : float
        Of plausibility, that what is found in the large photo has.
    scale : float
        At which PSFs are compared.
    judge : Plausibility
        In linear light, if it is known; otherwise in compressed light, in which lamps do not
        outweigh the rest. Clipped light does not count.
    made : dict of float to SmallPhoto
        Small photos by what was expected, since several attempts look at the same.
    """

    light: FloatArray
    clipped: BoolArray | None
    size: int
    lead: float
    scale: float
    judge: Plausibility
    made: dict[float, SmallPhoto] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        light: FloatArray,
        clipped: BoolArray | None,
        size: int,
        *,
        certain: bool,
        lead: float,
    ) -> "Contest":
        """For a photo in light that is linear, for certain or not, and PSFs of about `size` px."""
        lost = clipped
        if clipped is not None and clipped.ndim == 3:
            lost = np.asarray(clipped.any(axis=2))
        least = JUDGED if certain else JUDGED_IN_THE_DARK
        scale = min(1.0, max(least / size, WIDEST / max(light.shape)))
        extent = round(scale * size)
        small = SmallPhoto.of(light, lost, scale, extent)
        seen = small.in_light(compressed=not certain)
        return cls(light, lost, size, lead, scale, Plausibility.of(seen, extent))

    def searching(self, attempt: Attempt) -> Job[Found]:
        """Long job: a PSF and its scale.

        Raises
        ------
        CrfDeblurError
            The photo shows too little, or is too small for this attempt.
        """
        size = attempt.times * self.size
        scale = min(1.0, SCALED / size)
        if attempt.times not in self.made:
            extent = round(size * scale)
            self.made[attempt.times] = SmallPhoto.of(self.light, self.clipped, scale, extent)
        blurred = self.made[attempt.times].in_light(compressed=attempt.compressed)
        side = odd_size(attempt.room * size * scale, min(blurred.plane.shape) // 3)
        if side < size * scale:
            raise CrfDeblurError(TOO_SMALL)
        psf = yield from searching(blurred, side, attempt.schedule, WIDEST)
        if scale < 1 and extent_of(psf) < RESOLVED:
            raise CrfDeblurError(UNRESOLVED)
        return Found(psf, scale)

    def climbing(self, found: Found, attempt: Attempt) -> Job[Found]:
        """Long job: what an attempt has found, finer and finer, as far as the photo tells it.

        Where all of the photo would be too much, a part must be wide enough for this PSF.
        """
        longest, schedule = max(self.light.shape), attempt.schedule
        done = len(level_sizes(len(found.psf))) * schedule.steps
        while found.scale < 1:
            scale = min(1.0, found.scale / RATIO)
            extent = extent_of(found.psf) * scale / found.scale
            if min(scale * longest, NARROW * extent) > WIDEST:
                break
            rough = psf_scaled(found.psf, scale / found.scale)
            size = odd_size(CLIMBING_ROOM * extent, max(rough.shape))
            small = SmallPhoto.of(self.light, self.clipped, scale, size)
            blurred, at = small.in_light(compressed=attempt.compressed), Progress("finer PSF", 0, 1)
            psf = yield from turning(blurred, _cut(rough, size), size, schedule, done, at)
            found, done = Found(psf, scale), done + schedule.steps
        return found


def _cut(psf: FloatArray, size: int) -> FloatArray:
    """The middle of a PSF, `size` pixels on each side."""
    wide = np.pad(recentered(psf), [(max(size - side, 0) // 2,) * 2 for side in psf.shape])
    inside = [slice(side // 2 - size // 2, side // 2 + size // 2 + 1) for side in wide.shape]
    return np.asarray(wide[inside[0], inside[1]])
