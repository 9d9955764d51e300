"""Take the pictures of the napari pages again, in a real window on a real or virtual screen.

    python docs/screenshots.py [FOLDER]

The bundled sample, the widgets and their defaults do the work. The pictures go to docs/images
unless another folder is given. Without a screen: ``make screenshots``.
"""

import os
import sys
from collections.abc import Callable, Sequence
from math import dist
from pathlib import Path
from typing import Any

os.environ["NAPARI_CONFIG"] = ""  # napari's own defaults, whatever those of the user are

import napari
import numpy as np
from PIL import Image
from qtpy.QtCore import Qt
from qtpy.QtWidgets import QApplication, QDockWidget, QMainWindow

Point = tuple[float, float]

PLUGIN, SAMPLE = "napari-crfdeblur", "blurred_photo"
WINDOW, WIDGET = (1500, 950), 430  # pixels: size of the window, width of a widget
COLORS = 255  # of a picture: enough for the eye, at a third of the size
TURNS = 40  # of the event loop, until all is drawn
# Parts of the sample, (row, column) of their middle.
SHOP, HOUSE, CAFE = (390.0, 390.0), (330.0, 390.0), (430.0, 400.0)
DOOR, CORNER = (470.0, 460.0), (190.0, 115.0)


class Studio:
    """A viewer with the sample photo, and a folder for its pictures.

    Parameters
    ----------
    folder : Path
        Where the pictures go.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._frames: list[QDockWidget] = []
        self.viewer = napari.Viewer()
        self.viewer.window.resize(*WINDOW)
        (self.photo,) = self.viewer.open_sample(PLUGIN, SAMPLE)
        self.draw()

    def widget(self, name: str) -> Any:
        """Show a widget of the plugin, alone."""
        for frame in self._frames:
            frame.hide()
        self.viewer.window.resize(*WINDOW)
        frame, dock = self.viewer.window.add_plugin_dock_widget(PLUGIN, name)
        frame.show()
        self._frames.append(frame)
        self.draw()
        window = frame.parentWidget()
        if isinstance(window, QMainWindow):
            window.resizeDocks([frame], [WIDGET], Qt.Orientation.Horizontal)
        self.draw()
        return dock

    def look(self, middle: Point | None = None, zoom: float = 1.0) -> None:
        """Show the whole photo, or the part about a point."""
        if middle is None:
            self.viewer.fit_to_view(layers=[self.photo])
        else:
            camera = self.viewer.scene.camera
            camera.center, camera.zoom = (0.0, *middle), zoom
        self.draw()

    def show(self, *kinds: str) -> None:
        """Show the photo and what was made of it of these kinds, and nothing else."""
        names = {f"{self.photo.name} [{kind}]" for kind in kinds}
        for layer in self.viewer.layers:
            layer.visible = layer is self.photo or layer.name in names
        self.draw()

    def draw(self) -> None:
        """Let napari and Qt draw what there is to draw."""
        for _ in range(TURNS):
            QApplication.processEvents()

    def wait(self, done: Callable[[], bool]) -> None:
        """Let the window work until something is done."""
        while not done():
            QApplication.processEvents()
        self.draw()

    def take(self, name: str) -> None:
        """Take a picture of the window."""
        self.draw()
        self._save(name, self.viewer.screenshot(canvas_only=False, flash=False))

    def take_details(self, name: str, kinds: Sequence[str], size: tuple[int, int]) -> None:
        """Take one part of the photo as it is and in each of these results, side by side."""
        pictures = []
        for kind in ("", *kinds):
            self.show(kind)
            pictures.append(self.viewer.screenshot(size=size, canvas_only=True, flash=False))
        self._save(name, np.concatenate(pictures, axis=1))

    def _save(self, name: str, pixels: np.ndarray) -> None:
        """Write a picture with so few colors that its page loads fast."""
        picture = Image.fromarray(pixels[..., :3])
        few = picture.quantize(COLORS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        path = self._folder / f"napari-{name}.png"
        few.save(path, optimize=True)
        print(f"{path}: {picture.width} x {picture.height}, {path.stat().st_size // 1000} kB")


def whole(studio: Studio) -> None:
    """The photo as it is opened, and all in one."""
    studio.look()
    studio.take("open")
    dock = studio.widget("Deblur (all in one)")
    dock.run(block=True)
    studio.look()
    studio.take("deblur")


def edges(studio: Studio) -> None:
    """Edges found; one of them selected."""
    dock = studio.widget("1 Edges")
    dock.run(block=True)
    found = dock.session.state.edges
    upright = {source.edge for source in found.groups[0].sources}
    dock.session.drawing.choose([min(upright, key=lambda n: dist(found.edges[n].start, DOOR))])
    studio.look(SHOP, 2.2)
    studio.take("edges")
    dock.session.drawing.choose([])


def response(studio: Studio) -> None:
    """The response estimated, in both themes."""
    dock = studio.widget("2 Response")
    dock.run(block=True)
    studio.look()
    studio.take("response")
    studio.viewer.theme = "light"
    studio.take("light")
    studio.viewer.theme = "dark"


def blur(studio: Studio) -> None:
    """The PSF estimated, and seen beside the photo."""
    dock = studio.widget("3 Blur")
    dock.run(block=True)
    studio.show("PSF")
    studio.look(CORNER, 2.2)
    studio.take("blur")


def tuning(studio: Studio) -> None:
    """The response tuned too far, with a preview."""
    dock = studio.widget("2 Response")
    studio.show()
    studio.look(HOUSE, 1.7)
    dock.tuning.previews = True
    dock.tuning.tune(gamma=1.6)
    studio.draw()
    studio.wait(lambda: dock.runner.idle)
    studio.take("tuning")
    dock.tuning.on = False


def restore(studio: Studio) -> None:
    """The photo restored, and compared with gamma 2.2."""
    dock = studio.widget("4 Restore")
    dock.run(block=True)
    studio.wait(lambda: dock.runner.idle)
    studio.show("deblurred")
    studio.look(SHOP, 2.2)
    studio.take("restore")
    dock.session.compare_with()
    studio.look(CAFE, 3.0)
    studio.take_details("compare", ["deblurred, gamma 2.2", "deblurred"], (420, 480))


def batch(studio: Studio) -> None:
    """What can be done with many photos, and exported."""
    dock = studio.widget("Batch and export")
    studio.show("deblurred")
    studio.look()
    dock.choose([studio.photo])
    studio.take("batch")


def main(folder: Path) -> None:
    """Take all pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for scenes in ([whole], [edges, response, blur, tuning, restore, batch]):
        studio = Studio(folder)
        for scene in scenes:
            scene(studio)
        studio.viewer.close()


if __name__ == "__main__":
    given = sys.argv[1:]
    main(Path(given[0]) if given else Path(__file__).parent / "images")
