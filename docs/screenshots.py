"""Take the pictures of the napari pages again, in a real window on a real or virtual screen.

    python docs/screenshots.py [FOLDER]

The bundled sample, the widgets and their defaults do the work. The pictures go to docs/images
unless another folder is given. Without a screen: ``make screenshots``.
"""

import os
import sys
from collections.abc import Callable, Sequence
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
CAFE, OPERA = (430.0, 400.0), (190.0, 660.0)  # (row, column) in the sample


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
        """Show a widget of the plugin alone, once what the others do is done."""
        for frame in self._frames:
            frame.hide()
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
            self.viewer.camera.center = (0.0, *middle)
            self.viewer.camera.zoom = zoom
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


def take_all(studio: Studio) -> None:
    """Go through the workflow, and take its pictures."""
    studio.look()
    studio.take("open")
    edges(studio)
    response(studio)
    blur(studio)
    restore(studio)
    batch(studio)


def edges(studio: Studio) -> None:
    """Edges found; one of them selected."""
    dock = studio.widget("1 Edges")
    dock.run(block=True)
    found = dock.session.state.edges
    upright = found.groups[0]
    numbers = sorted({source.edge for source in upright.sources})
    dock.session.selected = numbers[0]
    studio.look(CAFE, 2.2)
    studio.take("edges")


def response(studio: Studio) -> None:
    """The response estimated; tuned by hand; in the light theme."""
    dock = studio.widget("2 Response")
    dock.run(block=True)
    studio.look()
    studio.take("response")
    studio.viewer.theme = "light"
    studio.take("light")
    studio.viewer.theme = "dark"


def blur(studio: Studio) -> None:
    """The PSF estimated; then the response tuned by hand, with a preview."""
    dock = studio.widget("3 Blur")
    dock.run(block=True)
    psf = studio.viewer.layers[f"{studio.photo.name} [PSF]"]
    studio.viewer.fit_to_view(layers=[studio.photo, psf])
    studio.take("blur")
    dock = studio.widget("2 Response")
    studio.show()
    studio.look(CAFE, 1.6)
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
    dock.session.compare_with()
    studio.wait(lambda: dock.runner.idle)
    studio.show("deblurred")
    studio.look()
    studio.take("restore")
    studio.look(CAFE, 3.0)
    studio.take_details("compare", ["deblurred, gamma 2.2", "deblurred"], (420, 480))
    studio.show("deblurred")


def batch(studio: Studio) -> None:
    """What can be done with many photos, and exported."""
    dock = studio.widget("Batch and export")
    studio.look()
    dock.choose([studio.photo])
    studio.take("batch")


def main(folder: Path) -> None:
    """Take all pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    studio = Studio(folder)
    take_all(studio)
    studio.viewer.close()


if __name__ == "__main__":
    given = sys.argv[1:]
    main(Path(given[0]) if given else Path(__file__).parent / "images")
