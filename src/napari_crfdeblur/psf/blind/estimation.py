"""The steps that every blind estimator shares: from a photo to what it searches, and back."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ... import arguments
from ..._typing import BoolArray, FloatArray
from ...errors import CrfDeblurError
from ...progress import Job, Progress
from ..base import Evidence, PsfEstimate, PsfEstimator, centered
from .blurred import Blurred
from .colors import gray_of
from .confidence import diagnose, judge_agreement
from .overview import Overview
from .search import Search
from .size import finding_size, is_cut, odd_size
from .two_phases import searching

NARROW = 10  # sizes of the PSF: a region that is wide enough to judge its size
GROWTH = 1.5  # of an array that has cut the PSF
TRIES = 3  # arrays at most


@dataclass(frozen=True, slots=True)
class BlindEstimator(PsfEstimator):
    """A method that finds a PSF in the blurred picture alone.

    Parameters
    ----------
    size : int, optional
        Largest extent of the PSF in pixels, odd, at least 3; found by itself if not given.
    region : int
        Longest side in pixels of the part of the picture that is used, or three PSF sizes if
        that is more (:class:`~.overview.Overview`).
    """

    size: int | None = None
    region: int = 512

    def __post_init__(self) -> None:
        if self.size is not None:
            arguments.odd(self.size, "PSF size")
        arguments.whole(self.region, "a region in pixels", least=1)


@dataclass(frozen=True, slots=True)
class SingleSearch(BlindEstimator):
    """A blind estimator that searches once, in all of the picture or in its best part."""

    sees_whole: ClassVar[bool] = False
    """Whether the search is given all of the picture, of which it takes what it needs."""

    @abstractmethod
    def searching(self, blurred: Blurred, size: int) -> Job[FloatArray]:
        """Long job, the method proper: a PSF of about `size` x `size` pixels."""

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: estimate the PSF of a linear image."""
        picture = evidence.picture
        return (
            yield from estimating_blindly(
                picture,
                evidence.clipped,
                self.searching,
                size=self.size,
                region=max(picture.shape) if self.sees_whole else self.region,
            )
        )


def estimating_blindly(
    linear: FloatArray,
    clipped: BoolArray | None,
    search: Search,
    *,
    size: int | None,
    region: int,
) -> Job[PsfEstimate]:
    """Long job: find a PSF with `search`, and everything around it.

    Color becomes the gray of greatest contrast (:func:`~.colors.gray_of`); of a large photo the
    most informative square is searched (:class:`~.overview.Overview`), but not what
    lies near clipped pixels (:class:`~.blurred.Blurred`); the PSF is centered, and judged by
    whether parts of the picture agree on it (:func:`~.confidence.diagnose`).

    Parameters
    ----------
    linear : ndarray, shape (M, N) or (M, N, 3)
        Relative irradiance.
    clipped : ndarray of bool, the shape of `linear`, optional
        Pixels that the camera saturated.
    search : callable
        ``search(blurred, size)``, the method proper, is a job that gives a PSF of `size` x
        `size` pixels.
    size : int, optional
        Largest extent of the PSF in pixels, odd; found by itself if not given.
    region : int
        Longest side in pixels of the part that is searched.

    Raises
    ------
    CrfDeblurError
        Too little structure, or a photo smaller than three PSFs.
    """
    check_sides(linear, size or 3)
    yield Progress("blind PSF", 0, 1)
    light = Light.of(*gray_of(linear, clipped), region)
    if size is None:
        psf, size = yield from light.growing(search, (yield from light.sizing()))
    else:
        psf = yield from search(light.around(size), size)
    figures = diagnose(light.around(size), psf)
    return PsfEstimate(centered(np.asarray(psf, np.float64)), judge_agreement(figures), figures)


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """A plane, its clipped pixels, the whole made small, and the longest side of a region."""

    gray: FloatArray
    clipped: BoolArray | None
    overview: Overview
    region: int

    @classmethod
    def of(cls, gray: FloatArray, clipped: BoolArray | None, region: int) -> "Light":
        """Of a plane, and the longest side of a region of it."""
        return cls(gray, clipped, Overview.of(gray, clipped), region)

    def around(self, size: int, widest: int | None = None) -> Blurred:
        """What a PSF of so many pixels is searched in."""
        side = max(min(self.region, widest or self.region), 3 * size)
        part = self.overview.informative_region(side, size)
        clipped = None if self.clipped is None else self.clipped[part]
        return Blurred.of(self.gray[part], clipped, size)

    @property
    def largest(self) -> int:
        """The largest PSF that can be looked for."""
        return int(min(self.gray.shape)) // 3

    def sizing(self) -> Job[int]:
        """Long job: a size with some room for the PSF, by one fast method."""
        return finding_size(lambda size: self.around(size, NARROW * size), searching, self.largest)

    def growing(self, search: Search, size: int) -> Job[tuple[FloatArray, int]]:
        """Long job: a PSF, and the size at which it fits: that given, or a larger one."""
        psf = yield from search(self.around(size), size)
        for _ in range(TRIES - 1):
            larger = odd_size(GROWTH * size, self.largest)
            if not is_cut(psf) or larger <= size:
                break
            size = larger
            psf = yield from search(self.around(size), size)
        return psf, size


def check_sides(linear: FloatArray, size: int) -> None:
    """Refuse a photo that is smaller than three PSFs of a size."""
    if min(linear.shape[:2]) < 3 * size:
        raise CrfDeblurError(
            f"the image, {linear.shape[1]} x {linear.shape[0]} pixels, is too small to find a "
            f"PSF of {size} pixels in it: three times the PSF is needed; choose a smaller PSF "
            "size or a larger image"
        )
