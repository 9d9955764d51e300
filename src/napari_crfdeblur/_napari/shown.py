"""What the edge layer of a photo shows: shapes that are edges, and those that will be."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from napari.layers import Shapes

from .._typing import FloatArray
from ..edges import Edge
from .session.state import EdgeSet
from .session.step import Effects, Step

ShapeMark: TypeAlias = tuple[int, bytes, Edge | None]
"""Number and vertices of a shape, and its edge if it has one already."""


@dataclass(slots=True, eq=False)
class Shown:
    """What the edge layer of a photo shows.

    Parameters
    ----------
    layer : Shapes
        The layer.
    edges : EdgeSet or None
        Edges that were shown last.
    known : dict of bytes to Edge
        Which edge each shape stands for, by its vertices.
    made : dict of bytes to Edge
        What came of shapes that were drawn since, once they are refined.
    refused : bool
        Whether there are shapes that cannot be edges; they go when the edges are shown next.
    """

    layer: Shapes
    edges: EdgeSet | None = None
    known: dict[bytes, Edge] = field(default_factory=dict)
    made: dict[bytes, Edge] = field(default_factory=dict)
    refused: bool = False

    def shapes(self) -> list[ShapeMark]:
        """All shapes of the layer."""
        keys = [_key(vertices) for vertices in self.layer.data]
        return [(n, key, self.known.get(key) or self.made.get(key)) for n, key in enumerate(keys)]

    def pending(self, found: Sequence[Edge]) -> list[ShapeMark]:
        """Shapes that were drawn, but are not among the edges yet; none if they were refused."""
        drawn = [] if self.refused else self.shapes()
        return [
            (number, key, edge)
            for number, key, edge in drawn
            if key not in self.known and (edge is None or edge not in found)
        ]

    def shows(
        self, edges: EdgeSet | None, written: Sequence[FloatArray], pending: Sequence[ShapeMark]
    ) -> None:
        """Note that the layer shows these edges now, by these vertices, and what is pending."""
        self.made = {key: edge for _, key, edge in pending if edge is not None}
        self.known = dict(zip(map(_key, written), edges.edges if edges else (), strict=True))
        self.edges, self.refused = edges, False

    def noting(
        self, step: Step[EdgeSet, EdgeSet], keys: Sequence[bytes], places: Sequence[int]
    ) -> Step[EdgeSet, EdgeSet]:
        """The same step; what came of each shape is noted before the edges are kept."""

        def finish(found: EdgeSet) -> Effects[EdgeSet]:
            edges = {key: found.edges[place] for key, place in zip(keys, places, strict=True)}
            self.made |= {key: edge for key, edge in edges.items() if key not in self.known}
            return (yield from step.finish(found))

        return replace(step, finish=finish)


def _key(vertices: FloatArray) -> bytes:
    return np.asarray(vertices, dtype=np.float64).tobytes()
