"""Further photos of the same camera, whose edges add to those of the photo at work."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from magicgui.widgets import CheckBox, Container, PushButton, Select
from magicgui.widgets.bases import Widget
from napari.layers import Image as ImageLayer

from ..pixels import KEY, unwrapped
from ..session.facade import Session
from .forms import tight

HEIGHT = 70  # pixels of the list


class FurtherPhotos(Container[Widget]):
    """A choice of layers and files, hidden until it is asked for.

    Parameters
    ----------
    session : Session
        Whose photo is at work.
    photos : callable
        Gives the image layers that can be photos, by name.
    add : PushButton
        Button that asks for files.
    """

    def __init__(
        self,
        session: Session,
        photos: Callable[[], list[tuple[str, ImageLayer]]],
        add: PushButton,
    ) -> None:
        super().__init__(labels=False)
        self.margins = (0, 0, 0, 0)
        self._session, self._photos = session, photos
        self._paths: list[Path] = []
        self.pool = CheckBox(
            text="with further photos of the same camera",
            value=False,
            tooltip="their edges add to those of this photo, if they were taken with the same "
            "settings",
        )
        self.choice = Select(
            choices=self._offered,
            tooltip="photos of the same camera; edges that they have in this session are used, "
            "otherwise they are found automatically",
        )
        self.choice.native.setMaximumHeight(HEIGHT)
        self._box = tight(self.choice, add, visible=False)
        self.pool.changed.connect(self._show)
        self.extend([self.pool, self._box])

    @property
    def chosen(self) -> list[ImageLayer | Path]:
        """The photos whose edges are used, too."""
        return list(self.choice.value) if self.pool.value else []

    @chosen.setter
    def chosen(self, photos: Sequence[ImageLayer | Path | str]) -> None:
        photos = [Path(p) if isinstance(p, str) else unwrapped(p) for p in photos]
        self.add_files([photo for photo in photos if isinstance(photo, Path)])
        self.pool.value = bool(photos)
        self.choice.value = photos

    def add_files(self, paths: Sequence[Path]) -> None:
        """Offer files, and choose them beside those that are chosen."""
        chosen = list(self.choice.value)
        self._paths += [path for path in paths if path not in self._paths]
        self.refresh()
        self.choice.value = [*chosen, *(path for path in paths if path not in chosen)]

    def refresh(self) -> None:
        """Offer what there is now; the chosen ones stay if they still are."""
        self.choice.reset_choices()

    def _offered(self, _: Any) -> list[tuple[str, ImageLayer | Path]]:
        """Photos beside the one at work: layers that were not made here, and added files."""
        layers = [
            (name, layer)
            for name, layer in self._photos()
            if layer is not self._session.photo and KEY not in layer.metadata
        ]
        return [*layers, *((str(path), path) for path in self._paths)]

    def _show(self) -> None:
        self._box.visible = bool(self.pool.value)
