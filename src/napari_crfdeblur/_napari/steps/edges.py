"""Steps that change the edges."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...edges import Edge, Line, Rectangle
from .. import jobs
from ..layers import stack_index
from ..state import Action, EdgeSet
from .base import Step, at_once

if TYPE_CHECKING:
    from ..session import Session

Item = Edge | Line | Rectangle


def detecting_edges(
    session: "Session",
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
    action = Action.of("detect_edges", blur_extent=blur_extent, add=add, plane=stack_index(where))

    @at_once
    def finish(found: EdgeSet) -> EdgeSet:
        now = session.state_of(photo).edges
        if now is not before and now is not None and now.plane == where:
            # Drawn while the edges were sought: kept, too.
            return session.do(setting_edges(session, (*now.edges, *found.edges), found.extent))
        session.commit(photo, session.state_of(photo).after(action).with_edges(found))
        return found

    job = jobs.finding_edge_set(source, where, blur_extent, keep)
    return Step("finding edges", job, finish)


def setting_edges(
    session: "Session",
    items: Sequence[Item],
    blur_extent: float | None = None,
    *,
    plane: Sequence[int] | None = None,
) -> Step[EdgeSet, EdgeSet]:
    """Step of :meth:`Session.set_edges`."""
    photo, source = session.source()
    before = session.state.edges
    where = before.plane if plane is None and before is not None else session.plane(plane)
    extent = blur_extent or (before.extent if before else None)
    action = Action.of(
        "set_edges", items=tuple(items), blur_extent=blur_extent, plane=stack_index(where)
    )

    @at_once
    def finish(found: EdgeSet) -> EdgeSet:
        session.commit(photo, session.state_of(photo).after(action).with_edges(found))
        return found

    job = jobs.refining_edge_set(source, where, tuple(items), extent)
    return Step("refining edges", job, finish)
