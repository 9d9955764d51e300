"""What all widgets have in common: the photo on top, progress and messages below."""

from abc import abstractmethod
from collections.abc import Callable
from html import escape
from typing import Any, TypeAlias

from magicgui.widgets import ComboBox, Container, FloatSpinBox, ProgressBar, PushButton
from magicgui.widgets.bases import Widget
from napari import current_viewer
from napari.components import ViewerModel
from napari.layers import Image as ImageLayer
from napari.layers import Layer
from napari.utils.theme import get_theme
from psygnal import SignalInstance

from ...errors import REFUSALS, in_words
from ..outputs import RESTORED
from ..pixels import KEY
from ..session.edges import detecting_edges
from ..session.facade import Session
from ..session.step import Level, Message, Step
from ..tasks import Make, Runner
from .forms import sentence
from .keys import FIND_EDGES, FLIP, UNDO_EDGES, Keys
from .lifetime import Lifetime
from .scrolled import Scrolled

# Amber and red that can be read on a dark and on a light ground.
SHADES = {
    "dark": {Level.DOUBT: "#f2b544", Level.ERROR: "#ff8a80"},
    "light": {Level.DOUBT: "#8a5a00", Level.ERROR: "#b71c1c"},
}


Followed: TypeAlias = list[tuple[SignalInstance, Callable[..., object]]]


