"""Plots in a widget: cleared, drawn by the core on an Axes, and colored like napari."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from magicgui.widgets import Container
from magicgui.widgets.bases import Widget
from napari.components import ViewerModel
from napari.utils.theme import get_theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HEIGHT = 210  # pixels: a plot that can be read, with room for the controls


class Plot(Container[Widget]):
    """One pair of axes as a widget.

    Parameters
    ----------
    viewer : napari.components.ViewerModel
        Whose theme gives the colors; the plot follows a change of it.
    draw : callable
        Draws the present state on cleared axes.
    height : int
        In pixels.
    """

    def __init__(
        self, viewer: ViewerModel, draw: "Callable[[Axes], None]", *, height: int = HEIGHT
    ) -> None:
        # matplotlib takes a third of a second to load: only widgets with plots wait for it.
        from matplotlib.backends.backend_qtagg import FigureCanvasQTAgg
        from matplotlib.figure import Figure

        super().__init__(labels=False)
        self._viewer, self._draw = viewer, draw
        self.figure = Figure(layout="constrained")
        self.axes = self.figure.add_subplot()
        self.canvas = FigureCanvasQTAgg(self.figure)
        self.canvas.setMinimumHeight(height)
        self.native.layout().addWidget(self.canvas)
        viewer.events.theme.connect(self.redraw)
        self.redraw()

    def redraw(self, _: Any = None) -> None:
        """Draw again: another state, or another theme."""
        self.axes.clear()
        self._draw(self.axes)
        self._colored()
        self.canvas.draw_idle()

    def _colored(self) -> None:
        theme = get_theme(self._viewer.theme)
        ground, ink = theme.canvas.as_hex(), theme.text.as_hex()
        self.figure.set_facecolor(theme.background.as_hex())
        self.axes.set_facecolor(ground)
        self.axes.tick_params(colors=ink, which="both")
        for spine in self.axes.spines.values():
            spine.set_color(theme.secondary.as_hex())
        texts = [self.axes.title, self.axes.xaxis.label, self.axes.yaxis.label, *self.axes.texts]
        legend = self.axes.get_legend()
        if legend is not None:
            legend.get_frame().set_alpha(0)
            texts += legend.get_texts()
        for text in texts:
            text.set_color(ink)
