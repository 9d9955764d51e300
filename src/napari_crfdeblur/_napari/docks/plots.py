"""Plots in a widget: cleared, drawn by the core on an Axes, and colored like napari."""

import sys
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any
from weakref import ref

from magicgui.widgets import Container
from magicgui.widgets.bases import Widget
from napari.components import ViewerModel
from napari.utils.theme import get_theme
from qtpy.QtCore import QEvent, QObject, QTimer
from qtpy.QtWidgets import QSizePolicy

from ...report.colors import DARK, PAPER, Palette
from ..tasks import load_beside

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MATPLOTLIB = "matplotlib.backends.backend_qtagg"
HEIGHT = 210  # pixels: a plot that can be read, with room for the controls


def palette_of(viewer: ViewerModel) -> Palette:
    """Colors for curves that can be read on the ground of the theme."""
    return DARK if get_theme(viewer.theme).type == "dark" else PAPER


class Plot(Container[Widget]):
    """One pair of axes as a widget.

    It is drawn when the window has nothing else to do and it can be seen, plots one by one,
    so that many changes at once cost no more than one.

    Parameters
    ----------
    viewer : napari.components.ViewerModel
        Whose theme gives the colors; the plot follows a change of it.
    draw : callable
        Draws the present state on cleared axes; may return artists that :meth:`move` changes.
    height : int
        In pixels.
    """

    def __init__(
        self,
        viewer: ViewerModel,
        draw: "Callable[[Axes], Sequence[Artist] | None]",
        *,
        height: int = HEIGHT,
    ) -> None:
        super().__init__(labels=False)
        self._viewer, self._draw = viewer, draw
        self._moving: list[Artist] = []
        self._ground: Any = None
        self._arranged: Any = None
        self._stale = True
        self._built = False
        self.margins = (0, 0, 0, 0)
        self.native.setMinimumHeight(height)
        # Plots take the room that controls leave.
        self.native.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self._shown = _Shown(self.native, ref(self))
        viewer.events.theme.connect(self.redraw)
        load_beside(MATPLOTLIB, self.redraw)

    def _build(self) -> None:
        """Make the figure: when it is needed, since matplotlib takes its time to load."""
        from matplotlib.backends.backend_qtagg import FigureCanvasQTAgg
        from matplotlib.figure import Figure

        self._figure = Figure(facecolor=get_theme(self._viewer.theme).background.as_hex())
        self._axes = self._figure.add_subplot()
        self.canvas = FigureCanvasQTAgg(self._figure)
        # As large as there is room: matplotlib's 640 x 480 would make the window wider.
        self.canvas.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)
        self.canvas.mpl_connect("draw_event", self._drawn)
        self.canvas.installEventFilter(self._shown)  # its size follows that of the widget
        self.native.layout().addWidget(self.canvas)
        self._built = True

    @property
    def axes(self) -> "Axes":
        """The axes with the present state on them."""
        self._catch_up()
        return self._axes

    @property
    def figure(self) -> "Figure":
        """The figure with the present state on it."""
        self._catch_up()
        return self._figure

    def redraw(self, _: Any = None) -> None:
        """Draw again soon: another state, or another theme."""
        self._stale = True
        _TURNS.wait(self)

    def move(self, change: "Callable[[Sequence[Any]], object]") -> None:
        """Change the artists that move, and only these: quick enough to follow a slider."""
        if self._stale:
            return  # they are about to be drawn as they are by then
        change(self._moving)
        if self._ground is not None:  # else the rest is about to be drawn, and this with it
            self.canvas.restore_region(self._ground)
            self._draw_moving()
            self.canvas.update()

    def paint(self) -> bool:
        """Draw if it can be seen: one piece of the work, and whether there is more to do."""
        if not self.native.isVisible() or MATPLOTLIB not in sys.modules:
            return False
        if self._stale:
            self._catch_up()
            return True
        self.canvas.draw()
        return False

    def _catch_up(self) -> None:
        if not self._stale:
            return
        if not self._built:
            self._build()
        self._stale, self._ground = False, None
        self._axes.clear()
        self._moving = list(self._draw(self._axes) or ())
        for artist in self._moving:
            artist.set_animated(True)
        self._color()
        self._arrange()

    def _arrange(self) -> None:
        """Make room for the labels; half the time of drawing, so only when it is needed."""
        from matplotlib.layout_engine import ConstrainedLayoutEngine

        axes = self._axes
        size = tuple(self._figure.get_size_inches())
        labels = axes.get_title(), axes.get_xlabel(), axes.get_ylabel(), axes.axison
        if (size, labels) != self._arranged and min(size) > 0:  # 0 before it has a place
            self._arranged = size, labels
            ConstrainedLayoutEngine().execute(self._figure)

    def _drawn(self, _: Any) -> None:
        """Keep the picture without what moves, and draw that on top."""
        self._ground = self.canvas.copy_from_bbox(self._figure.bbox)
        self._draw_moving()

    def _draw_moving(self) -> None:
        for artist in self._moving:
            self._axes.draw_artist(artist)

    def _color(self) -> None:
        theme = get_theme(self._viewer.theme)
        ink = theme.text.as_hex()
        self._figure.set_facecolor(theme.background.as_hex())
        self._axes.set_facecolor(theme.canvas.as_hex())
        for axes in (self._axes, *self._axes.child_axes):
            axes.tick_params(colors=ink, which="both")
            for spine in axes.spines.values():
                spine.set_color(theme.secondary.as_hex())
            texts = [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
            legend = axes.get_legend()
            if legend is not None:
                legend.get_frame().set_alpha(0)
                texts += legend.get_texts()
            for text in texts:
                text.set_color(ink)


class _Shown(QObject):
    """Watches a widget: its plot is drawn once it can be seen, and arranged for a new size."""

    def __init__(self, widget: Any, plot: "ref[Plot]") -> None:
        super().__init__(widget)
        self._plot = plot
        widget.installEventFilter(self)

    def eventFilter(self, _: Any, event: Any) -> bool:
        """Ask for a drawing; the event itself goes on."""
        plot = self._plot()
        if plot is not None and event.type() in (QEvent.Type.Show, QEvent.Type.Resize):
            plot.redraw()
        return False


class _Turns:
    """Lets plots be drawn one by one, each in a turn of the event loop of its own."""

    def __init__(self) -> None:
        self._waiting: deque[ref[Plot]] = deque()
        self._timer: QTimer | None = None

    def wait(self, plot: Plot) -> None:
        """Put a plot at the end of the queue, if it is not in it already."""
        if not any(waiting() is plot for waiting in self._waiting):
            self._waiting.append(ref(plot))
        if self._timer is None:
            self._timer = QTimer()
            self._timer.timeout.connect(self._next)
        self._timer.start(0)

    def _next(self) -> None:
        if self._timer is not None and len(self._waiting) <= 1:
            self._timer.stop()
        plot = self._waiting.popleft()() if self._waiting else None
        if plot is not None:
            # The window of a plot can be closed while something still refers to the plot.
            with suppress(RuntimeError):
                if plot.paint():
                    self.wait(plot)


_TURNS = _Turns()
