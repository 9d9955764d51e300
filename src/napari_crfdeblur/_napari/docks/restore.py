"""Restoring: linear, deconvolved, re-applied, previewed first and compared with the photo."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from magicgui.widgets import CheckBox, ComboBox, Container, Label
from magicgui.widgets.bases import Widget
from napari.layers import Layer

from ...deconvolution.tiles import Region
from ...errors import CrfDeblurError
from ...large.store import SUFFIXES
from .. import outputs
from ..preferences import preferences
from ..regions import visible_part
from ..session.large import restoring_into
from ..session.restore import (
    comparing,
    counting_clipped,
    deconvolving,
    linearizing,
    previewing,
    reapplying,
    restoring_photo,
)
from ..session.state import Sharp
from ..session.step import Step, at_once
from .base import Dock, Followed
from .choices import AUTOMATIC, PREFERRED, deconvolvers
from .files import ask_save
from .forms import row, sentence
from .keys import PREVIEW
from .strength import DeconvolutionForm

WHOLE, SLICE, VISIBLE = "all of it", "the shown slice only", "the visible part only"
NOTICED = 0.02  # share of clipped values that the user should know of, as in the command
OTHER_PHOTO = "another photo was chosen meanwhile: restore this one again with gamma 2.2 beside it"


class RestoreDock(Dock):
    """Restore a photo whose response and PSF are known."""

    def body(self) -> list[Widget]:
        """The method, what is restored, the steps, and the comparison."""
        self._counted: Sharp | None = None
        self._single: tuple[dict[Layer, bool], dict[str, Any], tuple[Any, float]] | None = None
        return [*self._choices(), *self._actions(), *self._comparisons()]

    def step(self) -> Step[Any, Any]:
        """Linearize, deconvolve and re-apply in one."""
        self._chosen = self.session.photo, self._method.method, self._region()
        _, method, region = self._chosen
        return restoring_photo(self.session, method, region=region)

    def run(self, block: bool = True) -> Any:
        """Restore, with gamma 2.2 beside it if that is wanted; returns the restored layer."""
        following = [self._comparison] if self._beside.value else []
        return self.begin(self.step, *following, block=block)

    def preview(self, block: bool = False) -> Any:
        """Restore what the canvas shows, in place of the last preview."""
        return self.begin(lambda: previewing(self.session, self._method.method), block=block)

    def run_into(self, path: Path, block: bool = True) -> Any:
        """Restore all of the photo into a file, which is replaced if it is there."""
        method = self._method.method
        return self.begin(
            lambda: restoring_into(self.session, path, method, overwrite=True), block=block
        )

    def remove_preview(self) -> None:
        """Take the preview away."""
        outputs.remove_preview(self.session, self.session.source()[0])

    def side_by_side(self) -> None:
        """Show the photo and its results in a grid, or go back to the former view."""
        if self._single is None:
            self._spread()
        else:
            self._gather()
        self._side.text = "Side by side" if self._single is None else "Back to one"

    def shortcuts(self) -> dict[str, Callable[[], Any]]:
        """Those of all widgets, and the preview."""
        return {**super().shortcuts(), PREVIEW: self.preview}

    def refresh(self) -> None:
        """Show the photo of the session and what was made of it."""
        super().refresh()
        self._what.reset_choices()
        self._show_results()

    def _choices(self) -> list[Widget]:
        chosen = preferences()
        name = PREFERRED[chosen.deconvolution]
        # Automatic is that method, too, and knows whether the PSF was given or estimated.
        self._method = DeconvolutionForm(
            deconvolvers(), AUTOMATIC if name == "local shrinkage" else name
        )
        self._what = ComboBox(
            label="restore",
            choices=self._parts,
            tooltip="part of the photo or stack that is restored",
        )
        self._beside = CheckBox(
            text="with gamma 2.2 beside it",
            value=chosen.compare,
            tooltip="restore with the usual response, too: to see what the estimated one buys",
        )
        what = Container(widgets=[self._what])
        what.margins = (0, 0, 0, 0)
        return [self._method, what, self._beside]

    def _actions(self) -> list[Widget]:
        preview = self.button(
            "Preview",
            "restore what is visible, at most 512 x 512 pixels, and show it in place "
            f"({PREVIEW} on the canvas)",
            self.preview,
        )
        remove = self.button(
            "Remove preview",
            "take the preview away",
            lambda: self.attempt(self.remove_preview),
        )
        restore = self.button(
            "Restore",
            "linearize, deconvolve and re-apply the response: new layers, of which a hidden one "
            "says what can be believed",
            lambda: self.run(block=False),
        )
        into = self.button(
            "Restore into a file...",
            "for photos whose results do not fit into memory: tile by tile into a TIFF or a "
            "folder of zarr, which is then shown",
            self._ask_into,
        )
        linear = self.button(
            "Linearize",
            "only undo the response: a layer in linear light",
            lambda: self.begin(lambda: linearizing(self.session, region=self._region())),
        )
        sharp = self.button(
            "Deconvolve",
            "only undo the blur of the last linear layer",
            lambda: self.begin(lambda: deconvolving(self.session, self._method.method)),
        )
        again = self.button(
            "Re-apply",
            "only apply the response again to the last deconvolved layer",
            lambda: self.begin(lambda: reapplying(self.session)),
        )
        return [row(preview, remove), restore, into, row(linear, sharp, again)]

    def _comparisons(self) -> list[Widget]:
        self._clipped = sentence()
        self._clipped.visible = False
        self._shown = Label(value="")
        flip = self.button(
            "Before / after",
            "show the photo, or its restored version (Control-Alt-B on the canvas)",
            lambda: self.attempt(self.session.flip),
        )
        self._side = self.button(
            "Side by side",
            "show the photo and its restored versions in a grid, or go back",
            lambda: self.attempt(self.side_by_side),
        )
        return [row(flip, self._side), self._shown, self._clipped]

    def followed(self) -> Followed:
        """The results."""
        return [*super().followed(), (self.session.layers_changed, self._show_results)]

    def _connect(self) -> None:
        super()._connect()
        self.session.viewer.layers.events.reordered.connect(self._show_shown)
        for layer in self.session.viewer.layers:
            layer.events.visible.connect(self._show_shown)

    def _inserted(self, event: Any) -> None:
        event.value.events.visible.connect(self._show_shown)
        super()._inserted(event)

    def _parts(self, _: Any) -> list[str]:
        photo = self.session.photo
        stack = photo is not None and photo.ndim > 2
        return [WHOLE, VISIBLE, SLICE] if stack else [WHOLE, VISIBLE]

    def _region(self) -> Region | None:
        photo, source = self.session.source()
        if self._what.value == SLICE:
            return self.session.plane(None)
        if self._what.value == VISIBLE:
            return visible_part(self.session.viewer, photo, max(source.shape))
        return None

    def _ask_into(self) -> None:
        path = ask_save(self.native, "Restore into a file", SUFFIXES)
        if path is not None:
            self.run_into(path, block=False)

    def _comparison(self) -> Step[Any, Any]:
        photo, method, region = self._chosen
        if photo is not self.session.photo:
            raise CrfDeblurError(OTHER_PHOTO)
        return comparing(self.session, None, method, region=region)

    def _show_results(self) -> None:
        self._show_shown()
        sharp = self.session.state.sharp
        if sharp is self._counted:
            return
        self._counted, self._clipped.visible = sharp, False
        if sharp is not None:
            job = counting_clipped(sharp.layer.data)
            self.session.start(Step("counting clipped values", job, at_once(self._show_clipped)))

    def _show_clipped(self, share: float) -> None:
        self._clipped.value = (
            f"{share:.0%} of the deconvolved values left the range of the camera and were "
            "clipped: a doubtful PSF or a strong deconvolution does that"
        )
        self._clipped.visible = share > NOTICED and self.visible

    def _show_shown(self, _: Any = None) -> None:
        photo = self.session.photo
        kind = None if photo is None else outputs.shown(self.session, photo)
        self._shown.value = f"shown: {kind or 'nothing of it'}" if photo is not None else ""

    def _spread(self) -> None:
        viewer, grid = self.session.viewer, self.session.viewer.canvas.grid
        pair = self.session.required_pair()
        made = outputs.made_of(self.session, pair[0])
        others = [layer for layer, kind in made.items() if kind.startswith(outputs.RESTORED + ",")]
        chosen = [*pair, *others[-1:]]
        camera = viewer.scene.camera
        visible = {layer: layer.visible for layer in viewer.layers}
        former = {"enabled": grid.enabled, "shape": grid.shape, "stride": grid.stride}
        self._single = visible, former, (camera.center, camera.zoom)
        for layer in viewer.layers:
            layer.visible = layer in chosen
        grid.shape, grid.stride, grid.enabled = (1, -1), 1, True
        viewer.fit_to_view(layers=list(pair[:1]))

    def _gather(self) -> None:
        viewer, single = self.session.viewer, self._single
        if single is None:
            return
        visible, former, view = single
        self._single = None
        for layer, was in visible.items():
            layer.visible = was
        for name, value in former.items():
            setattr(viewer.canvas.grid, name, value)
        viewer.scene.camera.center, viewer.scene.camera.zoom = view
