"""Commands of the menus: open the dock of a step and start it on the selected photo.

If the selected layer is no photo, such as the edges or the PSF that the step before has made,
they go on with the photo at work.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import napari.viewer

PLUGIN = "napari-crfdeblur"


def find_edges(viewer: "napari.viewer.Viewer") -> None:
    """Find the straight edges of the selected photo."""
    _start(viewer, "1 Edges")


def draw_edges(viewer: "napari.viewer.Viewer") -> None:
    """Draw edges on the selected photo by hand."""
    _opened(viewer, "1 Edges").draw()


def estimate_response(viewer: "napari.viewer.Viewer") -> None:
    """Estimate the camera response from the edges of the selected photo."""
    _start(viewer, "2 Response")


def estimate_psf(viewer: "napari.viewer.Viewer") -> None:
    """Estimate the PSF of the selected photo."""
    _start(viewer, "3 Blur")


def deblur(viewer: "napari.viewer.Viewer") -> None:
    """Deblur the selected photo in linear light, all steps in one."""
    _start(viewer, "Deblur (all in one)")


def _start(viewer: "napari.viewer.Viewer", name: str) -> None:
    _opened(viewer, name).run(block=False)


def _opened(viewer: "napari.viewer.Viewer", name: str) -> Any:
    """The dock of this name, in view, with the selected photo chosen."""
    from napari.layers import Image

    frame, dock = viewer.window.add_plugin_dock_widget(PLUGIN, name)
    frame.show()  # one that was closed stays hidden
    frame.raise_()
    layer = viewer.layers.selection.active
    if isinstance(layer, Image) and PLUGIN not in layer.metadata:
        dock.photo = layer
    return dock
