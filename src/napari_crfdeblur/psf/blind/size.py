"""How large a PSF is, found from the blurred picture: coarse first, for little work."""

from collections.abc import Callable
from math import inf

import numpy as np

from ..._typing import FloatArray
from ...errors import CrfDeblurError
from ...progress import Job
from .blurred import Blurred
from .search import Search

# Pixels of the arrays in which a PSF is looked for, at a scale at which they have COARSE pixels.
SIZES = (121, 85, 61, 43, 31)
COARSE = 25
MASS = 0.98  # of the PSF that counts as its extent, along rows and along columns
FITTING = 0.75  # of its array: a longer PSF can have been cut, or can be anything
ROOM = 1.25  # times the extent seen, and
MARGIN = 2  # more pixels: the array in which the PSF is found at full scale
TOUCHING = 0.9  # of its array, from which on the PSF is taken to be cut


def extent_of(psf: FloatArray) -> int:
    """Rows or columns, whichever are more, that hold 98 % of a PSF."""
    return max(_core(psf.sum(axis=axis)) for axis in (0, 1))


def finding_size(look: Callable[[int], Blurred], search: Search, largest: int) -> Job[int]:
    """Long job: a size with some room for the PSF of a picture.

    The PSF is searched in the picture made small, so that it fits in 25 pixels: such a search
    costs a fraction of the one that follows, and a PSF that is right in its outline is enough.
    Smaller and smaller arrays are tried, in finer and finer pictures, until the PSF does not
    fit any more.

    Parameters
    ----------
    look : callable
        ``look(size)``: what a PSF of so many pixels is searched in.
    search : callable
        The method, as in :func:`~.estimation.estimating_blindly`.
    largest : int
        That the photo permits, in pixels.

    Returns
    -------
    int
        Odd, at least 3.
    """
    sizes, extent = _sizes(largest), inf
    for size in sizes:
        if 2 * ROOM * extent < size and size != sizes[-1]:
            continue  # a smaller one will do
        seen = yield from _seen(look(size), search, size)
        if seen <= FITTING * size:
            extent = min(extent, seen)
        elif extent < inf:
            break
    return odd_size(min(ROOM * extent + MARGIN, largest), largest)


def is_cut(psf: FloatArray) -> bool:
    """Whether a PSF reaches so far that its array can have cut it."""
    return extent_of(psf) > TOUCHING * len(psf)


def odd_size(size: float, largest: int) -> int:
    """The next odd size, within 3 and `largest`."""
    return max(min(int(np.ceil(size)) | 1, (largest - 1) | 1), 3)


def _seen(blurred: Blurred, search: Search, size: int) -> Job[float]:
    """Extent in pixels of the PSF found at a small scale; infinity if none is."""
    scale = min(1.0, COARSE / size)
    try:
        small = blurred if scale == 1 else blurred.scaled(scale)
        psf = yield from search(small, min(COARSE, size))
    except CrfDeblurError:  # another scale may show more
        return inf
    return extent_of(psf) / scale


def _sizes(largest: int) -> list[int]:
    """From the largest that the photo permits to the smallest."""
    return [size for size in SIZES if size <= largest] or [odd_size(largest, largest)]


def _core(profile: FloatArray) -> int:
    cumulated = np.cumsum(profile) / profile.sum()
    first, last = np.searchsorted(cumulated, [(1 - MASS) / 2, (1 + MASS) / 2])
    return int(last - first) + 1
