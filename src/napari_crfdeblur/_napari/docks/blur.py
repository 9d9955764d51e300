"""The blur: its PSF estimated, loaded, made or taken from a layer; shown, and edited by hand."""

from math import radians
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from magicgui.widgets import CheckBox, ComboBox, Container, FloatSpinBox
from magicgui.widgets.bases import Widget
from napari.components import ViewerModel
from napari.layers import Image as ImageLayer
from napari.layers import Layer, Shapes
from napari.utils.theme import get_theme

from ..._typing import FloatArray
from ...pipeline.intermediates import PLANE
from ...psf import disk, gaussian, line
from ...report import draw_psf
from ..blur_files import SUFFIXES, read_blur, write_blur
from ..blurs import draw_blur
from ..outputs import name_of
from ..pixels import KEY, kernel_of
from ..pointing import method_drawn_on
from ..psf_editing import PsfEditing
from ..session.blur import BEAD, estimating_psf
from ..session.step import Level, Message, Step
from ..session.workspace import doubted, trust_in_parts
from ..shapes import drawing_layer, group_color, region_drawn_on
from .base import SHADES, Dock, Followed
from .choices import AUTOMATIC, WITH_EDGES, chosen_regions, psf_estimators, regions_box
from .files import ask_open, ask_save
from .forms import MethodForm, row, sentence, tight
from .plots import Plot

SHOWN, DRAWN = "the shown picture", "the drawn region"
LINE, DISK, GAUSSIAN = "line (motion)", "disk (defocus)", "Gaussian"
SIZES = {
    LINE: ("length, px", 10.0, "length of the motion in pixels"),
    DISK: ("radius, px", 4.0, "radius of the blurred point in pixels"),
    GAUSSIAN: ("sigma, px", 2.0, "standard deviation in pixels"),
}
NONE = "there is no PSF yet"
SHARE = 0.7  # of the canvas: how large a PSF is shown to be painted on


