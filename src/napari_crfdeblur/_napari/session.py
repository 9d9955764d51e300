"""One working session on the photos of a viewer: its state and its verbs; without Qt."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

from napari.components import ViewerModel
from napari.layers import Image as ImageLayer
from napari.layers import Shapes

from .._typing import FloatArray
from ..deconvolution import Deconvolver
from ..edges import Edge, Line, Rectangle
from ..errors import CrfDeblurError
from ..estimate import ResponseFit
from ..io import read_edges, read_responses
from ..linear import Response
from ..pipeline import DeblurOptions
from ..psf import PsfEstimate, PsfEstimator, PsfField, RadonFit
from ..response import ResponseCurve
from . import layers, outputs, provenance, script, steps
from .blur_files import read_blur
from .drawing import EdgeDrawing
from .layers import Span
from .state import Action, EdgeSet, Fitted, State
from .step import Step
from .steps import BatchResult
from .workspace import Workspace

_SESSIONS: WeakValueDictionary[int, "Session"] = WeakValueDictionary()


class Session(Workspace):
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
    edges_changing : Signal
        Emitted when the edges are about to change, with the numbers of those that stay.
    progressed : Signal
        Emitted with the :class:`~napari_crfdeblur.progress.Progress` of a verb.
    said : Signal
        Emitted with each :class:`~.steps.Message` to the user.

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
        viewer = layers.unwrapped(viewer)
        return _SESSIONS.get(id(viewer)) or cls(viewer)

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
            By default :class:`~napari_crfdeblur.estimate.MaximumLikelihood`.
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
        self,
        method: PsfEstimator | RadonFit | None = None,
        *,
        region: Sequence[Span] | None = None,
        regions: int | tuple[int, int] | None = None,
    ) -> PsfEstimate:
        """Estimate the PSF in linear light; it is shown as a layer beside the photo.

        Parameters
        ----------
        method : PsfEstimator or RadonFit, optional
            By default :class:`~napari_crfdeblur.psf.Variational` of the size of the blur.
            :class:`~napari_crfdeblur.psf.RadonFit` finds it from the edges of the session alone.
        region : sequence of (start, stop), optional
            For each axis of the photo; by default the plane that is shown. Edges count wherever
            they lie.
        regions : int or (int, int), optional
            Rows and columns of parts, or parts along the longer side, each of which gets a PSF
            of its own (``state.field``), for a camera that turned; by default one PSF serves
            the whole photo. That of the whole is found, and returned, all the same.

        Raises
        ------
        CrfDeblurError
            There is no response, the picture shows too little structure, or there are no edges
            for a method that needs them.
        """
        return self.do(steps.estimating_psf(self, method, region=region, regions=regions))

    def set_psf(
        self, psf: FloatArray, *, edited: bool = False, field: PsfField | None = None
    ) -> PsfEstimate:
        """Use a PSF that is known.

        Parameters
        ----------
        psf : ndarray, shape (H, W) or (D, H, W)
            Non-negative, scaled to sum 1; its origin is the center pixel. With one of three
            dimensions, stacks are restored as volumes of their last three axes.
        edited : bool
            Whether it is an estimate changed by hand: deconvolution then allows for errors.
        field : PsfField, optional
            PSFs of the parts of the photo, if they differ; `psf` is that of the whole.

        Raises
        ------
        CrfDeblurError
            It is no PSF, has more dimensions than the photo, or `field` is that of a picture
            of other sides.
        """
        return self.do(steps.setting_psf(self, psf, edited=edited, field=field))

    def load_psf(self, path: Path | str) -> PsfEstimate:
        """Use the PSF in a picture, a stack of pictures, an array file, or what was exported."""
        psf, field = read_blur(Path(path))
        return self.set_psf(psf, field=field)

    def use_psf_of(self, layer: ImageLayer) -> PsfEstimate:
        """Use the PSF in an image layer, as it is now."""
        return self.set_psf(layers.kernel_of(layers.unwrapped(layer), self.photo))

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
            By default :class:`~napari_crfdeblur.deconvolution.LocalShrinkage`, which allows
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

    def restore_into(
        self, path: Path | str, method: Deconvolver | None = None, *, overwrite: bool = False
    ) -> ImageLayer:
        """Restore the photo into a file, tile by tile, and show it from there.

        For photos and stacks, dask arrays among them, whose results do not fit into memory.

        Parameters
        ----------
        path : Path
            A BigTIFF of tiles (``.tif``) or a folder of zarr (``.zarr``); it appears under this
            name when it is complete.
        method : Deconvolver, optional
            As in :meth:`deconvolve`.
        overwrite : bool
            Whether a file that is there already is replaced.

        Raises
        ------
        CrfDeblurError
            The file is there, or cannot be written; or every part has a PSF of its own.
        """
        return self.do(steps.restoring_into(self, path, method, overwrite=overwrite))

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
            ``.csv`` for edges, ``.npy``, ``.tif``, ``.png`` or ``.json`` for the PSF (only the
            last keeps those of all parts), ``.png``, ``.svg`` or ``.pdf`` for plots, ``.json``
            and ``.py`` for the rest.

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

    def _turn_edges(self, state: State | None, otherwise: str) -> None:
        if state is None:
            raise CrfDeblurError(otherwise)
        photo = self._required_photo()
        edges = state.edges
        items = edges.edges if edges else ()
        plane = layers.stack_index(edges.plane) if edges else ()
        self.commit(photo, state.after(Action.of("set_edges", items=tuple(items), plane=plane)))