class Dock(Container[Widget]):
    """A widget: a photo, the controls of one part of the path, progress, and a message.

    Parameters
    ----------
    napari_viewer : napari.components.ViewerModel, optional
        By default the viewer that is open.

    Raises
    ------
    ValueError
        No viewer is given and none is open.
    """

    def __init__(self, napari_viewer: ViewerModel | None = None) -> None:
        viewer = napari_viewer if napari_viewer is not None else current_viewer()
        if viewer is None:
            raise ValueError("expected a viewer, got none and none is open")
        super().__init__(labels=False)
        self.session = Session.of(viewer)
        self.runner = Runner.of(self.session)
        self._photo = ComboBox(
            label="photo",
            choices=self._photos,
            nullable=True,
            value=None,
            tooltip="image layer to work on; its results are named after it",
        )
        self._white = FloatSpinBox(
            label="white level (0: automatic)",
            min=0,
            max=1e12,
            step=1,
            value=0,
            tooltip="pixel value of the brightest light that the camera can record; "
            "0: the full scale of the kind of number (255, 65535, or 1 for floats)",
        )
        self._bar = ProgressBar(visible=False, tooltip="how far the step is")
        self._cancel = PushButton(
            text="Cancel", visible=False, tooltip="stop the step; nothing has changed then"
        )
        self._stage = sentence()
        self._message = sentence()
        self._buttons: list[PushButton] = []
        progress: list[Widget] = [self._bar, self._cancel]
        self.controls: Container[Widget] = Container(labels=False)
        self.controls.append(Container(widgets=[self._photo, self._white]))
        self.controls.extend(self.body())
        self.controls.append(Container(widgets=progress, layout="horizontal", labels=False))
        self.controls.append(self._stage)
        self.controls.append(self._message)
        self.margins = (0, 0, 0, 0)
        self.native.layout().addWidget(Scrolled(self.controls.native))
        self._connect()
        self.refresh()
        self._keys = Keys.of(self.session.viewer)
        self._lifetime = Lifetime(self.native, self._opened, self._closed)

    @abstractmethod
    def body(self) -> list[Widget]:
        """Controls between the photo and the progress."""

    @abstractmethod
    def step(self) -> Step[Any, Any]:
        """What :meth:`run` does, with the values of the controls."""

    @property
    def photo(self) -> ImageLayer | None:
        """The photo of the session."""
        return self.session.photo

    @photo.setter
    def photo(self, layer: ImageLayer | None) -> None:
        self.session.photo = layer

    @property
    def busy(self) -> bool:
        """Whether a step of any widget of the session is under way."""
        return self.runner.busy

    def run(self, block: bool = True) -> Any:
        """Do what the main button does.

        Parameters
        ----------
        block : bool
            Wait for the end and return the result, errors raised; otherwise work in a thread,
            errors shown.
        """
        return self.begin(self.step, block=block)

    def cancel(self) -> None:
        """Stop what is under way; nothing has changed then."""
        self.runner.cancel()

    def begin(self, make: Make, *following: Make, block: bool = False) -> Any:
        """Run the step that `make` gives, and then those that follow.

        In a thread, with errors shown, unless it blocks; then the result of the first is returned.
        """
        if block:
            result = self.session.do(make())
            for later in following:
                self.session.do(later())
            return result
        self._message.value = ""
        self.attempt(lambda: self.runner.start(make(), *following))
        return None

    def attempt(self, act: Callable[[], Any]) -> None:
        """Do something quick; what the photo does not permit is shown as a message."""
        try:
            act()
        except REFUSALS as error:
            self.session.say(in_words(error), Level.ERROR)

    def button(self, text: str, tooltip: str, act: Callable[[], Any]) -> PushButton:
        """A button that starts a step, and is off while one is under way."""
        button = PushButton(text=text, tooltip=tooltip)
        button.changed.connect(lambda: act())
        self._buttons.append(button)
        return button

    def shortcuts(self) -> dict[str, Callable[[], Any]]:
        """Keys of the viewer that work while the widget is open, and what they do."""
        session = self.session
        return {
            FLIP: lambda: self.attempt(session.flip),
            FIND_EDGES: lambda: self.begin(lambda: detecting_edges(session)),
            UNDO_EDGES: lambda: self.attempt(session.undo_edges),
        }

    def refresh(self) -> None:
        """Show the photo of the session and how far its step is."""
        with self._photo.changed.blocked(), self._white.changed.blocked():
            self._photo.reset_choices()
            self._photo.value = self.session.photo
            self._white.value = self.session.white or 0
        self._show_progress()

    def _photos(self, _: Any) -> list[tuple[str, Layer]]:
        """Image layers that can be photos: not the linear light, PSFs and previews made here."""
        images = [layer for layer in self.session.viewer.layers if type(layer) is ImageLayer]
        kinds = (RESTORED, None)
        return [(i.name, i) for i in images if i.metadata.get(KEY, {}).get("kind") in kinds]

    def followed(self) -> Followed:
        """Signals that the widget shows, as long as it is there, and what each of them calls."""
        return [
            (self.session.photo_changed, self.refresh),
            (self.session.said, self._say),
            (self.runner.changed, self._show_progress),
        ]

    def _connect(self) -> None:
        layers = self.session.viewer.layers
        layers.events.inserted.connect(self._inserted)
        layers.events.removed.connect(self.refresh)
        for layer in layers:
            layer.events.name.connect(self.refresh)
        self._photo.changed.connect(self._choose_photo)
        self._white.changed.connect(self._choose_white)
        self._cancel.changed.connect(self.cancel)
        self._follow()

    def _follow(self) -> None:
        for signal, show in self.followed():
            signal.connect(show, unique=True)

    def _opened(self) -> None:
        self._follow()
        self._keys.add(self, self.shortcuts())

    def _closed(self) -> None:
        """Stop what is under way: without a widget nobody could see or cancel it."""
        for signal, show in self.followed():
            signal.disconnect(show, missing_ok=True)  # labels and bars may be gone already
        self._keys.remove(self)
        if not self._keys.in_use:
            self.runner.cancel()

    def _inserted(self, event: Any) -> None:
        event.value.events.name.connect(self.refresh)
        self.refresh()

    def _choose_photo(self, layer: ImageLayer | None) -> None:
        self.attempt(lambda: setattr(self.session, "photo", layer))

    def _choose_white(self, value: float) -> None:
        self.attempt(lambda: setattr(self.session, "white", value or None))

    def _show_progress(self) -> None:
        busy, progress = self.runner.busy, self.runner.progress
        self._bar.visible = self._cancel.visible = self._stage.visible = busy and self.visible
        for button in self._buttons:
            button.enabled = not busy
        if busy:
            self._bar.max = progress.total if progress else 0  # 0: somewhere between
            self._bar.value = progress.done if progress else 0
            title = str(self.runner.title)
            self._stage.value = f"{title}: {progress.stage}" if progress else title

    def _say(self, message: Message) -> None:
        self._message.value = self.shaded(message.text, message.level)

    def shaded(self, text: str, level: Level) -> str:
        """A message as rich text, in the color of its level."""
        shade = SHADES[get_theme(self.session.viewer.theme).type].get(level)
        text = escape(text).replace("\n", "<br>")
        return f'<span style="color: {shade}">{text}</span>' if shade else text
