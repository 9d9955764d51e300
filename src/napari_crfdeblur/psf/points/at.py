"""The PSF from one streak, point or bead that the user points to."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ... import arguments
from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...progress import Job, Progress
from ..base import Evidence, PsfEstimate, PsfEstimator, as_psf, centered
from ..shapes import LARGEST
from ..status import PsfStatus
from .cutout import SURE, Cutout, cut_out

# Another thing with this share of the light is a streak of its own; less is a reflection of the
# lens, or a faint lamp, and is left out.
SECOND = 0.3
CUT = 0.1  # of the peak: light on the border of a box, beyond which there is more
# Of the light of a streak in clipped pixels. Up to a fifth, the likeness to the streak that does
# not clip is .98; where half of it is lost, .87 for shakes.
CLIPPED, LOST = 0.01, 0.5
WEAK = 20.0  # signal to noise below which the noise is a twentieth of the PSF
SMALLEST_BOX = 7  # pixels: a point, and ground around it


@dataclass(frozen=True, slots=True)
class PsfAt(PsfEstimator):
    """The PSF as the streak of one lamp shows it, one star, or one bead, in a box around it.

    A point of light becomes the PSF itself (Hu, Cho, Wang and Yang 2014, Deblurring low-light
    images with light streaks). A plane fitted to the rim of the box is taken away as the ground;
    what hangs together above the noise is the streak, and anything else in the box is left out.

    Parameters
    ----------
    row, column : float
        Middle of the box in pixels of the picture.
    size : int
        Side of the box in pixels, odd, at least 7: a little more than the streak, so that ground
        is seen around it.
    """

    needs_picture: ClassVar[bool] = False  # of any part: it knows of one place only

    row: float
    column: float
    size: int

    def __post_init__(self) -> None:
        for name in ("row", "column"):
            arguments.number(getattr(self, name), f"a {name} in pixels", least=0)
        check_box(self.size)

    def run(self, evidence: Evidence) -> Job[PsfEstimate]:
        """Long job: cut the streak out.

        Raises
        ------
        CrfDeblurError
            The box reaches beyond the picture, has no streak, several of them, or a part of one,
            or the streak is clipped.
        """
        yield Progress("PSF in a box", 0, 1)
        thing = thing_at(evidence, (self.row, self.column), self.size)
        check_thing(thing)
        figures = {"signal": min(thing.signal, 1e9), "clipped": thing.clipped}
        good = thing.clipped <= CLIPPED and thing.signal >= WEAK
        status = PsfStatus.GOOD if good else PsfStatus.DOUBTFUL
        return PsfEstimate(centered(without_margins(thing.light)), status, figures)


def check_box(size: int) -> None:
    """Refuse what is no side of a box."""
    arguments.odd(size, "size of a box", most=LARGEST)
    arguments.whole(size, "a size of a box", least=SMALLEST_BOX)


def thing_at(evidence: Evidence, place: tuple[float, float], size: int) -> Cutout:
    """What is in a box of a picture.

    Raises
    ------
    CrfDeblurError
        It reaches beyond the picture.
    """
    linear, clipped = evidence.picture, evidence.clipped
    box = tuple(slice(round(at) - size // 2, round(at) + size // 2 + 1) for at in place)
    sides = linear.shape[:2]
    if any(own.start < 0 or own.stop > side for own, side in zip(box, sides, strict=True)):
        raise CrfDeblurError(
            f"a box of {size} pixels around row {place[0]:g}, column {place[1]:g} reaches beyond "
            f"the picture of {sides[1]} x {sides[0]} pixels; choose a smaller box, or a streak "
            "farther inside"
        )
    return cut_out(linear[box], None if clipped is None else clipped[box])


def check_thing(thing: Cutout) -> None:
    """Refuse what is no single streak.

    Raises
    ------
    CrfDeblurError
        Nothing stands out, or several things do; the box cuts it; it is clipped.
    """
    if thing.peak < SURE or not thing.inside.any():
        raise CrfDeblurError(
            "nothing stands out of the noise in the box; draw it around a bright streak or point "
            "on dark ground"
        )
    if thing.cut > CUT:
        raise CrfDeblurError(
            "the streak reaches the border of the box; choose a larger box, with dark ground all "
            "around the streak"
        )
    if thing.second > SECOND:
        raise CrfDeblurError(
            "there are several streaks in the box; choose a smaller box, or a streak that is alone"
        )
    if thing.clipped > LOST:
        raise CrfDeblurError(
            f"{thing.clipped:.0%} of the light of the streak is clipped, so that its shape is "
            "lost; choose a fainter streak"
        )


def without_margins(light: FloatArray) -> FloatArray:
    """The PSF without the empty rows and columns that are all around it alike."""
    places = np.argwhere(light > 1e-4 * light.max())  # what the last rounds of a fit leave
    middle = np.array(light.shape) // 2
    down, right = np.abs(places - middle).max(axis=0)
    rows, columns = (
        slice(max(at - reach, 0), at + reach + 1)
        for at, reach in zip(middle, (down, right), strict=True)
    )
    return as_psf(light[rows, columns])
