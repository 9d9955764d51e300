"""Changes of the PSF by hand: faint parts cleared, centered, painted on; all can be undone."""

from collections.abc import Callable, Iterator
from typing import Any, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
from napari.layers import Image as ImageLayer
from napari.layers import Layer

from .._typing import FloatArray
from ..errors import REFUSALS, CrfDeblurError, in_words
from ..pipeline.intermediates import PLANE
from ..psf import PsfEstimate, PsfField, PsfStatus, centered, cleared
from . import outputs
from .session.blur import setting_psf
from .session.step import Level
from .session.workspace import Workspace

DEPTH = 50  # changes that can be undone
MANY = "the PSF differs from part to part: look for one of the whole photo before you edit it"
VOLUME = "this PSF has 3 dimensions: edit it where it comes from, and use it again"
Known: TypeAlias = tuple[PsfEstimate, PsfField | None]
PAINT, ERASE = "Control", "Shift"


class PsfEditing:
    """Changes the PSF of a session, keeps those before, and lets the mouse paint on its layer.

    Every change is a step of the session, so that the layer and the record follow.

    Parameters
    ----------
    session : Session
        Whose PSF is edited.
    """

    def __init__(self, session: Workspace) -> None:
        self._session = session
        self._known: WeakKeyDictionary[Layer, Known] = WeakKeyDictionary()
        self._before: WeakKeyDictionary[Layer, list[Known]] = WeakKeyDictionary()
        self._undoing = self._painting = False
        self._canvas: ImageLayer | None = None
        self._remember()

    def follow(self) -> None:
        """Note another PSF of the session, and let it be painted on if the last one was."""
        self._remember()
        self._attach()

    def use(self, psf: FloatArray, field: PsfField | None = None) -> None:
        """Take another PSF, or those of all parts."""
        self._session.do(setting_psf(self._session, psf, field=field))

    def _change(self, psf: FloatArray) -> None:
        """Take the present PSF with a change."""
        edited = self._session.required_psf().status is not PsfStatus.GIVEN
        self._session.do(setting_psf(self._session, psf, edited=edited))

    def clear(self, share: float) -> None:
        """Set to zero what is below a share, 0 to 1, of the peak."""
        self._change(cleared(self._editable(), share))

    def center(self) -> None:
        """Move the center of mass to the center pixel."""
        self._change(centered(self._editable()))

    def _editable(self) -> FloatArray:
        """The PSF, if it is one picture."""
        psf = self._session.required_psf().psf
        if self._session.state.field is not None:
            raise CrfDeblurError(MANY)
        if psf.ndim != PLANE:
            raise CrfDeblurError(VOLUME)
        return psf

    def undo(self) -> None:
        """Go back to the PSF before the last change."""
        photo, _ = self._session.source()
        if not self._before.get(photo):
            raise CrfDeblurError("there is no change of the PSF to undo")
        self._undoing = True
        try:
            psf, field = self._before[photo].pop()
            edited = psf.status is not PsfStatus.GIVEN
            self._session.do(setting_psf(self._session, psf.psf, edited=edited, field=field))
        finally:
            self._undoing = False

    @property
    def painting(self) -> bool:
        """Whether the mouse paints on the PSF layer while a modifier key is held."""
        return self._painting

    @painting.setter
    def painting(self, on: bool) -> None:
        if on:
            self._editable()
        self._painting = on
        self._attach()

    @property
    def layer(self) -> ImageLayer | None:
        """The layer that shows the PSF of the photo."""
        photo = self._session.photo
        return None if photo is None else outputs.newest(self._session, photo, outputs.PSF)

    def _remember(self) -> None:
        photo, state = self._session.photo, self._session.state
        if photo is None or state.psf is None:
            return
        known, self._known[photo] = self._known.get(photo), (state.psf, state.field)
        changed = known is not None and known[0] is not state.psf
        if known is not None and changed and not self._undoing:
            self._before[photo] = [*self._before.get(photo, []), known][-DEPTH:]

    def _attach(self) -> None:
        """Listen to the mouse on the PSF layer of the photo, and on no other."""
        if self._canvas is not None and self._drag in self._canvas.mouse_drag_callbacks:
            self._canvas.mouse_drag_callbacks.remove(self._drag)
        state = self._session.state
        single = state.psf is not None and state.field is None and state.psf.psf.ndim == PLANE
        self._canvas = self.layer if self._painting and single else None
        if self._canvas is not None:
            self._canvas.mouse_drag_callbacks.append(self._drag)

    def _drag(self, layer: ImageLayer, event: Any) -> Iterator[None]:
        """Paint or erase along the way of the mouse; taken over when the button is released."""
        strokes: dict[str, Callable[[FloatArray], float]] = {PAINT: np.max, ERASE: lambda _: 0.0}
        chosen = [strokes[key] for key in strokes if key in event.modifiers]
        psf = np.array(self._session.required_psf().psf)
        if not chosen or event.button != 1 or psf.shape != layer.data.shape:
            return
        value, last = float(chosen[0](psf)), None
        while event.type != "mouse_release":
            event.handled = True  # the picture stays where it is
            at = np.asarray(layer.world_to_data(event.position))[-2:]
            _stroke(psf, at if last is None else last, at, value)
            last = at
            layer.data = psf.astype(layer.data.dtype)
            yield
        try:
            self._change(psf)
        except REFUSALS as error:
            self._session.say(in_words(error), Level.ERROR)
            self._change(self._session.required_psf().psf)


def _stroke(psf: FloatArray, start: FloatArray, end: FloatArray, value: float) -> None:
    """Set the pixels on the way from one point to another, those outside left out."""
    count = int(np.ceil(np.abs(end - start).max())) + 1
    for point in np.linspace(start, end, count):
        row, column = np.rint(point).astype(int)
        if 0 <= row < psf.shape[0] and 0 <= column < psf.shape[1]:
            psf[row, column] = value
