"""A photo at the scales at which blurred edges are found, located and judged."""

from dataclasses import dataclass
from math import ceil

import numpy as np

from .picture import Picture

FINE = 30.0  # width in pixels beyond which a transition is reduced to be judged
COARSE = 8.0  # the same, to be found
LEAST_COARSE = 6.0  # width from which on a coarse picture tells where an edge is
MOST_PIXELS = 3e6  # of the coarse picture: bounds the time spent on a sharp, large photo
NARROW = 8.0  # pixels of the fine picture: what is narrower is judged in the photo itself


@dataclass(frozen=True, slots=True, eq=False)
class Scales:
    """Pictures of one photo, each as small as its purpose permits.

    Parameters
    ----------
    photo : Picture
        The photo itself.
    fine : Picture
        In which edges are judged.
    coarse : Picture
        In which they are found.
    near : Picture
        In which they are located before they are judged.
    """

    photo: Picture
    fine: Picture
    coarse: Picture
    near: Picture

    @classmethod
    def to_find(cls, photo: Picture, blur_extent: float) -> "Scales":
        """What is needed to find edges of up to `blur_extent` pixels of the photo."""
        fine = fine_picture(photo, blur_extent)
        factor = round(reduction(photo.shape, blur_extent) / fine.step)
        coarse = fine.reduced(max(1, factor))
        clear = blur_extent >= LEAST_COARSE * coarse.step
        return cls(photo, fine, coarse, coarse if clear else fine)

    @classmethod
    def to_refine(cls, photo: Picture, blur_extent: float) -> "Scales":
        """What is needed to refine edges whose places are known."""
        fine = fine_picture(photo, blur_extent)
        return cls(photo, fine, fine, fine)


def fine_picture(photo: Picture, blur_extent: float) -> Picture:
    """The photo at the scale at which the widest transition takes up to :data:`FINE` pixels."""
    return photo.reduced(min(ceil(blur_extent / FINE), max(1, min(photo.shape) // 32)))


def reduction(shape: tuple[int, ...], blur_extent: float) -> int:
    """Whole factor by which a photo is reduced before edges are looked for."""
    by_blur = round(blur_extent / COARSE)
    by_size = int(np.ceil(np.sqrt(shape[0] * shape[1] / MOST_PIXELS)))
    return int(np.clip(max(by_blur, by_size), 1, max(1, min(shape) // 16)))
