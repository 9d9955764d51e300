"""Which of many things are pictures of one and the same: the streaks of a photo."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..._typing import FloatArray
from .alignment import Aligned
from .cutout import Cutout

LIKE = 0.8  # normalised correlation, before they are aligned in earnest
AGREEING = 0.9  # of each with the mean of the others, from which on streaks are those of one shake
STRANGE = 0.05  # below the usual agreement of a set: another lamp shines into the streak
# The same streak covers up to twice as many pixels where its place between them is unlucky or a
# lens glows around it. Windows blurred alike cover more: they do not belong to the set.
SPREAD = 2.0
SEEDS, TRIES = 16, 8  # smallest things, and sets around them, that are looked at: it takes time
MOST = 16  # things in a set: more streaks would hardly make its PSF better
ROUNDS = 5  # of leaving out what does not agree


def alike_sets(things: Sequence[Cutout], fewest: int) -> Iterator[tuple[list[int], Aligned]]:
    """Sets of things that are alike after alignment, and how they lie on each other.

    Each is sought around the smallest thing that is left, so that small things come first.

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
    areas = np.array([area(thing.light) for thing in things])
    sides = np.array([max(np.ptp(np.nonzero(thing.light), axis=1)) for thing in things])
    left = np.ones(len(things), dtype=bool)
    tries = 0
    for seed in np.argsort(areas)[:SEEDS].tolist():
        alike_sized = (areas <= SPREAD * areas[seed]) & (sides <= SPREAD * sides[seed])
        near = np.flatnonzero(left & (areas >= areas[seed]) & alike_sized)
        if not left[seed] or len(near) < fewest:
            continue
        around = Aligned.of([things[i] for i in near.tolist()])
        alike, shifts = around.likeness_to(int(np.searchsorted(near, seed)))
        close = np.argsort(-alike)[: min(MOST, np.count_nonzero(alike >= LIKE))]
        if len(close) < fewest:
            continue
        tries += 1
        if tries > TRIES:
            return
        kept, aligned = _agreeing(around.chosen(close.tolist()).moved(shifts[close]))
        if len(kept) >= fewest:
            members = near[close[kept]]
            left[members] = False
            yield members.tolist(), aligned


def _agreeing(near: Aligned) -> tuple[list[int], Aligned]:
    """Those that agree with the mean of the others, the strangest left out first."""
    members, chosen = np.arange(len(near.light)), near.refined()
    for _ in range(ROUNDS):
        fits = chosen.agreement()
        bar = max(AGREEING, float(np.median(fits)) - STRANGE)
        if float(fits.min()) >= bar or len(members) < 3:
            break
        # One stranger spoils the mean for all: the worst half of them goes first.
        least = min(bar, float(np.median(fits)))
        kept = np.flatnonzero((fits >= least) & (fits > float(fits.min())))
        members, chosen = members[kept], chosen.chosen(kept.tolist()).refined()
    kept = np.flatnonzero(chosen.agreement() >= AGREEING)
    return members[kept].tolist(), chosen.chosen(kept.tolist())


def area(light: FloatArray) -> float:
    """Pixels over which light is spread: those of even light with the same sum of squares."""
    return float(light.sum() ** 2 / np.square(light).sum())
