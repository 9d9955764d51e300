"""What a session knows of a photo: frozen records, one for each stage of the path."""

import dataclasses
from dataclasses import dataclass, replace
from typing import Any

from napari.layers import Image as ImageLayer

from ..edges import Edge
from ..estimate import Finding, ResponseEstimate
from ..estimate.likelihood import LiveFit
from ..pipeline import joint_curve
from ..profiles import ProfileGroup
from ..psf import PsfEstimate, PsfField
from ..response import Response
from .blurs import Blur
from .pixels import Region

UNDO_DEPTH = 50
MOST_DOUBTS = 2  # shown; the others in a tooltip
REPLACED = {"set_edges", "set_response", "set_psf"}


@dataclass(frozen=True, slots=True, eq=False)
class EdgeSet:
    """The edges of one plane of the photo.

    Parameters
    ----------
    edges : tuple of Edge
        All of them, the rejected ones with their reason.
    groups : tuple of ProfileGroup
        Profiles of the good ones, by orientation, the largest group first.
    extent : float
        Width in pixels of the blurred edges that was reckoned with.
    plane : tuple of slice
        Where in the stack they lie; all rows and columns.
    """

    edges: tuple[Edge, ...]
    groups: tuple[ProfileGroup, ...]
    extent: float
    plane: Region

    @property
    def group_numbers(self) -> tuple[int, ...]:
        """Number of the orientation group of each edge, -1 for those in none."""
        groups = enumerate(self.groups)
        of = {source.edge: number for number, group in groups for source in group.sources}
        return tuple(of.get(number, -1) for number in range(len(self.edges)))

    @property
    def intensity_ranges(self) -> dict[int, tuple[float, float]]:
        """Lowest and highest intensity of the sides over all channels, by number of the edge."""
        levels: dict[int, list[float]] = {}
        for group in self.groups:
            for source, sides in zip(group.sources, group.sides.tolist(), strict=True):
                levels.setdefault(source.edge, []).extend(sides)
        return {edge: (min(sides), max(sides)) for edge, sides in levels.items()}

    @property
    def widest(self) -> float:
        """Width in pixels of the widest good edge, or what was reckoned with."""
        return max((edge.width for edge in self.edges if edge.good), default=self.extent)


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A response, and what it was found from.

    Parameters
    ----------
    estimates : tuple of ResponseEstimate
        One for all channels, or one for each.
    groups : tuple of ProfileGroup
        Profiles that went into it; empty if it was given.
    edges : EdgeSet or None
        Edges of the photo at that time; None if it was given.
    fits : tuple of LiveFit
        What it takes to follow the edges from here, for each estimate; empty if it cannot.
    """

    estimates: tuple[ResponseEstimate, ...]
    groups: tuple[ProfileGroup, ...] = ()
    edges: EdgeSet | None = None
    fits: tuple[LiveFit, ...] = dataclasses.field(default=(), repr=False)

    @property
    def curve(self) -> Response:
        """The curve of all channels, or the curves of each."""
        return joint_curve(self.estimates)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Why the response is in doubt, over all channels."""
        return tuple(dict.fromkeys(f for own in self.estimates for f in own.findings))

    @property
    def doubts(self) -> list[str]:
        """The first of the findings as lines for the user, who would not read more."""
        return [f"• {finding.value}" for finding in self.findings[:MOST_DOUBTS]]


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """A layer in linear light, and the response that made it so."""

    layer: ImageLayer
    region: Region
    fitted: Fitted


@dataclass(frozen=True, slots=True, eq=False)
class Sharp:
    """A deconvolved layer in linear light, and the linear layer that it was made of."""

    layer: ImageLayer
    linear: Linear


def _left_out(value: Any) -> bool:
    return value is None or value is False or (isinstance(value, tuple) and not value)


@dataclass(frozen=True, slots=True)
class Action:
    """A step that was done, so that it can be stored, shown as a script and repeated.

    Parameters
    ----------
    verb : str
        Name of the session's method.
    arguments : dict
        By name; only those that differ from the defaults.
    """

    verb: str
    arguments: dict[str, Any] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, verb: str, **arguments: Any) -> "Action":
        """An action without the arguments that were left at None, False or nothing."""
        given = {k: v for k, v in arguments.items() if not _left_out(v)}
        return cls(verb, given)


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """All that is known of one photo; a step that fails leaves it as it was.

    Parameters
    ----------
    psf : PsfEstimate or None
        That of the whole photo.
    field : PsfField or None
        Those of its parts, if they differ; `psf` is then not used to restore it.
    live : Fitted or None
        The response that follows the edges while they change, to be looked at; no step uses it.
    """

    edges: EdgeSet | None = None
    fitted: Fitted | None = None
    psf: PsfEstimate | None = None
    linear: Linear | None = None
    sharp: Sharp | None = None
    restored: ImageLayer | None = None
    actions: tuple[Action, ...] = ()
    undo: tuple[EdgeSet | None, ...] = ()
    redo: tuple[EdgeSet | None, ...] = ()
    live: Fitted | None = None
    field: PsfField | None = None

    @property
    def blur(self) -> Blur | None:
        """What the photo is restored with: the PSFs of its parts, or that of the whole."""
        whole = None if self.psf is None else self.psf.psf
        return whole if self.field is None else self.field

    @property
    def shown(self) -> Fitted | None:
        """The response to look at: the one that follows the edges, or the one in force."""
        return self.live or self.fitted

    def after(self, *actions: Action, **changes: Any) -> "State":
        """The state after some actions; of edges and curves set one after the other, the last."""
        done = list(self.actions)
        for action in actions:
            if done and done[-1].verb == action.verb and action.verb in REPLACED:
                done.pop()
            done.append(action)
        return replace(self, actions=tuple(done), **changes)

    def with_edges(self, edges: EdgeSet | None) -> "State":
        """The state with other edges; those before can be had again by undo."""
        return replace(self, edges=edges, undo=(*self.undo, self.edges)[-UNDO_DEPTH:], redo=())

    def with_tools(
        self, fitted: Fitted, psf: PsfEstimate, parts: PsfField | None = None
    ) -> "State":
        """The state as if the response and the PSF of another photo were given for this one."""
        curves = tuple(estimate.curve for estimate in fitted.estimates)
        return self.after(
            Action.of("set_response", curve=curves[0] if len(curves) == 1 else curves),
            Action.of("set_psf", psf=psf.psf, field=parts),
            Action.of("linearize"),
            Action.of("deconvolve"),
            Action.of("reapply"),
            fitted=fitted,
            psf=psf,
            field=parts,
        )

    def undone(self) -> "State | None":
        """The state before the last change of the edges; None if there was none."""
        if not self.undo:
            return None
        *undo, edges = self.undo
        return replace(self, edges=edges, undo=tuple(undo), redo=(*self.redo, self.edges))

    def redone(self) -> "State | None":
        """The state before the last undo; None if there was none."""
        if not self.redo:
            return None
        *redo, edges = self.redo
        return replace(self, edges=edges, undo=(*self.undo, self.edges), redo=tuple(redo))
