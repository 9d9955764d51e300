"""The first stages of the path for several photos of one camera, whose profiles are pooled."""

from collections.abc import Sequence

from .. import arguments
from .._typing import Image
from ..edges import Edge
from ..estimate import ResponseFit
from ..profiles import ProfileGroup
from ..progress import Job, drain
from .intermediates import Intermediates
from .options import DeblurOptions
from .path import Stage, walking


def profiling(photo: Image, options: DeblurOptions, index: int = 0) -> Job[Intermediates]:
    """Long job: edges and profiles of one of several photos of a camera.

    Parameters
    ----------
    photo : ndarray, shape (M, N), (M, N, 3) or (M, N, 4)
    options : DeblurOptions
        Edges and method of the response.
    index : int
        Number of the photo.
    """
    return (yield from walking(Intermediates(photo, index=index), options, until=Stage.PROFILES))


def profiles_for(
    method: ResponseFit, photo: Image, edges: Sequence[Edge], index: int = 0
) -> tuple[ProfileGroup, ...]:
    """Profiles of a photo, in the groups that tell the method most about the response.

    Those of one orientation are a group. For the paper's methods, which do not allow for edges
    that lie a little beside where they were located, the channels of each edge are a group of
    their own where edges lie between different colors and one response serves all channels.
    """
    have = Intermediates(photo, index=index, edges=tuple(arguments.instances(edges, Edge, "edges")))
    job = walking(have, DeblurOptions(response=method), until=Stage.PROFILES)
    return drain(job).groups or ()
