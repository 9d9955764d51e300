"""Whether things stand in rows or are equally bright, as windows, letters and seldom lamps are."""

import numpy as np

from ..._typing import BoolArray, FloatArray

IN_LINE = 1.0  # pixel: windows of one floor differ by less; of 10 lamps few pairs come so near
EVEN = 1.5  # pixels by which the middle one of three may be off the middle between its neighbors
EQUAL = 0.01  # of the light of one: lamps at different distances differ by far more
SHARE = 0.5  # of things that stand in rows, above which they are no lamps


def stand_in_rows(places: FloatArray, others: FloatArray) -> bool:
    """Whether most of some things share a row or a column with another, or stand evenly.

    Parameters
    ----------
    places : ndarray, shape (n, 2)
        Row and column of each.
    others : ndarray, shape (m, 2)
        Row and column of further things of their kind.
    """
    everything = np.concatenate([places, others])
    apart = np.abs(places[:, np.newaxis] - everything)
    apart[np.arange(len(places)), np.arange(len(places))] = np.inf
    regular: BoolArray = np.asarray(np.any(apart <= IN_LINE, axis=(1, 2)))
    regular |= _in_threes(places)
    return bool(np.count_nonzero(regular) > SHARE * len(places))


def are_equal(lights: FloatArray) -> bool:
    """Whether most of some things have as much light as another, as the same letters have.

    Parameters
    ----------
    lights : ndarray, shape (n,)
    """
    apart = np.abs(lights[:, np.newaxis] / lights - 1)
    np.fill_diagonal(apart, np.inf)
    return bool(np.count_nonzero(np.min(apart, axis=1) <= EQUAL) > SHARE * len(lights))


def _in_threes(places: FloatArray) -> BoolArray:
    """Which are one of three at even distances on a line."""
    found = np.zeros(len(places), dtype=bool)
    middles = (places[:, np.newaxis] + places) / 2
    for i, place in enumerate(places):
        off = np.abs(middles - place).max(axis=2)
        off[i], off[:, i] = np.inf, np.inf
        np.fill_diagonal(off, np.inf)
        ends = np.argwhere(off <= EVEN)
        if len(ends):
            found[i] = True
            found[ends.ravel()] = True
    return found
