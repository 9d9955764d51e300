"""Verbs that find the response of the camera."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from napari.layers import Image as ImageLayer

from ..._typing import Image
from ...edges import Edge
from ...errors import CrfDeblurError, about
from ...estimate import (
    MaximumLikelihood,
    PerChannel,
    ResponseFit,
    Responses,
    estimating_responses,
    given_responses,
)
from ...io import read_photo, read_responses
from ...pipeline import DeblurOptions, Intermediates, PhotoStack, Stage, walking
from ...profiles import ProfileGroup, of_channel
from ...progress import Job, Progress
from ...response import Response
from ..pixels import source_of, unwrapped
from ..regions import shown_plane
from .state import EdgeSet, Fitted
from .step import Step, at_once
from .workspace import Workspace


@dataclass(frozen=True, slots=True, eq=False)
class Other:
    """A further photo of the same camera: a plane of a layer, or a file.

    Parameters
    ----------
    name : str
        Name of the layer, or path of the file.
    load : callable
        Gives the pixels.
    edges : tuple of Edge, optional
        If they are known; otherwise they are found automatically.
    """

    name: str
    load: Callable[[], Image]
    edges: tuple[Edge, ...] | None = None

    @classmethod
    def of_file(cls, path: Path) -> "Other":
        """A photo in a file, its edges found automatically."""
        return cls(str(path), lambda: read_photo(path))


class ResponseVerbs(Workspace):
    """Verbs of a session that find the response of the camera."""

    def estimate_response(
        self,
        method: ResponseFit | None = None,
        *,
        per_channel: bool = False,
        others: Sequence[ImageLayer | Path | str] = (),
    ) -> Fitted:
        """Estimate the camera response from the edges.

        Parameters
        ----------
        method : ResponseFit, optional
            By default :class:`~napari_crfdeblur.estimate.MaximumLikelihood`.
        per_channel : bool
            One response for each color channel.
        others : sequence of layers or files
            Further photos of the same camera, by layer, name of a layer, or path; their edges
            are those of the session, or found automatically.

        Raises
        ------
        CrfDeblurError
            There are no edges, or they cannot determine a response.
        """
        return self.do(estimating_response(self, method, per_channel=per_channel, others=others))

    def set_response(self, curve: Response) -> Fitted:
        """Use a response that is known: one curve, or one for each channel."""
        return self.do(setting_response(self, curve))

    def load_response(self, path: Path | str) -> Fitted:
        """Use the response in a JSON file."""
        curves = read_responses(Path(path))
        return self.set_response(curves[0] if len(curves) == 1 else curves)


def estimating_response(
    session: Workspace,
    method: ResponseFit | None = None,
    *,
    per_channel: bool = False,
    others: Sequence[ImageLayer | Path | str] = (),
) -> Step[Fitted, Fitted]:
    """Step of :meth:`ResponseVerbs.estimate_response`."""
    photo, source = session.source()
    edges = session.required_edges()
    further = [_other(session, other) for other in others]
    fit = method or MaximumLikelihood()
    if per_channel and not isinstance(fit, PerChannel):
        fit = PerChannel.alike(fit)

    @at_once
    def finish(fitted: Fitted) -> Fitted:
        session.commit(photo, replace(session.state_of(photo), fitted=fitted))
        session.say_trust(fitted)
        return fitted

    job = _fitting(source, edges, fit, further)
    return Step("estimating the response", job, finish)


def following_edges(
    session: Workspace, stay: Collection[int] | None = None
) -> Step[Fitted | None, Fitted | None]:
    """The response after a change of the edges, at once from the last one.

    It is kept beside the response, which it changes no more than the record of what was done.

    Parameters
    ----------
    session : Workspace
    stay : collection of int, optional
        Numbers of the edges that count; all of them by default.

    Raises
    ------
    CrfDeblurError
        There are no edges, or the response is none that can follow them.
    """
    photo, _ = session.source()
    edges, fitted = session.required_edges(), session.required_response()
    last = session.state.live or fitted
    if not last.responses.fits:
        raise CrfDeblurError("only a response of maximum likelihood can follow the edges")

    @at_once
    def finish(live: Fitted | None) -> Fitted | None:
        state = session.state_of(photo)
        if live is not None and state.edges is edges and state.fitted is fitted:
            session.commit(photo, replace(state, live=live))
        return live

    return Step("following the edges", _following(last, edges, stay), finish)


def setting_response(session: Workspace, curve: Response) -> Step[Fitted, Fitted]:
    """Step of :meth:`ResponseVerbs.set_response`."""
    photo, source = session.source()
    given = Fitted(given_responses(curve))
    if len(given.estimates) == 3 and not source.rgb:
        raise CrfDeblurError(
            f"this response has three channels, but “{photo.name}” is gray: choose a response of "
            "one curve"
        )

    def job() -> Job[Fitted]:
        yield Progress("given response", 0, 1)
        return given

    @at_once
    def finish(fitted: Fitted) -> Fitted:
        session.commit(photo, replace(session.state_of(photo), fitted=fitted))
        return fitted

    return Step("taking the response", job(), finish)


def _fitting(
    source: PhotoStack, found: EdgeSet, method: ResponseFit, others: Sequence[Other]
) -> Job[Fitted]:
    """Long job: the response from the edges of a photo, and of others of the same camera."""
    options = DeblurOptions(response=method)
    have = Intermediates(source.photo(found.plane), edges=found.edges)
    have = yield from walking(have, options, until=Stage.PROFILES)
    groups = [*(have.groups or ())]
    for index, other in enumerate(others, start=1):
        yield Progress(f"edges of {other.name}", index - 1, len(others))
        try:
            have = Intermediates(other.load(), index=index, edges=other.edges)
            have = yield from walking(have, options, until=Stage.PROFILES)
        except CrfDeblurError as error:
            raise about(other.name, error) from error
        groups += have.groups or ()
    response = yield from estimating_responses(groups, method)
    names = tuple(other.name for other in others)
    return Fitted(response, tuple(groups), found, method, names)


def _following(
    last: Fitted, edges: EdgeSet, stay: Collection[int] | None = None
) -> Job[Fitted | None]:
    """Short job: the response after a change of the edges, from the last one.

    Parameters
    ----------
    last : Fitted
        From which it goes on; the profiles of other photos stay.
    edges : EdgeSet
        The edges now.
    stay : collection of int, optional
        Numbers of the edges that count; all of them by default.

    Returns
    -------
    Fitted or None
        None if it takes a full estimate.
    """
    yield Progress("following the edges", 0, 1)
    own = edges.groups if stay is None else _only(edges.groups, stay)
    groups = (*own, *(group for group in last.groups if group.sources[0].image > 0))
    before = last.responses.fits
    parts = _split(groups, len(before))
    fits = [fit.refit(part) for fit, part in zip(before, parts, strict=True)]
    found = tuple(fit for fit in fits if fit is not None)
    if len(found) < len(fits) or not found:
        return None
    responses = Responses(tuple(fit.estimate for fit in found), found)
    return replace(last, responses=responses, groups=groups, edges=edges)


def _split(groups: Sequence[ProfileGroup], count: int) -> list[Sequence[ProfileGroup]]:
    """The profiles for one response of all channels, or for that of each."""
    return [groups] if count == 1 else [of_channel(groups, c) for c in range(count)]


def _only(groups: Sequence[ProfileGroup], stay: Collection[int]) -> tuple[ProfileGroup, ...]:
    """The profiles of some edges; groups left empty are dropped."""
    masks = [[source.edge in stay for source in group.sources] for group in groups]
    return tuple(
        g.select(np.array(mask)) for g, mask in zip(groups, masks, strict=True) if any(mask)
    )


def _other(session: Workspace, other: ImageLayer | Path | str) -> Other:
    """A further photo, by layer, by the name of a layer, or by file."""
    if isinstance(other, str) and other in session.viewer.layers:
        other = session.viewer.layers[other]
    if isinstance(other, str | Path):
        return Other.of_file(Path(other))
    other = unwrapped(other)
    source_of(other, white=1.0)  # refuses what is no photo
    source = source_of(other, session.white_of(other))
    edges = session.state_of(other).edges
    plane = edges.plane if edges else shown_plane(session.viewer, other)
    return Other(other.name, partial(source.photo, plane), edges.edges if edges else None)
