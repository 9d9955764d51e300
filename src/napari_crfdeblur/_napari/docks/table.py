"""The edges as a table: what is known of each, and why some cannot be used."""

from collections.abc import Sequence
from typing import Any

from magicgui.widgets import Container
from magicgui.widgets.bases import Widget
from psygnal import Signal
from qtpy.QtCore import Qt
from qtpy.QtGui import QColor
from qtpy.QtWidgets import QAbstractItemView, QTableWidget, QTableWidgetItem

from ...edges import Edge
from ...report.content import direction
from ..session.state import EdgeSet
from ..shapes import group_color

HEIGHT = 170  # pixels: five rows and the names of the columns
POLARITY = {1: "rising", -1: "falling", 0: ""}
COLUMNS = {
    "no.": ("number of the edge, as in scripts and in CSV files", 42),
    "group": ("edges of one group have the same orientation, and on the photo the same color", 56),
    "angle": ("direction of the edge in degrees, counterclockwise from the horizontal", 50),
    "polarity": ("rising: brighter below the edge, or to the right of an upright one", 62),
    "intensity": ("recorded intensity of both sides, from 0 to 1, over all channels", 76),
    "width": ("width of the blurred edge in pixels", 50),
    "status": ("good, or why the edge cannot be used", 330),
}

Value = tuple[str, float | str]
"""What a cell shows, and what it is sorted by."""


class EdgeTable(Container[Widget]):
    """All edges, one in each row; a click on the name of a column sorts by it.

    Attributes
    ----------
    picked : Signal
        Emitted with the numbers of the edges in the rows that the user selects.
    """

    picked = Signal(tuple)

    def __init__(self) -> None:
        super().__init__(labels=False)
        self._first: list[QTableWidgetItem] = []
        self.table = QTableWidget(0, len(COLUMNS))
        self.table.setMinimumHeight(HEIGHT)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.table.setWordWrap(False)
        for column, (name, (tooltip, width)) in enumerate(COLUMNS.items()):
            header = QTableWidgetItem(name)
            header.setToolTip(tooltip)
            self.table.setHorizontalHeaderItem(column, header)
            self.table.setColumnWidth(column, width)
        down, across = self.table.verticalHeader(), self.table.horizontalHeader()
        if down is not None and across is not None:  # always there, which Qt's types do not know
            down.setVisible(False)
            across.setStretchLastSection(True)
        self.table.sortByColumn(0, Qt.SortOrder.AscendingOrder)
        self.table.itemSelectionChanged.connect(lambda: self.picked.emit(self.selected))
        self.native.layout().addWidget(self.table)

    @property
    def selected(self) -> tuple[int, ...]:
        """Numbers of the edges whose rows are selected."""
        rows = {item.row() for item in self.table.selectedItems()}
        return tuple(n for n, first in enumerate(self._first) if first.row() in rows)

    @property
    def rows(self) -> list[list[str]]:
        """What the table shows, from top to bottom."""
        rows, columns = range(self.table.rowCount()), range(len(COLUMNS))
        cells = [[self.table.item(row, column) for column in columns] for row in rows]
        return [[cell.text() for cell in row if cell is not None] for row in cells]

    def fill(self, edges: EdgeSet | None) -> None:
        """Show these edges, sorted as before."""
        self.table.blockSignals(True)
        self.table.setSortingEnabled(False)  # or each new cell would move its row
        self.table.setRowCount(0)
        rows = [] if edges is None else _rows(edges)
        self.table.setRowCount(len(rows))
        self._first = []
        for number, (group, values) in enumerate(rows):
            cells = [_Cell(*value) for value in values]
            cells[1].setData(Qt.ItemDataRole.DecorationRole, QColor(group_color(group)))
            cells[-1].setToolTip(values[-1][0])
            for column, cell in enumerate(cells):
                self.table.setItem(number, column, cell)
            self._first.append(cells[0])
        self.table.setSortingEnabled(True)
        self.table.blockSignals(False)

    def select(self, number: int | None) -> None:
        """Select the row of an edge and scroll to it, without telling anybody."""
        if number in self.selected:
            return
        self.table.blockSignals(True)
        self.table.clearSelection()
        if number is not None and number < len(self._first):
            self.table.selectRow(self.table.row(self._first[number]))
            self.table.scrollToItem(self._first[number])
        self.table.blockSignals(False)


class _Cell(QTableWidgetItem):
    """Text that is sorted by a value of its own."""

    def __init__(self, text: str, value: float | str) -> None:
        super().__init__(text)
        self.value: Any = value

    def __lt__(self, other: Any) -> bool:
        return bool(self.value < other.value)


def summary(edges: EdgeSet | None) -> str:
    """How many edges there are, in words."""
    if edges is None or not edges.edges:
        return "no edges yet"
    good = sum(edge.good for edge in edges.edges)
    orientations = _counted(len(edges.groups), "orientation")
    text = f"{_counted(good, 'good edge')} in {orientations}" if good else "no good edges"
    rejected = len(edges.edges) - good
    return f"{text}, {rejected} rejected" if rejected else text


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'s' * (count != 1)}"


def _rows(edges: EdgeSet) -> list[tuple[int, Sequence[Value]]]:
    """The group of each edge, and its cells."""
    groups, levels = edges.group_numbers, edges.intensity_ranges
    return [
        (groups[number], _values(number, edge, groups[number], levels.get(number)))
        for number, edge in enumerate(edges.edges)
    ]


def _values(
    number: int, edge: Edge, group: int, levels: tuple[float, float] | None
) -> Sequence[Value]:
    angle = direction(edge)
    return (
        (str(number), number),
        (str(group) if group >= 0 else "", group),
        (angle, int(angle.rstrip("°"))),
        (POLARITY[edge.polarity], edge.polarity),
        ("{:.2f} - {:.2f}".format(*levels) if levels else "", levels[0] if levels else -1.0),
        (f"{edge.width:.1f}" if edge.width else "", edge.width),
        (edge.status.value, edge.status.value),
    )
