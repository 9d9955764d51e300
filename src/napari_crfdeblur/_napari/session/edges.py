"""Verbs that find, draw and change edges."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from numbers import Integral
from pathlib import Path

from napari.layers import Image as ImageLayer

from ...arguments import instances
from ...deconvolution.tiles import Region
from ...edges import Edge
from ...errors import CrfDeblurError
from ...io import read_edges
from ...pipeline import DeblurOptions, Drawn, Intermediates, PhotoStack, Stage, walking
from ...progress import Job, Progress
from ..regions import stack_index
from .state import EdgeSet, State, edge_set
from .step import Effects, Step, at_once
from .workspace import Workspace

ONE_SLICE = (
    "all edges must lie on one slice of the stack: go to the slice of the others, or delete "
    "them first"
)


class EdgeVerbs(Workspace):
    """Verbs of a session that find, draw and change edges."""

    def detect_edges(
        self,
        blur_extent: float | None = None,
        *,
        add: bool = False,
        plane: Sequence[int] | None = None,
    ) -> EdgeSet:
        """Find straight edges, and show them as lines colored by orientation.

        Parameters
        ----------
        blur_extent : float, optional
            Largest width of a blurred edge in pixels; judged from the photo if not given.
        add : bool
            Keep the edges that there are already.
        plane : sequence of int, optional
            Index of the plane in a stack; by default the one that is shown.

        Raises
        ------
        CrfDeblurError
            There is no photo, or it cannot be worked on.
        """
        return self.do(detecting_edges(self, blur_extent, add=add, plane=plane))

    def set_edges(
        self,
        items: Sequence[Drawn] = (),
        blur_extent: float | None = None,
        *,
        plane: Sequence[int] | None = None,
    ) -> EdgeSet:
        """Use these edges: lines and rectangles are refined first, edges taken as they are.

        Parameters
        ----------
        items : sequence of Edge, Line or Rectangle
            In (row, column) pixels of the photo; none to do without edges.
        blur_extent, plane
            As in :meth:`detect_edges`.
        """
        return self.do(setting_edges(self, items, blur_extent, plane=plane))

    def remove_edges(self, numbers: Sequence[int]) -> EdgeSet:
        """Do without the edges of these numbers."""
        return self.do(removing_edges(self, numbers))

    def load_edges(self, path: Path | str) -> EdgeSet:
        """Use the edges of a JSON file; they are refined on this photo."""
        return self.set_edges(read_edges(Path(path)))

    def undo_edges(self) -> None:
        """Take back the last change of the edges."""
        self._turn_edges(self.state.undone(), "there is no change of the edges to undo")

    def redo_edges(self) -> None:
        """Do again what :meth:`undo_edges` took back."""
        self._turn_edges(self.state.redone(), "there is no change of the edges to redo")

    def _turn_edges(self, state: State | None, otherwise: str) -> None:
        if state is None:
            raise CrfDeblurError(otherwise)
        self.commit(self._required_photo(), state)


def detecting_edges(
    session: Workspace,
    blur_extent: float | None = None,
    *,
    add: bool = False,
    plane: Sequence[int] | None = None,
) -> Step[EdgeSet, EdgeSet]:
    """Step of :meth:`EdgeVerbs.detect_edges`."""
    photo, source = session.source()
    where = session.plane(plane)
    before = session.state.edges
    keep = before.edges if add and before is not None else ()
    if keep and before is not None and before.plane != where:
        raise CrfDeblurError(ONE_SLICE)
    job = _finding(source, where, DeblurOptions(blur_extent=blur_extent), keep)
    finish = _keeping(session, photo, source, before, "adding the found edges", by_hand=False)
    return Step("finding edges", job, finish)


def setting_edges(
    session: Workspace,
    items: Sequence[Drawn],
    blur_extent: float | None = None,
    *,
    plane: Sequence[int] | None = None,
) -> Step[EdgeSet, EdgeSet]:
    """Step of :meth:`EdgeVerbs.set_edges`."""
    photo, source = session.source()
    before = session.state.edges
    where = session.plane(plane)
    extent = blur_extent or (before.extent if before else None)
    options = DeblurOptions(edges=tuple(items), blur_extent=extent)
    if before is not None:
        wanted = set(items)
        stay = frozenset(n for n, edge in enumerate(before.edges) if edge in wanted)
        session.edges_changing.emit(stay)
    finish = _keeping(session, photo, source, before, "refining edges", by_hand=True)
    return Step("refining edges", _finding(source, where, options), finish)


def removing_edges(session: Workspace, numbers: Sequence[int]) -> Step[EdgeSet, EdgeSet]:
    """Step of :meth:`EdgeVerbs.remove_edges`."""
    found = session.required_edges()
    instances(numbers, Integral, "the numbers of edges")
    left = [edge for number, edge in enumerate(found.edges) if number not in numbers]
    return setting_edges(session, left, plane=stack_index(found.plane))


def joined(
    before: EdgeSet | None, now: EdgeSet | None, items: Sequence[Drawn]
) -> tuple[Drawn, ...]:
    """The present edges with the changes that made `items` of the edges before."""
    old, new = set(before.edges if before else ()), set(items)
    present = now.edges if now else ()
    stay = [edge for edge in present if edge not in old or edge in new]
    return (*stay, *(item for item in items if item not in old and item not in set(present)))


def _finding(
    source: PhotoStack, plane: Region, options: DeblurOptions, keep: Sequence[Edge] = ()
) -> Job[EdgeSet]:
    """Long job: the edges of a plane, found or refined, beside those to keep; their profiles."""
    yield Progress("reading the photo", 0, 1)
    have = Intermediates(source.photo(plane))
    have = yield from walking(have, options, until=Stage.EDGES)
    if keep:
        edges = (*keep, *(have.edges or ()))
        have, options = replace(have, edges=edges), replace(options, edges=edges)
    have = yield from walking(have, options, until=Stage.PROFILES)
    return edge_set(have, plane, options)


def _keeping(
    session: Workspace,
    photo: ImageLayer,
    source: PhotoStack,
    before: EdgeSet | None,
    title: str,
    *,
    by_hand: bool,
) -> Callable[[EdgeSet], Effects[EdgeSet]]:
    """Keep the edges found; if others were drawn meanwhile, those too, by one step more."""

    @at_once
    def finish(found: EdgeSet) -> EdgeSet:
        state = session.state_of(photo)
        now = state.edges
        if now is None or now is before or now.plane != found.plane:
            session.commit(photo, state.with_edges(found, by_hand=by_hand))
        else:
            items = joined(before, now, found.edges)
            options = DeblurOptions(edges=items, blur_extent=found.extent or None)
            job = _finding(source, found.plane, options)
            again = _keeping(session, photo, source, now, title, by_hand=True)
            session.start(Step(title, job, again))
        return found

    return finish
