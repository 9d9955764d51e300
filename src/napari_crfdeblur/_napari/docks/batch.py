"""Batch and export: many photos with one response and PSF, scripts, records and files."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from magicgui.widgets import ComboBox, Container, Label, Select
from magicgui.widgets.bases import Widget
from napari.layers import Image as ImageLayer
from napari.layers import Layer
from qtpy.QtWidgets import QApplication

from ...io.images import WRITABLE
from ..pixels import KEY
from ..session.batch import restoring_files, restoring_layers
from ..session.export import EXPORTS, exporting
from ..session.record import repeating_record
from ..session.step import Step
from .base import Dock
from .choices import AUTOMATIC, deconvolvers
from .files import ask_folder, ask_open, ask_open_many, ask_save
from .forms import row
from .strength import DeconvolutionForm


class BatchDock(Dock):
    """Apply the response and the PSF of the session to many photos, and export what was found."""

    def body(self) -> list[Widget]:
        """Layers and files to be deblurred, records and their script, exports."""
        self._method = DeconvolutionForm(deconvolvers(), AUTOMATIC)
        self._layers = Select(
            choices=self._originals,
            tooltip="photos and stacks of the same camera with the same blur; a stack is "
            "deblurred slice by slice",
        )
        self._what = ComboBox(label="export", choices=list(EXPORTS), tooltip="what is written")
        return [
            Label(value="<b>Many photos, one response and PSF</b>"),
            self._method,
            self._layers,
            self.button(
                "Deblur the chosen layers",
                "every chosen layer gets a deblurred one; a bad one is passed over",
                lambda: self.run(block=False),
            ),
            self.button(
                "Deblur files...",
                "choose photos and a folder for the deblurred ones; a bad one is passed over",
                self._ask_files,
            ),
            Label(value="<b>What was done</b>"),
            row(
                self.button("Copy as script", "as Python, to the clipboard", self.copy_script),
                self.button("Repeat...", "do what a record says on this photo", self._repeat),
            ),
            Container(widgets=[self._what]),
            self.button("Export...", "write it to a file", self._ask_export),
        ]

    def refresh(self) -> None:
        """Show the layers that there are, those that were chosen still so."""
        super().refresh()
        self._layers.reset_choices()

    def _originals(self, _: Any) -> list[tuple[str, Layer]]:
        """Photos that were not deblurred already."""
        return [(name, layer) for name, layer in self._photos(None) if KEY not in layer.metadata]

    def step(self) -> Step[Any, Any]:
        """Every chosen layer deblurred."""
        return restoring_layers(self.session, self._layers.value, self._method.method)

    def choose(self, photos: Sequence[ImageLayer]) -> None:
        """Choose the layers to be deblurred."""
        self._layers.value = list(photos)

    def run_files(self, paths: Sequence[Path], folder: Path, block: bool = True) -> Any:
        """Deblur files into a folder; in a thread unless it blocks."""
        method = self._method.method
        return self.begin(lambda: restoring_files(self.session, paths, folder, method), block=block)

    def repeat(self, path: Path, block: bool = True) -> None:
        """Do what a record says on this photo; in a thread unless it blocks."""
        self.begin(lambda: repeating_record(self.session, path), block=block)

    def copy_script(self) -> None:
        """Put what was done on the clipboard, as a Python script."""
        self.attempt(self._copy)

    def export(self, what: str, path: Path, block: bool = True) -> Any:
        """Write a part of the session to a file; in a thread unless it blocks."""
        return self.begin(lambda: exporting(self.session, what, path), block=block)

    def _copy(self) -> None:
        clipboard = QApplication.clipboard()
        if clipboard is not None:
            clipboard.setText(self.session.script())
            self.session.say("the script is on the clipboard")

    def _ask_files(self) -> None:
        paths = ask_open_many(self.native, "Photos of the same camera and blur", WRITABLE)
        folder = ask_folder(self.native, "Folder for the deblurred photos") if paths else None
        if folder is not None:
            self.run_files(paths, folder, block=False)

    def _repeat(self) -> None:
        path = ask_open(self.native, "Record", (".json",))
        if path is not None:
            self.attempt(lambda: self.repeat(path, block=False))

    def _ask_export(self) -> None:
        what = str(self._what.value)
        path = ask_save(self.native, f"Export the {what}", EXPORTS[what][1])
        if path is not None:
            self.export(what, path, block=False)
