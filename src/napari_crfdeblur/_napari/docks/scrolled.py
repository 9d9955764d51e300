"""A widget that can be lower than what it holds: on small screens it scrolls."""

from qtpy.QtCore import QEvent, QObject, QSize, Qt
from qtpy.QtWidgets import QFrame, QScrollArea, QSizePolicy, QVBoxLayout, QWidget


class Scrolled(QScrollArea):
    """Scrolls up and down; as wide as what it holds.

    Parameters
    ----------
    content : QWidget
        What is shown.
    """

    def __init__(self, content: QWidget) -> None:
        super().__init__()
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setWidget(content)
        layout = content.layout()
        if isinstance(layout, QVBoxLayout) and not _grows(layout):
            layout.addStretch()  # or the room that is left would come between the controls

    def sizeHint(self) -> QSize:
        """As high as the content would like to be, not only a few lines."""
        content = self.widget()
        return super().sizeHint() if content is None else content.sizeHint()

    def eventFilter(self, watched: QObject | None, event: QEvent | None) -> bool:
        """Follow the content when it gets wider: a plot, or a section that was opened."""
        content, bar = self.widget(), self.verticalScrollBar()
        asks = event is not None and event.type() == QEvent.Type.LayoutRequest
        if asks and content is not None and bar is not None:
            self.setMinimumWidth(content.minimumSizeHint().width() + bar.sizeHint().width())
        return super().eventFilter(watched, event)


def _grows(layout: QVBoxLayout) -> bool:
    """Whether something in a layout, a plot or a list, makes use of all the room there is."""
    widgets = [item.widget() for i in range(layout.count()) if (item := layout.itemAt(i))]
    expanding = QSizePolicy.Policy.Expanding
    return any(w is not None and w.sizePolicy().verticalPolicy() == expanding for w in widgets)
