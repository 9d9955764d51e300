"""One working session on the photos of a viewer: its state and its verbs; without Qt."""

from weakref import WeakValueDictionary

from napari.components import ViewerModel
from napari.layers import Image as ImageLayer

from ..drawing import DrawingVerbs, EdgeDrawing
from ..pixels import unwrapped
from .batch import BatchVerbs
from .blur import BlurVerbs
from .export import ExportVerbs
from .large import IntoFileVerbs
from .record import RecordVerbs
from .response import ResponseVerbs
from .restore import RestoreVerbs
from .whole import WholeVerbs

_SESSIONS: WeakValueDictionary[int, "Session"] = WeakValueDictionary()


class Session(
    DrawingVerbs,
    ResponseVerbs,
    BlurVerbs,
    RestoreVerbs,
    WholeVerbs,
    IntoFileVerbs,
    BatchVerbs,
    RecordVerbs,
    ExportVerbs,
):
    """The path from a blurred photo to a sharp one, on the layers of a viewer.

    Every stage is a verb that does its work at once and shows the result as layers. The
    function beside it (``detecting_edges`` beside ``detect_edges``) gives the same work as a
    :class:`~.step.Step`, to be run elsewhere: the widgets run it in a thread. So widgets and
    scripts do the same.

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
    edges_changing : Signal
        Emitted when the edges are about to change, with the numbers of those that stay.
    progressed : Signal
        Emitted with the :class:`~napari_crfdeblur.progress.Progress` of a verb.
    said : Signal
        Emitted with each :class:`~.step.Message` to the user.

    Raises
    ------
    CrfDeblurError
        `photo` is not an image that can be worked on; the message says what to do.
    """

    def __init__(
        self,
        viewer: ViewerModel,
        photo: ImageLayer | None = None,
        *,
        white: float | None = None,
    ) -> None:
        super().__init__(viewer)
        self.drawing = EdgeDrawing(self)
        _SESSIONS.setdefault(id(self.viewer), self)
        self.photo = photo if photo is not None else self._topmost()
        if white is not None:
            self.white = white

    @classmethod
    def of(cls, viewer: ViewerModel) -> "Session":
        """The session that all widgets of a viewer share; made on first use."""
        viewer = unwrapped(viewer)
        return _SESSIONS.get(id(viewer)) or cls(viewer)
