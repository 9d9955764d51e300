"""What a session knows of a photo: frozen records, one for each stage of the path."""

from dataclasses import dataclass, replace

from napari.layers import Image as ImageLayer
from napari.layers import Layer

from ...deconvolution.tiles import Region
from ...edges import Edge
from ...estimate import Finding, PerChannel, ResponseEstimate, ResponseFit, Responses
from ...pipeline import DeblurOptions, Drawn, Intermediates
from ...pipeline.blur import Blur
from ...pipeline.record import Record
from ...profiles import ProfileGroup
from ...psf import PsfEstimate, PsfEstimator, PsfField
from ...response import Response, ResponseCurve

UNDO_DEPTH = 50
MOST_DOUBTS = 2  # shown; the others in a tooltip


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
    drawn : tuple of Edge, Line or Rectangle, optional
        What they were made of; None if they were found automatically.
    asked : float, optional
        Extent that was asked for; None if it was judged from the photo.
    """

    edges: tuple[Edge, ...]
    groups: tuple[ProfileGroup, ...]
    extent: float
    plane: Region
    drawn: tuple[Drawn, ...] | None = None
    asked: float | None = None

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
    responses : Responses
        As the path takes them.
    groups : tuple of ProfileGroup
        Profiles that went into it; empty if it was given.
    edges : EdgeSet or None
        Edges of the photo at that time; None if it was given.
    method : ResponseFit, optional
        How it was found; None if it was given.
    others : tuple of str
        Names of further photos from which it was found.
    """

    responses: Responses
    groups: tuple[ProfileGroup, ...] = ()
    edges: EdgeSet | None = None
    method: ResponseFit | None = None
    others: tuple[str, ...] = ()

    @property
    def estimates(self) -> tuple[ResponseEstimate, ...]:
        """One for all channels, or one for each."""
        return self.responses.estimates

    @property
    def curve(self) -> Response:
        """The curve of all channels, or the curves of each."""
        return self.responses.curve

    @property
    def way(self) -> ResponseFit:
        """How it can be found again: from the edges of this photo, or else as it is."""
        if self.method is not None and not self.others:
            return self.method
        curves: list[ResponseCurve] = [estimate.curve for estimate in self.estimates]
        return PerChannel.given(curves)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Why the response is in doubt, over all channels."""
        return tuple(dict.fromkeys(f for own in self.estimates for f in own.findings))

    @property
    def doubts(self) -> list[str]:
        """The first of the findings as lines for the user, who would not read more."""
        return [f"• {finding.value}" for finding in self.findings[:MOST_DOUBTS]]

    def as_given(self) -> "Fitted":
        """The same response for another photo, which has not the edges that it came from."""
        return Fitted(Responses(self.estimates))


@dataclass(frozen=True, slots=True, eq=False)
class Sought:
    """How a PSF was found.

    Parameters
    ----------
    method : PsfEstimator
    fitted : Fitted
        The response with which it was looked for.
    edges : EdgeSet or None
        The edges at that time.
    plane : tuple of slice
        The slice in which it was looked for; all rows and columns.
    regions : int or (int, int), optional
        Parts that got a PSF each.
    """

    method: PsfEstimator
    fitted: Fitted
    edges: EdgeSet | None
    plane: Region
    regions: int | tuple[int, int] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """A layer in linear light, and the response that made it so."""

    layer: ImageLayer
    region: Region
    fitted: Fitted


@dataclass(frozen=True, slots=True, eq=False)
class Sharp:
    """A deconvolved layer in linear light, what it was made of, and how in all."""

    layer: ImageLayer
    linear: Linear
    record: Record


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """All that is known of one photo; a step that fails leaves it as it was.

    Parameters
    ----------
    psf : PsfEstimate or None
        That of the whole photo.
    sought : Sought or None
        How it was found; None if it was given or edited.
    field : PsfField or None
        Those of its parts, if they differ; `psf` is then not used to restore it.
    live : Fitted or None
        The response that follows the edges while they change, to be looked at; no step uses it.
    by_hand : bool
        Whether the edges were changed by hand last: drawn, deleted, undone.
    record : Record or None
        How the restored photo was made, while nothing has changed since.
    """

    edges: EdgeSet | None = None
    fitted: Fitted | None = None
    psf: PsfEstimate | None = None
    linear: Linear | None = None
    sharp: Sharp | None = None
    restored: ImageLayer | None = None
    undo: tuple[EdgeSet | None, ...] = ()
    redo: tuple[EdgeSet | None, ...] = ()
    live: Fitted | None = None
    field: PsfField | None = None
    sought: Sought | None = None
    by_hand: bool = False
    record: Record | None = None

    @property
    def found(self) -> tuple[object, ...]:
        """What a restored photo rests on."""
        return self.edges, self.fitted, self.psf, self.field

    @property
    def blur(self) -> Blur | None:
        """What the photo is restored with: the PSFs of its parts, or that of the whole."""
        whole = None if self.psf is None else self.psf.psf
        return whole if self.field is None else self.field

    @property
    def shown(self) -> Fitted | None:
        """The response to look at: the one that follows the edges, or the one in force."""
        return self.live or self.fitted

    def with_edges(self, edges: EdgeSet | None, *, by_hand: bool = False) -> "State":
        """The state with other edges; those before can be had again by undo."""
        undo = (*self.undo, self.edges)[-UNDO_DEPTH:]
        return replace(self, edges=edges, undo=undo, redo=(), by_hand=by_hand)

    def with_tools(
        self, fitted: Fitted, psf: PsfEstimate, parts: PsfField | None = None
    ) -> "State":
        """The state as if the response and the PSF of another photo were given for this one."""
        known = fitted.as_given()
        return replace(self, fitted=known, psf=psf, field=parts, sought=None)

    def without(self, layer: Layer) -> "State":
        """The state without a layer that was closed; what was known beside it stays."""
        linear, sharp = self.linear, self.sharp
        left = (
            None if linear is not None and linear.layer is layer else linear,
            None if sharp is not None and sharp.layer is layer else sharp,
            None if self.restored is layer else self.restored,
        )
        if left == (linear, sharp, self.restored):
            return self
        return replace(self, linear=left[0], sharp=left[1], restored=left[2])

    def of_other_shape(self, axes: int) -> "State":
        """What still holds when the photo gets pixels of another shape: its response and PSF.

        Parameters
        ----------
        axes : int
            Of the photo now, color left out.
        """
        fitted = None if self.fitted is None else self.fitted.as_given()
        psf = None if self.psf is None or self.psf.psf.ndim > axes else self.psf
        return State(fitted=fitted, psf=psf)

    def undone(self) -> "State | None":
        """The state before the last change of the edges; None if there was none."""
        if not self.undo:
            return None
        *undo, edges = self.undo
        return replace(
            self, edges=edges, undo=tuple(undo), redo=(*self.redo, self.edges), by_hand=True
        )

    def redone(self) -> "State | None":
        """The state before the last undo; None if there was none."""
        if not self.redo:
            return None
        *redo, edges = self.redo
        return replace(
            self, edges=edges, undo=(*self.undo, self.edges), redo=tuple(redo), by_hand=True
        )


def edge_set(have: Intermediates, plane: Region, options: DeblurOptions) -> EdgeSet:
    """The edges that the path has found or refined in a plane, with their profiles."""
    return EdgeSet(
        have.edges or (),
        have.groups or (),
        have.extent or options.blur_extent or 0.0,
        plane,
        options.edges,
        options.blur_extent,
    )
