"""One working session on the photos of a viewer: its state and its verbs; without Qt."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from weakref import WeakKeyDictionary, WeakValueDictionary

from napari.components import ViewerModel
from napari.layers import Image as ImageLayer
from napari.layers import Layer, Shapes
from psygnal import Signal

from .._typing import FloatArray
from ..deconvolution import Deconvolver
from ..edges import Edge, Line, Rectangle
from ..errors import CrfDeblurError
from ..estimate import ResponseFit, ResponseStatus
from ..io import read_edges, read_psf, read_responses
from ..linear import Response
from ..pipeline import DeblurOptions
from ..progress import Progress, drain
from ..psf import PsfEstimate, PsfEstimator, PsfStatus
from ..response import ResponseCurve
from . import layers, outputs, provenance, script, steps
from .drawing import EdgeDrawing
from .layers import Region, Source, Span
from .state import Action, EdgeSet, Fitted, State
from .steps import BatchResult, Level, Message, Step

T = TypeVar("T")
R = TypeVar("R")

NO_PHOTO = "there is no photo yet: open one, or choose an image layer"
NO_EDGES = "there are no edges yet: find them automatically, or draw some"
NO_RESPONSE = "there is no response yet: estimate it, load one, or choose gamma 2.2 or sRGB"
NO_PSF = "there is no PSF yet: estimate it, load one, or make one"
_SESSIONS: WeakValueDictionary[int, "Session"] = WeakValueDictionary()


class Session:
    """The path from a blurred photo to a sharp one, on the layers of a viewer.

    Every stage is a verb that does its work at once and shows the result as layers. The
    function of the same name in :mod:`~.steps` (``detecting_edges`` for ``detect_edges``)
    gives the same work as a :class:`~.steps.Step`, to be run elsewhere: the widgets run it in
    a thread. So widgets and scripts do the same.

    Parameters
    ----------
    viewer : napari.components.ViewerModel
        A viewer, with or without a window.
    photo : napari.layers.Image, optional
        The photo to work on; by default the topmost image layer, if there is one.
    white : float, optional
        Value of `photo` that stands for intensity 1; by default the full scale of its kind of
        number: 255, 65535, or 1 for floats.

    Attributes
    ----------
    photo_changed, edges_changed, response_changed, psf_changed, layers_changed : Signal
        Emitted after that part of the session has changed.
    selection_changed : Signal
        Emitted with the number of the edge that is selected, or None.
    progressed : Signal
        Emitted with the :class:`~napari_crfdeblur.progress.Progress` of a verb.
    said : Signal
        Emitted with each :class:`~.steps.Message` to the user.

    Raises
    ------
    CrfDeblurError
        `photo` is not an image that can be worked on; the message says what to do.
    """

    photo_changed = Signal()
    edges_changed = Signal()
    response_changed = Signal()
    psf_changed = Signal()
    layers_changed = Signal()
    selection_changed = Signal(object)
    progressed = Signal(Progress)
    said = Signal(Message)

    def __init__(
        self,
        viewer: ViewerModel,
        photo: ImageLayer | None = None,
        *,
        white: float | None = None,
    ) -> None:
        self.viewer: ViewerModel = layers.unwrapped(viewer)
        # Where steps go that follow from drawing: done at once, unless widgets have a thread.
        self.start: Callable[[Step[Any, Any]], object] = self.do
        self._photo: ImageLayer | None = None
        self._whites: WeakKeyDictionary[Layer, float] = WeakKeyDictionary()
        self._states: WeakKeyDictionary[Layer, State] = WeakKeyDictionary()
        # Layers made of each photo, and their kinds.
        self.made: WeakKeyDictionary[Layer, WeakKeyDictionary[Layer, str]] = WeakKeyDictionary()
        self._selected: int | None = None
        self.drawing = EdgeDrawing(self)
        _SESSIONS.setdefault(id(self.viewer), self)
        # Closures, so that the session lives as long as its viewer.
        self.viewer.layers.events.inserted.connect(lambda event: self._inserted(event.value))
        self.viewer.layers.events.removed.connect(lambda event: self._removed(event.value))
        self.photo = photo if photo is not None else self._topmost()
        if white is not None:
            self.white = white

    @classmethod
    def of(cls, viewer: ViewerModel) -> "Session":
        """The session that all widgets of a viewer share; made on first use."""
        viewer = layers.unwrapped(viewer)
        return _SESSIONS.get(id(viewer)) or cls(viewer)

    @property
    def photo(self) -> ImageLayer | None:
        """The photo that is worked on; what is known of others is kept for their turn."""
        return self._photo

    @photo.setter
    def photo(self, layer: ImageLayer | None) -> None:
        layer = layers.unwrapped(layer)
        if layer is not None:
            layers.source_of(layer, white=1.0)
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
        photo = self._required_photo()
        layers.source_of(photo, white=1.0 if value is None else value)
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
            raise ValueError(f"expected the number of an edge, got {number}")
        if number != self._selected:
            self._selected = number
            self.selection_changed.emit(number)

    def do(self, step: Step[T, R]) -> R:
        """Run a step here and now, its progress on :attr:`progressed`."""
        return steps.apply(step.finish(drain(step.job, self.progressed.emit)))

    def detect_edges(
        self,
        blur_extent: float | None = None,
        *,
        add: bool = False,
        plane: Sequence[int] | None = None,
    ) -> EdgeSet:
        """Find straight edges, and show them as lines colored by orientation.

        Parameters
        ----------
        blur_extent : float, optional
            Largest width of a blurred edge in pixels; judged from the photo if not given.
        add : bool
            Keep the edges that there are already.
        plane : sequence of int, optional
            Index of the plane in a stack; by default the one that is shown.

        Raises
        ------
        CrfDeblurError
            There is no photo, or it cannot be worked on.
        """
        return self.do(steps.detecting_edges(self, blur_extent, add=add, plane=plane))

    def set_edges(
        self,
        items: Sequence[Edge | Line | Rectangle] = (),
        blur_extent: float | None = None,
        *,
        plane: Sequence[int] | None = None,
    ) -> EdgeSet:
        """Use these edges: lines and rectangles are refined first, edges taken as they are.

        Parameters
        ----------
        items : sequence of Edge, Line or Rectangle
            In (row, column) pixels of the photo; none to do without edges.
        blur_extent, plane
            As in :meth:`detect_edges`.
        """
        return self.do(steps.setting_edges(self, items, blur_extent, plane=plane))

    def draw_edges(self, shape: str = "line") -> Shapes:
        """Make the layer on which edges are drawn, ready for a ``line`` or a ``rectangle``."""
        return self.drawing.begin(shape)

    def use_edges_of(self, layer: Shapes) -> EdgeSet:
        """Use the lines and rectangles of any Shapes layer; its own coordinates count."""
        items, plane = self.drawing.adopted(layers.unwrapped(layer))
        return self.set_edges(items, plane=plane)

    def remove_edges(self, numbers: Sequence[int]) -> EdgeSet:
        """Do without the edges of these numbers."""
        return self.do(steps.removing_edges(self, numbers))

    def load_edges(self, path: Path | str) -> EdgeSet:
        """Use the edges of a JSON file; they are refined on this photo."""
        return self.set_edges(read_edges(Path(path)))

    def undo_edges(self) -> None:
        """Take back the last change of the edges."""
        self._turn_edges(self.state.undone(), "there is no change of the edges to undo")

    def redo_edges(self) -> None:
        """Do again what :meth:`undo_edges` took back."""
        self._turn_edges(self.state.redone(), "there is no change of the edges to redo")

    def estimate_response(
        self,
        method: ResponseFit | None = None,
        *,
        per_channel: bool = False,
        others: Sequence[ImageLayer | Path | str] = (),
    ) -> Fitted:
        """Estimate the camera response from the edges.

        Parameters
        ----------
        method : ResponseFit, optional
            By default :class:`~napari_crfdeblur.estimate.RankMinimization`.
        per_channel : bool
            One response for each color channel.
        others : sequence of layers or files
            Further photos of the same camera, by layer, name of a layer, or path; their edges
            are those of the session, or found automatically.

        Raises
        ------
        CrfDeblurError
            There are no edges, or they cannot determine a response.
        """
        return self.do(
            steps.estimating_response(self, method, per_channel=per_channel, others=others)
        )

    def set_response(self, curve: Response) -> Fitted:
        """Use a response that is known: one curve, or one for each channel."""
        return self.do(steps.setting_response(self, curve))

    def load_response(self, path: Path | str) -> Fitted:
        """Use the response in a JSON file."""
        curves = read_responses(Path(path))
        return self.set_response(curves[0] if len(curves) == 1 else curves)

    def estimate_psf(
        self, method: PsfEstimator | None = None, *, region: Sequence[Span] | None = None
    ) -> PsfEstimate:
        """Estimate the PSF in linear light; it is shown as a layer beside the photo.

        Parameters
        ----------
        method : PsfEstimator, optional
            By default :class:`~napari_crfdeblur.psf.XuJia` of the size of the blur.
        region : sequence of (start, stop), optional
            For each axis of the photo; by default the plane that is shown.

        Raises
        ------
        CrfDeblurError
            There is no response, or the picture shows too little structure.
        """
        return self.do(steps.estimating_psf(self, method, region=region))

    def set_psf(self, psf: FloatArray) -> PsfEstimate:
        """Use a PSF that is known, shape (H, W): non-negative, scaled to sum 1."""
        return self.do(steps.setting_psf(self, psf))

    def load_psf(self, path: Path | str) -> PsfEstimate:
        """Use the PSF in a picture or an array file."""
        return self.set_psf(read_psf(Path(path)))

    def use_psf_of(self, layer: ImageLayer) -> PsfEstimate:
        """Use the PSF in an image layer, as it is now."""
        return self.set_psf(layers.kernel_of(layers.unwrapped(layer)))

    def linearize(self, *, region: Sequence[Span] | None = None) -> ImageLayer:
        """Undo the response: the photo in linear light, as a layer.

        Parameters
        ----------
        region : sequence of (start, stop), optional
            For each axis of the photo; by default all of it, every slice of a stack.
        """
        return self.do(steps.linearizing(self, region=region))

    def deconvolve(self, method: Deconvolver | None = None) -> ImageLayer:
        """Undo the blur of the linear photo, as a layer.

        Parameters
        ----------
        method : Deconvolver, optional
            By default :class:`~napari_crfdeblur.deconvolution.HyperLaplacian`, which allows
            for the errors of an estimated PSF.
        """
        return self.do(steps.deconvolving(self, method))

    def reapply(self) -> ImageLayer:
        """Apply the response again: the deblurred photo in its own numbers, as a layer."""
        return self.do(steps.reapplying(self))

    def restore(
        self, method: Deconvolver | None = None, *, region: Sequence[Span] | None = None
    ) -> ImageLayer:
        """Linearize, deconvolve and re-apply; returns the layer of the deblurred photo."""
        return self.do(steps.restoring(self, method, region=region))

    def compare_with(
        self,
        curve: ResponseCurve | None = None,
        method: Deconvolver | None = None,
        *,
        region: Sequence[Span] | None = None,
    ) -> ImageLayer:
        """Restore the photo with another response, gamma 2.2 by default, and the same PSF."""
        return self.do(steps.comparing(self, curve, method, region=region))

    def preview(
        self, method: Deconvolver | None = None, *, curve: Response | None = None
    ) -> ImageLayer:
        """Restore what the canvas shows, and show it in place of the last preview."""
        return self.do(steps.previewing(self, method, curve=curve))

    def deblur(self, options: DeblurOptions | None = None) -> ImageLayer:
        """Do the whole path; edges that the session already has are used.

        Parameters
        ----------
        options : DeblurOptions, optional
            What is known, and the methods for the rest.
        """
        return self.do(steps.deblurring(self, options))

    def restore_layers(
        self, photos: Sequence[ImageLayer], method: Deconvolver | None = None
    ) -> BatchResult:
        """Restore other photos with the response and the PSF of this one, as layers.

        Parameters
        ----------
        photos : sequence of napari.layers.Image
            Photos and stacks of the same camera with the same blur.
        method : Deconvolver, optional
            As in :meth:`deconvolve`.
        """
        return self.do(steps.restoring_layers(self, photos, method))

    def restore_files(
        self,
        paths: Sequence[Path | str],
        folder: Path | str,
        method: Deconvolver | None = None,
    ) -> BatchResult:
        """Restore files with the response and the PSF of this photo.

        Parameters
        ----------
        paths : sequence of Path
            Photos of the same camera with the same blur; a bad one is passed over.
        folder : Path
            Where ``NAME-deblurred`` files are written; made if it is missing.
        method : Deconvolver, optional
            As in :meth:`deconvolve`.
        """
        return self.do(steps.restoring_files(self, paths, folder, method))

    def flip(self) -> None:
        """Show the photo instead of its restored version, or the other way round."""
        photo, restored = self.required_pair()
        before = outputs.shown(self, photo) == "photo"
        for layer, kind in outputs.made_of(self, photo).items():
            if kind != outputs.PSF and layer is not restored:
                layer.visible = False  # what lies between them
        photo.visible, restored.visible = True, before

    def record(self) -> dict[str, Any]:
        """All that was done on the photo and what came out, JSON-safe."""
        return provenance.provenance(self, self._required_photo(), "session", self.state)

    def script(self) -> str:
        """What was done on the photo, as a Python script that runs without a display."""
        return script.as_script(self.record())

    def export(self, what: str, path: Path | str) -> Path:
        """Write a part of the session to a file.

        Parameters
        ----------
        what : str
            ``report``, ``response``, ``edges``, ``PSF``, ``session``, ``Python script``, or
            ``plot of the`` ``response``, ``profiles``, ``edges`` or ``PSF``.
        path : Path
            Its suffix says the kind: ``.html`` or ``.png`` for the report, ``.json`` or
            ``.csv`` for edges, ``.npy``, ``.tif`` or ``.png`` for the PSF, ``.png``, ``.svg``
            or ``.pdf`` for plots, ``.json`` and ``.py`` for the rest.

        Raises
        ------
        CrfDeblurError
            There is no such part yet, or the file cannot be written.
        """
        return self.do(steps.exporting(self, what, path))

    def save(self, path: Path | str) -> None:
        """Save what was done, to be loaded and repeated."""
        self.export("session", path)

    def repeat(self, saved: Path | str | dict[str, Any]) -> None:
        """Do on this photo what was done on another one.

        Parameters
        ----------
        saved : path or dict
            A session file, or what :meth:`record` or the metadata of a layer hold.
        """
        for make in self.repeating(saved):
            self.do(make())

    def repeating(self, saved: Path | str | dict[str, Any]) -> list[Callable[[], Step[Any, Any]]]:
        """The steps of :meth:`repeat`, each to be made when the one before is done."""
        if isinstance(saved, dict):
            actions = provenance.actions_of(saved, "the session")
        else:
            actions = provenance.read_session(Path(saved))
        unknown = [action.verb for action in actions if action.verb not in steps.REPEATABLE]
        if unknown:
            raise CrfDeblurError(f"“{unknown[0]}” cannot be repeated; the session is damaged")
        self._required_photo()
        return [
            partial(steps.REPEATABLE[action.verb], self, **action.arguments) for action in actions
        ]

    # What steps need of a session.

    def source(self) -> tuple[ImageLayer, Source]:
        """The photo and its pixels, as they are now."""
        photo = self._required_photo()
        return photo, layers.source_of(photo, self.white)

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
            return layers.plane_at(source, index)
        return layers.shown_plane(self.viewer, photo)

    def region(self, spans: Sequence[Span]) -> Region:
        """A region of the photo from the start and stop of each axis."""
        return layers.region_of(self.source()[1], spans)

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

    def commit(self, photo: ImageLayer, state: State) -> None:
        """Keep what a step has found, and tell the views what has changed."""
        before, self._states[photo] = self.state_of(photo), state
        if photo is not self._photo:
            return
        if state.edges is not before.edges:
            self.selected = None
            self.edges_changed.emit()
        if state.fitted is not before.fitted:
            self.response_changed.emit()
        if state.psf is not before.psf:
            self.psf_changed.emit()
        if state.restored is not before.restored or state.linear is not before.linear:
            self.layers_changed.emit()

    def say(self, text: str, level: Level = Level.INFO) -> None:
        """Tell the user something, wherever the session is shown."""
        self.said.emit(Message(text, level))

    def say_trust(self, fitted: Fitted | None = None, psf: PsfEstimate | None = None) -> None:
        """Tell the user how far a response and a PSF can be trusted."""
        said, doubt = [], False
        for estimate in fitted.estimates[:1] if fitted else ():
            said.append(f"response: {estimate.status.value}")
            doubt |= estimate.status not in (ResponseStatus.GOOD, ResponseStatus.GIVEN)
        if psf is not None:
            said.append(f"PSF: {psf.status.value}")
            doubt |= psf.status is PsfStatus.DOUBTFUL
        self.say(". ".join(said), Level.DOUBT if doubt else Level.INFO)

    def _required_photo(self) -> ImageLayer:
        if self._photo is None:
            raise CrfDeblurError(NO_PHOTO)
        return self._photo

    def _turn_edges(self, state: State | None, otherwise: str) -> None:
        if state is None:
            raise CrfDeblurError(otherwise)
        photo = self._required_photo()
        edges = state.edges
        items = edges.edges if edges else ()
        plane = layers.stack_index(edges.plane) if edges else ()
        self.commit(photo, state.after(Action.of("set_edges", items=tuple(items), plane=plane)))

    def _topmost(self) -> ImageLayer | None:
        photos = [layer for layer in self.viewer.layers if _is_photo(layer)]
        return photos[-1] if photos else None

    def _inserted(self, layer: Layer) -> None:
        if self._photo is None and _is_photo(layer):
            self.photo = layer

    def _removed(self, layer: Layer) -> None:
        photo = self._photo
        if photo is not None and layer is photo:
            self.photo = None
            self.say(f"“{photo.name}” was closed; open or choose another photo")


def _is_photo(layer: Layer) -> bool:
    """Whether a layer is an image that was not made here."""
    return type(layer) is ImageLayer and provenance.KEY not in layer.metadata
