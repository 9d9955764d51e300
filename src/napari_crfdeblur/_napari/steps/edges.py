"""Steps that change the edges."""

from collections.abc import Callable, Sequence

from napari.layers import Image as ImageLayer

from ...edges import Edge, Line, Rectangle
from ...errors import CrfDeblurError
from .. import jobs
from ..pixels import Source
from ..regions import stack_index
from ..state import Action, EdgeSet
from ..step import Effects, Step, at_once
from ..workspace import Workspace

Item = Edge | Line | Rectangle

ONE_SLICE = (
    "all edges must lie on one slice of the stack: go to the slice of the others, or delete "
    "them first"
)


def detecting_edges(
    session: Workspace,
    blur_extent: float | None = None,
    *,
    add: bool = False,
    plane: Sequence[int] | None = None,
) -> Step[EdgeSet, EdgeSet]:
    """Step of :meth:`Session.detect_edges`."""
    photo, source = session.source()
    where = session.plane(plane)
    before = session.state.edges
    keep = before.edges if add and before is not None else ()
    if keep and before is not None and before.plane != where:
        raise CrfDeblurError(ONE_SLICE)
    action = Action.of("detect_edges", blur_extent=blur_extent, add=add, plane=stack_index(where))
    job = jobs.finding_edge_set(source, where, blur_extent, keep)
    finish = _keeping(session, photo, source, before, action, "adding the found edges")
    return Step("finding edges", job, finish)


def setting_edges(
    session: Workspace,
    items: Sequence[Item],
    blur_extent: float | None = None,
    *,
    plane: Sequence[int] | None = None,
) -> Step[EdgeSet, EdgeSet]:
    """Step of :meth:`Session.set_edges`."""
    photo, source = session.source()
    before = session.state.edges
    where = session.plane(plane)
    extent = blur_extent or (before.extent if before else None)
    action = Action.of(
        "set_edges", items=tuple(items), blur_extent=blur_extent, plane=stack_index(where)
    )
    job = jobs.refining_edge_set(source, where, tuple(items), extent)
    if before is not None:
        wanted = set(items)
        stay = frozenset(n for n, edge in enumerate(before.edges) if edge in wanted)
        session.edges_changing.emit(stay)
    finish = _keeping(session, photo, source, before, action, "refining edges")
    return Step("refining edges", job, finish)


def removing_edges(session: Workspace, numbers: Sequence[int]) -> Step[EdgeSet, EdgeSet]:
    """Step of :meth:`Session.remove_edges`."""
    found = session.required_edges()
    left = [edge for number, edge in enumerate(found.edges) if number not in set(numbers)]
    return setting_edges(session, left, plane=stack_index(found.plane))


def joined(before: EdgeSet | None, now: EdgeSet | None, items: Sequence[Item]) -> tuple[Item, ...]:
    """The present edges with the changes that made `items` of the edges before."""
    old, new = set(before.edges if before else ()), set(items)
    present = now.edges if now else ()
    stay = [edge for edge in present if edge not in old or edge in new]
    return (*stay, *(item for item in items if item not in old and item not in set(present)))


def _keeping(
    session: Workspace,
    photo: ImageLayer,
    source: Source,
    before: EdgeSet | None,
    action: Action,
    title: str,
) -> Callable[[EdgeSet], Effects[EdgeSet]]:
    """Keep the edges found; if others were drawn meanwhile, those too, by one step more."""

    @at_once
    def finish(found: EdgeSet) -> EdgeSet:
        state = session.state_of(photo)
        now = state.edges
        if now is None or now is before or now.plane != found.plane:
            session.commit(photo, state.after(action).with_edges(found))
        else:
            items = joined(before, now, found.edges)
            again = Action.of("set_edges", items=items, plane=stack_index(found.plane))
            job = jobs.refining_edge_set(source, found.plane, items, found.extent)
            session.start(Step(title, job, _keeping(session, photo, source, now, again, title)))
        return found

    return finish
