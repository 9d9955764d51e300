"""Which profiles the paper's methods compare: those of an orientation, or of one edge."""

from collections.abc import Sequence

from ...profiles import ByEdge
from ...profiles.base import ProfileGroup
from ...response import dorf_mean
from ..identifiability import LEAST_COLLINEARITY, levels_apart


def by_edge(groups: Sequence[ProfileGroup]) -> tuple[ProfileGroup, ...]:
    """The channels of each edge as a group of their own, if these can tell the response.

    The paper's methods do not allow for edges that lie a little beside where they were located,
    which the channels of one edge share. Where edges lie between different colors, and one
    response serves all channels, these alone determine it.
    """
    split = [own for group in groups for own in ByEdge().split(group)]
    rows = [group for group in split if len(group) >= 2]
    if levels_apart(rows, dorf_mean()) >= LEAST_COLLINEARITY:
        return tuple(sorted(split, key=len, reverse=True))
    return tuple(groups)
