"""How far the restoration of a large photo swings beyond what is possible, from samples."""

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from .._typing import Image
from ..deconvolution import Swing, swing_of
from ..pipeline.intermediates import made
from ..psf import PsfField
from ..psf.misfit import evenly
from .recipe import Recipe, psf_shape
from .sources import Source

if TYPE_CHECKING:
    from dask.array import Array

SAMPLES = 8  # parts that are restored: the swing of one PSF is much alike everywhere
SIDE = {2: 256, 3: 48}  # of a part, in pixels, by the axes of the PSF
PSFS = 6  # or as many of its sides


def measure_swing(photo: "Source | Image | Array", recipe: Recipe) -> Swing:
    """The swing of some parts, restored as the whole will be, spread evenly over it.

    Parameters
    ----------
    photo : Source, ndarray or dask array, shape (..., M, N) or (..., M, N, C)
    recipe : Recipe
        Of the whole; its own swing does not matter.
    """
    sides = psf_shape(recipe.psf)
    shape = tuple(photo.shape[: len(photo.shape) - recipe.color])
    lead, inner = shape[: len(shape) - len(sides)], shape[len(shape) - len(sides) :]
    lengths = [
        min(n, max(SIDE[len(sides)], PSFS * side)) for n, side in zip(inner, sides, strict=True)
    ]
    starts = [_starts(n, length) for n, length in zip(inner, lengths, strict=True)]
    places = list(product(product(*map(range, lead)), product(*starts)))
    found = []
    for index, first in evenly(places, SAMPLES):
        place = tuple(slice(i, i + n) for i, n in zip(first, lengths, strict=True))
        region = (*(slice(i, i + 1) for i in index), *place)
        whole = (*region, *(slice(0, n) for n in photo.shape[len(shape) :]))
        part = photo.read(whole) if isinstance(photo, Source) else np.asarray(photo[whole])
        have, psf = recipe.linearized(part), recipe.psf
        if isinstance(psf, PsfField):
            psf = psf.at(*((own.start + own.stop) / 2 for own in place))
        light = made(have.linear, "linear light")
        sharp = recipe.deconvolved(have, psf)
        found.append(swing_of(light, sharp, sides, clipped=have.lamps))
    return Swing.mean(found)


def _starts(n: int, length: int) -> list[int]:
    """Where parts begin along an axis, so many that they would cover it, without overlap."""
    return [int(i) for i in np.linspace(0, n - length, max(1, n // length))]
