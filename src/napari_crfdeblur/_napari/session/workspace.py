"""What a session knows: the viewer, the photo, the state of each photo; without its verbs."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from napari.components import ViewerModel
from napari.layers import Image as ImageLayer
from napari.layers import Layer
from psygnal import Signal

from ... import arguments
from ...deconvolution import Trust, Verdict, verdict, verdict_sentence
from ...deconvolution.tiles import Region
from ...errors import CrfDeblurError
from ...estimate import ResponseStatus
from ...pipeline import PhotoStack
from ...pipeline.blur import Blur
from ...progress import Progress, drain
from ...psf import PsfEstimate, PsfField, PsfStatus
from ..pixels import KEY, source_of, unwrapped
from ..regions import AxisSpan, plane_at, region_from_spans, shown_plane
from .state import EdgeSet, Fitted, State
from .step import Level, Message, Step, apply

T = TypeVar("T")
R = TypeVar("R")

NO_PHOTO = "there is no photo yet: open one, or choose an image layer"
NO_EDGES = "there are no edges yet: find them automatically, or draw some"
NO_RESPONSE = "there is no response yet: estimate it, load one, or choose gamma 2.2 or sRGB"
NO_PSF = "there is no PSF yet: estimate it, load one, or make one"


class Workspace:
    """The part of a session that its steps work with: photos, what is known of them, messages.

    Its signals are described with :class:`~.facade.Session`.

    Parameters
    ----------
    viewer : napari.components.ViewerModel
        A viewer, with or without a window.
    """

    photo_changed = Signal()
    edges_changed = Signal()
    response_changed = Signal()
    psf_changed = Signal()
    layers_changed = Signal()
    selection_changed = Signal(object)
    edges_changing = Signal(frozenset)
    progressed = Signal(Progress)
    said = Signal(Message)

    def __init__(self, viewer: ViewerModel) -> None:
        self.viewer: ViewerModel = unwrapped(viewer)
        # Where steps go that follow from drawing: done at once, unless widgets have a thread.
        self.start: Callable[[Step[Any, Any]], object] = self.do
        # Layers made of each photo, and their kinds.
        self.made: WeakKeyDictionary[Layer, WeakKeyDictionary[Layer, str]] = WeakKeyDictionary()
        self._photo: ImageLayer | None = None
        self._whites: WeakKeyDictionary[Layer, float] = WeakKeyDictionary()
        self._states: WeakKeyDictionary[Layer, State] = WeakKeyDictionary()
        self._shapes: WeakKeyDictionary[Layer, tuple[int, ...]] = WeakKeyDictionary()
        self._selected: int | None = None
        # Closures, so that the session lives as long as its viewer.
        self.viewer.layers.events.inserted.connect(lambda event: self._inserted(event.value))
        self.viewer.layers.events.removed.connect(lambda event: self._removed(event.value))

    @property
    def photo(self) -> ImageLayer | None:
        """The photo that is worked on; what is known of others is kept for their turn."""
        return self._photo

    @photo.setter
    def photo(self, layer: ImageLayer | None) -> None:
        layer = unwrapped(layer)
        if layer is not None:
            source_of(layer, white=1.0)
        if layer is self._photo:
            return
        self._photo = layer
        self.selected = None
        for signal in (
            self.photo_changed,
            self.edges_changed,
            self.response_changed,
            self.psf_changed,
            self.layers_changed,
        ):
            signal.emit()

    @property
    def white(self) -> float | None:
        """Value of the photo that stands for intensity 1; None for its full scale."""
        return None if self._photo is None else self.white_of(self._photo)

    @white.setter
    def white(self, value: float | None) -> None:
        self.set_white(self._required_photo(), value)

    def set_white(self, photo: ImageLayer, value: float | None) -> None:
        """Say which value of a photo stands for intensity 1; None for its full scale."""
        source_of(photo, white=1.0 if value is None else value)
        if value is None:
            self._whites.pop(photo, None)
        else:
            self._whites[photo] = float(value)
        self.photo_changed.emit()

    @property
    def state(self) -> State:
        """What is known of the photo."""
        return State() if self._photo is None else self.state_of(self._photo)

    @property
    def selected(self) -> int | None:
        """Number of the edge that is selected in the table, the canvas and the plot."""
        return self._selected

    @selected.setter
    def selected(self, number: int | None) -> None:
        edges = self.state.edges
        if number is not None and not (edges and 0 <= number < len(edges.edges)):
            raise arguments.refusal("the number of an edge", number)
        if number != self._selected:
            self._selected = number
            self.selection_changed.emit(number)

    def do(self, step: Step[T, R]) -> R:
        """Run a step here and now, its progress on :attr:`progressed`."""
        return apply(step.finish(drain(step.job, self.progressed.emit)))

    def source(self) -> tuple[ImageLayer, PhotoStack]:
        """The photo and its pixels, as they are now."""
        photo = self._required_photo()
        return photo, source_of(photo, self.white)

    def state_of(self, photo: ImageLayer) -> State:
        """What is known of any photo."""
        return self._states.get(photo, State())

    def white_of(self, photo: ImageLayer) -> float | None:
        """White level of any photo."""
        return self._whites.get(photo)

    def plane(self, index: Sequence[int] | None) -> Region:
        """The plane of a stack at an index, or the one that is shown."""
        photo, source = self.source()
        if index is not None:
            return plane_at(source, index)
        return shown_plane(self.viewer, photo)

    def region(self, spans: Sequence[AxisSpan]) -> Region:
        """A region of the photo from the start and stop of each axis."""
        return region_from_spans(self.source()[1], spans)

    def required_edges(self) -> EdgeSet:
        """The edges; refuses to go on without."""
        if self.state.edges is None:
            raise CrfDeblurError(NO_EDGES)
        return self.state.edges

    def required_response(self) -> Fitted:
        """The response; refuses to go on without."""
        if self.state.fitted is None:
            raise CrfDeblurError(NO_RESPONSE)
        return self.state.fitted

    def required_pair(self) -> tuple[ImageLayer, ImageLayer]:
        """The photo and its restored version; refuses to go on without."""
        restored = self.state.restored
        if restored is None or restored not in self.viewer.layers:
            raise CrfDeblurError("there is no deblurred photo yet: restore it first")
        return self._required_photo(), restored

    def required_psf(self) -> PsfEstimate:
        """The PSF; refuses to go on without."""
        if self.state.psf is None:
            raise CrfDeblurError(NO_PSF)
        return self.state.psf

    def required_blur(self) -> Blur:
        """The PSF, or those of all parts; refuses to go on without."""
        whole = self.required_psf().psf
        return whole if self.state.field is None else self.state.field

    def commit(self, photo: ImageLayer, state: State) -> None:
        """Keep what a step has found, and tell the views what has changed."""
        before = self.state_of(photo)
        if state.fitted is not before.fitted and state.live is before.live:
            state = replace(state, live=None)  # it followed from another response
        if state.record is before.record and state.found != before.found:
            state = replace(state, record=None)  # it speaks of what was before
        if photo not in self._states:
            photo.events.data.connect(self._pixels_changed)
        self._states[photo] = state
        self._shapes[photo] = _shape(photo)
        if photo is not self._photo:
            return
        if state.edges is not before.edges:
            self.selected = None
            self.edges_changed.emit()
        if state.fitted is not before.fitted or state.live is not before.live:
            self.response_changed.emit()
        if state.psf is not before.psf or state.field is not before.field:
            self.psf_changed.emit()
        if state.restored is not before.restored or state.linear is not before.linear:
            self.layers_changed.emit()

    def say(self, text: str, level: Level = Level.INFO) -> None:
        """Tell the user something, wherever the session is shown."""
        self.said.emit(Message(text, level))

    def say_trust(
        self,
        fitted: Fitted | None = None,
        psf: PsfEstimate | None = None,
        parts: PsfField | None = None,
        trust: Trust | None = None,
    ) -> None:
        """Tell the user how far a response, a PSF or those of all parts, and a result go."""
        said, doubt = [], False
        if fitted is not None:
            statuses = list(dict.fromkeys(estimate.status for estimate in fitted.estimates))
            said += [f"response: {status.value}" for status in statuses]
            said += fitted.doubts
            doubt |= not {*statuses} <= {ResponseStatus.GOOD, ResponseStatus.GIVEN}
        if psf is not None:
            said.append(f"PSF: {psf.sentence}")
            doubt |= psf.status.doubted
        if parts is not None:
            said.append(f"PSFs of parts: {trust_in_parts(parts)}")
            doubt |= doubted(parts)
        if trust is not None:
            said.append(f"result: {verdict_sentence(trust)}")
            doubt |= verdict(trust) is not Verdict.RESTORED
        self.say("\n".join(said), Level.DOUBT if doubt else Level.INFO)

    def _required_photo(self) -> ImageLayer:
        if self._photo is None:
            raise CrfDeblurError(NO_PHOTO)
        return self._photo

    def _topmost(self) -> ImageLayer | None:
        photos = [layer for layer in self.viewer.layers if _is_photo(layer)]
        return photos[-1] if photos else None

    def _inserted(self, layer: Layer) -> None:
        if self._photo is None and _is_photo(layer):
            self.photo = layer

    def _removed(self, layer: Layer) -> None:
        for owner, state in list(self._states.items()):
            left = state.without(layer)
            if left is not state:
                self.commit(owner, left)
        photo = self._photo
        if photo is not None and layer is photo:
            self.photo = None
            self.say(f"“{photo.name}” was closed; open or choose another photo")

    def _pixels_changed(self, event: Any) -> None:
        """Let go what lies in a photo whose pixels now have another shape."""
        photo = event.source
        if _shape(photo) != self._shapes[photo]:
            self.commit(photo, self.state_of(photo).of_other_shape(photo.ndim))
            self.say(f"“{photo.name}” has another shape now: its edges and results were let go")


def _shape(photo: ImageLayer) -> tuple[int, ...]:
    return tuple((photo.data[0] if photo.multiscale else photo.data).shape)


def trust_in_parts(parts: PsfField) -> str:
    """How far the PSFs of parts can be trusted, and whether they differ, in words."""
    statuses = [status for row in parts.statuses for status in row]
    borrowed = statuses.count(PsfStatus.BORROWED)
    open_ = sum(status.doubted for status in statuses)
    counts = {
        f"{len(statuses) - borrowed - open_} of {len(statuses)} clearly determined": True,
        f"{open_} uncertain": open_,
        f"{borrowed} follow from the others": borrowed,
    }
    said = [", ".join(text for text, count in counts.items() if count)]
    turn = parts.diagnostics.get("turn")
    if turn is not None:
        said += [f"the camera turned by {turn:.2f}°" if turn else "they do not differ"]
    return "; ".join(said)


def doubted(parts: PsfField) -> bool:
    """Whether the user should look at the PSFs of parts: less than half are well determined."""
    statuses = [status for row in parts.statuses for status in row]
    bad = sum(status.doubted or status is PsfStatus.BORROWED for status in statuses)
    return 2 * bad > len(statuses)


def _is_photo(layer: Layer) -> bool:
    """Whether a layer is an image that was not made here."""
    return type(layer) is ImageLayer and KEY not in layer.metadata
