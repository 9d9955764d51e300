"""Which of many things are pictures of one and the same: the streaks of a photo."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..._typing import FloatArray
from .alignment import Aligned
from .cutout import Cutout

LIKE = 0.8  # normalised correlation, before they are aligned in earnest
AGREEING = 0.9  # of each with the mean of the others, from which on streaks are those of one shake
ROUNDS = 5  # of leaving out what does not agree


def alike_sets(things: Sequence[Cutout], fewest: int) -> Iterator[tuple[list[int], Aligned]]:
    """Sets of things that are alike after alignment, and how they lie on each other.

    Parameters
    ----------
    things : sequence of Cutout
    fewest : int
        Things in a set.

    Yields
    ------
    tuple of (list of int, Aligned)
        Their numbers, in order. No thing is in two sets.
    """
    if len(things) < fewest:
        return
    everything = Aligned.of(things)
    alike, shifts = everything.likeness()
    left = np.ones(len(things), dtype=bool)
    while left.sum() >= fewest:
        # The one that resembles the most others, each by how much.
        close = np.where((alike >= LIKE) & left & left[:, np.newaxis], alike, 0)
        seed = int(close.sum(axis=0).argmax())
        near = np.flatnonzero(close[seed])
        if len(near) < fewest:
            return
        kept, aligned = _agreeing(everything.chosen(near.tolist(), shifts[seed, near]))
        members = near[kept]
        if len(members) >= fewest:
            yield members.tolist(), aligned
        left[members if len(members) >= fewest else seed] = False


def _agreeing(near: Aligned) -> tuple[list[int], Aligned]:
    """Those that agree with the mean of the others, the strangest left out first."""
    members, chosen = np.arange(len(near.light)), near.refined()
    for _ in range(ROUNDS):
        fits = chosen.agreement()
        if float(fits.min()) >= AGREEING or len(members) < 3:
            break
        # One stranger spoils the mean for all: the worst half of them goes first.
        bar = min(AGREEING, float(np.median(fits)))
        kept = np.flatnonzero((fits >= bar) & (fits > float(fits.min())))
        members, chosen = members[kept], chosen.chosen(kept.tolist()).refined()
    kept = np.flatnonzero(chosen.agreement() >= AGREEING)
    return members[kept].tolist(), chosen.chosen(kept.tolist())


def area(light: FloatArray) -> float:
    """Pixels over which light is spread: those of even light with the same sum of squares."""
    return float(light.sum() ** 2 / np.square(light).sum())
