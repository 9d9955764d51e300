"""Several searches for one PSF, from different starts in small pictures of one scale."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from ..._typing import BoolArray, FloatArray
from ...errors import CrfDeblurError
from ...progress import Job, Progress
from .blurred import Blurred
from .colors import gray_of
from .l0_gradient import SCHEDULE as STEPS_ALONE
from .l0_gradient import searching
from .minimal_pixels import SCHEDULE as DARKEST
from .overview import Overview
from .plausibility import Plausibility
from .pyramid import RATIO, level_sizes, recentered, scaled
from .size import extent_of, odd_size
from .turns import Schedule, turning

SCALED = 21  # pixels that a PSF has in the small photo in which it is searched, and
JUDGED = 10  # in the one in which PSFs are compared, at least
WIDEST = 512  # pixels of a side of a small photo, at most, or three PSFs
# PSFs in a side of a part of the photo that is enough to make them finer: 9 led astray where all of
# the photo, made smaller, did not; 20 did no harm.
NARROW = 12
RESOLVED = 6  # pixels of a PSF in a small photo: what is smaller there is seen in a larger one
UNRESOLVED = "the PSF is too small to be seen in the photo made small"
CLIMBING_ROOM = 2.0  # times the extent of the PSF that is made finer
TOO_SMALL = "the photo is too small for a PSF of this size; choose a smaller PSF size"
LEAST_LOST = 0.02  # of a pixel of a small photo that was clipped
COMPRESSED = np.float32(1 / 2.2)  # power of light: dark places count as in a photo as recorded


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
class SmallPhoto:
    """A photo made small, in two lights: all of it, or the square that tells most.

    Parameters
    ----------
    scale : float
        Its sides in those of the photo, at most 1.
    linear, compressed : Blurred
        In linear and in compressed light.
    """

    scale: float
    linear: Blurred
    compressed: Blurred

    @classmethod
    def of(
        cls, light: FloatArray, clipped: BoolArray | None, scale: float, size: int
    ) -> "SmallPhoto":
        """Of linear light (M, N) or (M, N, 3), for PSFs of about `size` pixels at this scale."""
        small, lost = _told_most(*_made_small(light, clipped, scale), size)
        compressed = np.maximum(small, 0) ** COMPRESSED
        return cls(scale, _blurred(small, lost, size), _blurred(compressed, lost, size))


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
    scale : float
        At which PSFs are compared.
    judge : Plausibility
        In compressed light, in which lamps do not outweigh the rest; clipped light does not count.
    """

    light: FloatArray
    clipped: BoolArray | None
    size: int
    scale: float
    judge: Plausibility

    @classmethod
    def of(cls, light: FloatArray, clipped: BoolArray | None, size: int) -> "Contest":
        """For a photo in linear light, and PSFs of about `size` pixels."""
        lost = clipped
        if clipped is not None and clipped.ndim == 3:
            lost = np.asarray(clipped.any(axis=2))
        scale = min(1.0, max(JUDGED / size, WIDEST / max(light.shape)))
        extent = round(scale * size)
        seen = SmallPhoto.of(light, lost, scale, extent)
        return cls(light, lost, size, scale, Plausibility.of(seen.compressed, extent))

    def searching(self, attempt: Attempt) -> Job[Found]:
        """Long job: a PSF and its scale.

        Raises
        ------
        CrfDeblurError
            The photo shows too little, or is too small for this attempt.
        """
        size = attempt.times * self.size
        scale = min(1.0, SCALED / size)
        small = SmallPhoto.of(self.light, self.clipped, scale, round(size * scale))
        blurred = small.compressed if attempt.compressed else small.linear
        side = odd_size(attempt.room * size * scale, min(blurred.plane.shape) // 3)
        if side < size * scale:
            raise CrfDeblurError(TOO_SMALL)
        psf = yield from searching(Blurred(blurred.plane), side, attempt.schedule, WIDEST)
        if scale < 1 and extent_of(psf) < RESOLVED:
            raise CrfDeblurError(UNRESOLVED)
        return Found(psf, scale)

    def climbing(self, found: Found, attempt: Attempt) -> Job[Found]:
        """Long job: what an attempt has found, finer and finer, as far as the photo tells it.

        Where all of the photo would be too much, a part must be wide enough for this PSF.
        """
        done, longest = (
            len(level_sizes(len(found.psf))) * attempt.schedule.steps,
            max(self.light.shape),
        )
        while found.scale < 1:
            scale = min(1.0, found.scale / RATIO)
            extent = extent_of(found.psf) * scale / found.scale
            if min(scale * longest, NARROW * extent) > WIDEST:
                break
            rough = psf_scaled(found.psf, scale / found.scale)
            size = odd_size(CLIMBING_ROOM * extent, max(rough.shape))
            small = SmallPhoto.of(self.light, self.clipped, scale, size)
            blurred = small.compressed if attempt.compressed else small.linear
            at = Progress("finer PSF", 0, 1)
            psf = yield from turning(
                Blurred(blurred.plane), _cut(rough, size), size, attempt.schedule, done, at
            )
            found, done = Found(psf, scale), done + attempt.schedule.steps
        return found


def _made_small(
    light: FloatArray, clipped: BoolArray | None, scale: float
) -> tuple[FloatArray, BoolArray | None]:
    """Light, and where any of it was clipped, at a scale."""
    if scale == 1:
        return light, clipped
    planes = light[..., None] if light.ndim == 2 else light
    small = np.stack([scaled(planes[..., c], scale) for c in range(planes.shape[2])], axis=2)
    lost = None
    if clipped is not None:
        lost = scaled(clipped.astype(np.float32), scale) > LEAST_LOST
    return small.reshape(*small.shape[:2], *light.shape[2:]), lost


def _told_most(
    light: FloatArray, clipped: BoolArray | None, size: int
) -> tuple[FloatArray, BoolArray | None]:
    """The square of at most `WIDEST` pixels that tells most of a PSF."""
    overview = Overview.of(gray_of(light)[0], clipped)
    part = overview.informative_region(max(WIDEST, 3 * size), size)
    return light[part], None if clipped is None else clipped[part]


def _blurred(light: FloatArray, clipped: BoolArray | None, size: int) -> Blurred:
    gray, _ = gray_of(light)
    return Blurred.of(gray, clipped, size)


def _cut(psf: FloatArray, size: int) -> FloatArray:
    """The middle of a PSF, `size` pixels on each side."""
    wide = np.pad(recentered(psf), [(max(size - side, 0) // 2,) * 2 for side in psf.shape])
    inside = [slice(side // 2 - size // 2, side // 2 + size // 2 + 1) for side in wide.shape]
    return np.asarray(wide[inside[0], inside[1]])


def psf_scaled(psf: FloatArray, scale: float) -> FloatArray:
    """A PSF as it is in a picture of other sides; sum 1, odd sides, its center in place."""
    if scale == 1:
        return psf
    softness = max(1 / scale - 1, 0) / 2
    wide = np.pad(psf, int(np.ceil(4 * softness)) + 1)
    sides = [int(np.ceil(side * scale)) // 2 * 2 + 1 for side in wide.shape]
    middle = [(old // 2) - (new // 2) / scale for old, new in zip(wide.shape, sides, strict=True)]
    soft = ndimage.gaussian_filter(wide, softness)
    resampled = ndimage.affine_transform(
        soft, np.full(2, 1 / scale), middle, output_shape=tuple(sides), order=1
    )
    return np.asarray(resampled / resampled.sum())