class BlurDock(Dock):
    """Find the PSF of a photo in linear light, or give it; it can be edited."""

    def body(self) -> list[Widget]:
        """How the PSF is got, what it looks like, and how it can be changed."""
        self._editing = PsfEditing(self.session)
        self._regions: WeakKeyDictionary[Layer, Shapes] = WeakKeyDictionary()
        self._view: tuple[Any, float] | None = None
        return [*self._estimation(), *self._given(), *self._shape(), *self._result()]

    def step(self) -> Step[Any, Any]:
        """The PSF estimated with the chosen method."""
        drawn = self._where.value == DRAWN and self._method.chosen not in WITH_EDGES
        regions = chosen_regions(self._parts)
        region = self._region() if drawn and regions is None else None
        return estimating_psf(self.session, self._method.method, region=region, regions=regions)

    def pointing(self) -> Step[Any, Any]:
        """The PSF as it is seen in the drawn rectangle, or the path that is drawn."""
        photo, _ = self.session.source()
        method = method_drawn_on(self._drawing(photo), photo, BEAD)
        return estimating_psf(self.session, method)

    def draw_region(self) -> Shapes:
        """Make the layer on which the region is drawn, ready for a rectangle."""
        photo, _ = self.session.source()
        viewer, layer = self.session.viewer, self._regions.get(photo)
        if layer is None or layer not in viewer.layers:
            layer = drawing_layer(photo, name_of(photo, "region"), group_color(0))
            viewer.add_layer(layer)
            self._regions[photo] = layer
        viewer.layers.selection.active = layer
        layer.visible, layer.mode = True, "add_rectangle"
        self._where.value = DRAWN
        return layer

    def load(self, path: Path | str) -> None:
        """Use the PSF in a NumPy file, a gray picture or stack of them, or what was saved."""
        self._editing.use(*read_blur(Path(path)))

    def save(self, path: Path | str) -> None:
        """Write the PSF to a NumPy file or a gray picture; those of all parts to JSON."""
        write_blur(Path(path), self.session.required_psf().psf, self.session.state.field)

    def use(self, layer: ImageLayer) -> None:
        """Use the PSF in an image layer."""
        self._editing.use(kernel_of(layer, self.session.photo))

    def make(self) -> None:
        """Use the PSF of the chosen shape."""
        self._editing.use(self._made())

    def clear_faint(self) -> None:
        """Set what is faint in the PSF to zero."""
        self._editing.clear(self._faint.value / 100)

    def center_psf(self) -> None:
        """Move the center of mass of the PSF to its center pixel."""
        self._editing.center()

    def undo(self) -> None:
        """Go back to the PSF before the last change."""
        self._editing.undo()

    def refresh(self) -> None:
        """Show the photo of the session, the layers that there are, and its PSF."""
        super().refresh()
        self._layer.reset_choices()
        self._show_psf()

    def _estimation(self) -> list[Widget]:
        self._method = MethodForm("PSF", psf_estimators(), AUTOMATIC, "how the PSF is found")
        self._where = ComboBox(
            choices=[SHOWN, DRAWN],
            tooltip="part of the photo from which the PSF is estimated: one with sharp edges "
            "of many directions and without clipped lights is best",
        )
        self._parts = regions_box()
        self._method.edited.connect(self._choose_part)
        self._parts.changed.connect(self._choose_part)
        draw = self.button(
            "Draw a region",
            "drag a rectangle on the photo; the last one counts",
            lambda: self.attempt(self.draw_region),
        )
        estimate = self.button(
            "Estimate the PSF",
            "find the PSF in linear light; needs a response, and from straight edges those, too",
            lambda: self.run(block=False),
        )
        box = self.button(
            "PSF from the drawing",
            "take the streak of a lamp, or a point, in the rectangle that is drawn as the PSF; "
            "needs a response",
            lambda: self.begin(self.pointing),
        )
        where = row(self._where, draw)
        return [self._method, tight(self._parts, labels=True), where, row(estimate, box)]

    def _given(self) -> list[Widget]:
        load = self.button(
            "Load PSF...",
            "from a NumPy file or a gray picture of any size in pixels; for a stack that is to be "
            "restored as a volume, from a stack of pictures",
            self._ask,
        )
        save = self.button(
            "Save PSF...",
            "as a NumPy file or a gray picture; as JSON with those of all parts",
            self._ask_save,
        )
        self._layer = ComboBox(
            choices=self._kernels,
            nullable=True,
            tooltip="gray picture in the viewer that shows how a point is blurred, in pixels of "
            "the photo; for a stack that is to be restored as a volume, a stack of pictures",
        )
        use = self.button("Use layer", "take the PSF from that layer", self._use_chosen)
        return [row(load, save), row(self._layer, use)]

    def _shape(self) -> list[Widget]:
        self._kind = ComboBox(label="shape", choices=list(SIZES), tooltip="what blurs the photo")
        self._size = FloatSpinBox(min=0.1, max=500, step=0.5)
        self._angle = FloatSpinBox(
            label="angle, °",
            min=-180,
            max=180,
            value=30,
            tooltip="direction of the motion in degrees, clockwise from the rows",
        )
        self._sketch = Plot(self.session.viewer, lambda ax: draw_psf(ax, self._made()), height=110)
        apply = self.button(
            "Use this shape",
            "take it as the PSF of the photo",
            lambda: self.attempt(self.make),
        )
        settings = Container(widgets=[self._kind, self._size, self._angle])
        settings.margins = (0, 0, 0, 0)
        parts: list[Widget] = [settings, self._sketch, apply]
        section = Container(widgets=parts, labels=False, visible=False)
        section.margins = (0, 0, 0, 0)
        making = CheckBox(text="make one", value=False, tooltip="a PSF of a simple shape")
        making.changed.connect(lambda on: setattr(section, "visible", on))
        self._kind.changed.connect(self._choose_kind)
        for control in (self._size, self._angle):
            control.changed.connect(self._sketch.redraw)
        self._choose_kind()
        return [making, section]

    def _result(self) -> list[Widget]:
        self._status = sentence()
        self._plot = Plot(self.session.viewer, self._draw, height=190)
        self._faint = FloatSpinBox(
            min=0, max=100, value=5, step=1, tooltip="share of the peak in percent"
        )
        clear = self.button(
            "Clear below, %",
            "set to zero what is below this share of the peak",
            lambda: self.attempt(self.clear_faint),
        )
        center = self.button(
            "Center",
            "move the center of mass to the center pixel; off it, the deblurred photo is shifted",
            lambda: self.attempt(self.center_psf),
        )
        back = self.button(
            "Undo", "the PSF before the last change", lambda: self.attempt(self.undo)
        )
        self._edit = CheckBox(
            text="edit: Ctrl-drag paints, Shift-drag erases",
            value=False,
            tooltip="paint on the PSF layer with the mouse: pixels as bright as the peak while "
            "Ctrl is held (⌘ on a Mac), zero while Shift is held",
        )
        self._edit.changed.connect(lambda on: self.attempt(lambda: self._paint(on)))
        return [self._plot, self._status, row(self._faint, clear, center, back), self._edit]

    def _say(self, message: Message) -> None:
        """Say it; how far the PSF can be trusted is said above."""
        super()._say(Message("") if message.text.startswith("PSF: ") else message)

    def followed(self) -> Followed:
        """The PSF, to be shown and to be edited."""
        return [
            *super().followed(),
            (self.session.psf_changed, self._editing.follow),
            (self.session.psf_changed, self._show_psf),
        ]

    def _connect(self) -> None:
        super()._connect()
        self.session.viewer.events.theme.connect(self._show_psf)

    def _choose_part(self) -> None:
        # Edges count wherever they lie, and parts are those of the whole picture.
        whole = chosen_regions(self._parts) is not None
        self._where.enabled = self._method.chosen not in WITH_EDGES and not whole

    def _region(self) -> Any:
        photo, _ = self.session.source()
        return region_drawn_on(self._drawing(photo), photo)

    def _drawing(self, photo: ImageLayer) -> Shapes:
        """The layer on which the region is drawn, made if there is none."""
        layer = self._regions.get(photo)
        if layer is None or layer not in self.session.viewer.layers:
            layer = self.draw_region()
        return layer

    def _kernels(self, _: Any) -> list[tuple[str, Layer]]:
        """Gray pictures that are not the photo; for one that is a stack, small stacks, too."""
        photo, layers = self.session.photo, self.session.viewer.layers
        images = [i for i in layers if isinstance(i, ImageLayer) and i is not photo and not i.rgb]
        return [(i.name, i) for i in images if i.ndim == 2 or _smaller_stack(i, photo)]

    def _made(self) -> FloatArray:
        size = float(self._size.value)
        if self._kind.value == LINE:
            return line(size, radians(self._angle.value))
        return disk(size) if self._kind.value == DISK else gaussian(size)

    def _choose_kind(self) -> None:
        label, size, tooltip = SIZES[self._kind.value]
        with self._size.changed.blocked():
            self._size.value = size
        self._size.label, self._size.tooltip = label, tooltip
        self._angle.enabled = self._kind.value == LINE
        self._sketch.redraw()

    def _draw(self, ax: Any) -> None:
        blur = self.session.state.blur
        if blur is None:
            ax.set(xticks=[], yticks=[])
            return
        draw_blur(ax, blur)

    def _show_psf(self, _: Any = None) -> None:
        psf, parts = self.session.state.psf, self.session.state.field
        text, shade, doubt = NONE, None, False
        if psf is not None:
            sides = " x ".join(str(side) for side in reversed(psf.psf.shape))
            text, doubt = f"{sides} px: {psf.sentence}", psf.status.doubted
        if parts is not None:
            text = (
                f"{text}<br>PSFs of {'{} x {}'.format(*parts.grid)} parts: {trust_in_parts(parts)}"
            )
            doubt |= doubted(parts)
        if doubt:
            shade = SHADES[get_theme(self.session.viewer.theme).type][Level.DOUBT]
        self._status.value = f'<span style="color: {shade}">{text}</span>' if shade else text
        self._plot.redraw()

    def _paint(self, on: bool) -> None:
        """Let the mouse paint, with the PSF large on the canvas; then back to the former view."""
        viewer, camera = self.session.viewer, self.session.viewer.scene.camera
        try:
            self._editing.painting = on
        finally:
            with self._edit.changed.blocked():
                self._edit.value = self._editing.painting
        layer = self._editing.layer
        if on and layer is not None:
            self._view = camera.center, camera.zoom
            viewer.layers.selection.active = layer
            layer.visible = True
            _look_at(viewer, layer)
        elif not on and self._view is not None:
            (camera.center, camera.zoom), self._view = self._view, None

    def _use_chosen(self) -> None:
        layer = self._layer.value
        if layer is not None:
            self.attempt(lambda: self.use(layer))

    def _ask(self) -> None:
        path = ask_open(self.native, "PSF", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.load(path))

    def _ask_save(self) -> None:
        path = ask_save(self.native, "Save the PSF", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.save(path))


def _look_at(viewer: ViewerModel, layer: ImageLayer) -> None:
    """Show a picture large, whatever axes the viewer has: napari fits only layers with them all."""
    extent, camera = layer.extent, viewer.scene.camera
    low, high = extent.world[:, -PLANE:]
    sides = high - low + np.abs(extent.step[-PLANE:])
    camera.center = (camera.center[0], *(float(middle) for middle in (low + high) / 2))
    camera.zoom = SHARE * float(np.min(np.array(viewer.canvas.size) / sides))


def _smaller_stack(layer: ImageLayer, photo: ImageLayer | None) -> bool:
    """Whether a layer can be the PSF of the volumes of a photo."""
    if photo is None or layer.ndim != 3 or photo.ndim < 3 or KEY in layer.metadata:
        return False
    sides = zip(layer.data.shape, photo.data.shape[: photo.ndim][-3:], strict=True)
    return all(own <= side for own, side in sides)
