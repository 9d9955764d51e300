"""The response: estimated from the edges, given or tuned by hand; how far it can be trusted."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from magicgui.widgets import CheckBox, ComboBox, FloatSpinBox, Label, Select
from magicgui.widgets.bases import Widget
from napari.layers import Image as ImageLayer
from napari.layers import Layer

from ...estimate import KnownPsf, MaximumLikelihood, ResponseFit, ResponseStatus
from ...io import read_responses, write_responses
from ...io.images import WRITABLE
from ...io.responses import SUFFIXES, responses_from
from ...linear import Response
from ...profiles import ProfileGroup
from ...report import Report, draw_profiles, draw_response, move_curves, move_profiles
from ...report.content import channel_names, direction, sentences
from ...response import Cameras, Gamma, ResponseCurve
from ..layers import unwrapped
from ..preferences import preferences
from ..provenance import KEY
from ..state import Fitted
from ..step import Level, Message, Step
from ..steps import estimating_response, setting_response
from .base import Dock, Followed, sentence
from .camera import CameraBox
from .choices import PREFERRED, fits, given
from .files import ask_open, ask_open_many, ask_save
from .forms import MethodForm, tight
from .plots import Plot, palette_of
from .tuning import Tuning

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

GAMMA, KNOWN_PSF, KNOWN_PSF_EQ4 = "gamma", "known PSF", "known PSF, Eq. 4"
LEAST_HEIGHT = 120  # pixels of a plot in a small window; all three grow with it
SPACING = 4
EARLIER = "estimated from earlier edges: estimate again"
TRUSTED = {ResponseStatus.GOOD, ResponseStatus.GIVEN}
NOTHING = "no response yet: estimate it from edges, load one, or use one that is known"


class ResponseDock(Dock):
    """Find the camera response, see how far it can be trusted, and tune it by hand."""

    def body(self) -> list[Widget]:
        """How the response is found, what it is, and sliders to tune it."""
        self.native.layout().setSpacing(SPACING)
        self._compared: dict[str, ResponseCurve] = {}
        self._paths: list[Path] = []
        self._trust = sentence()
        use = self.button(
            "Use this curve", "make the tuned curve the response", lambda: self.use_tuned(False)
        )
        self._tuning = Tuning(self.session, self.runner, use)
        return [
            *self._estimating(),
            *self._giving(),
            self._trust,
            *self._plots(),
            self._tuning,
        ]

    @property
    def tuning(self) -> Tuning:
        """The sliders."""
        return self._tuning

    @property
    def others(self) -> list[ImageLayer | Path]:
        """Further photos of the same camera whose edges are used, too."""
        return list(self._others.value) if self._pool.value else []

    @others.setter
    def others(self, photos: Sequence[ImageLayer | Path | str]) -> None:
        photos = [Path(p) if isinstance(p, str) else unwrapped(p) for p in photos]
        self._add_files([photo for photo in photos if isinstance(photo, Path)])
        self._pool.value = bool(photos)
        self._others.value = photos

    def step(self) -> Step[Any, Any]:
        """The response estimated from the edges."""
        return estimating_response(
            self.session,
            self._fit(),
            per_channel=bool(self._per_channel.value),
            others=self.others,
        )

    def use(self, block: bool = True) -> Any:
        """Use the response that is chosen under "or use"; in a thread unless it blocks."""
        return self.begin(lambda: setting_response(self.session, self._chosen()), block=block)

    def use_tuned(self, block: bool = True) -> Any:
        """Make the tuned curve the response; in a thread unless it blocks."""
        return self.begin(lambda: setting_response(self.session, self._tuning.used()), block=block)

    def load(self, path: Path | str) -> Fitted:
        """Use the response in a JSON file."""
        return self.session.load_response(path)

    def save(self, path: Path | str) -> None:
        """Save the response with its band as JSON."""
        write_responses(Path(path), self.session.required_response().estimates)
        self.session.say(f"the response is saved in {Path(path).name}")

    def assume(self, camera: Cameras | Layer | Path | str) -> None:
        """Assume a kind of camera, or that it is close to the response of a layer or file."""
        if isinstance(camera, str | Path):
            self._camera.add_file(Path(camera))
        else:
            self._camera.chosen = camera if isinstance(camera, Cameras) else unwrapped(camera)

    def compare(self, path: Path | str | None) -> None:
        """Draw the response in a JSON file beside that of the photo; None draws no other."""
        curves = read_responses(Path(path)) if path else ()
        names = [f"{Path(path or '').stem} {name}".strip() for name in channel_names(len(curves))]
        self._compared = dict(zip(names, curves, strict=False))
        self._compare.text = "Compare no more" if curves else "Compare with..."
        self._curve.redraw()

    def refresh(self) -> None:
        """Show the photo of the session, and offer what there is to choose from."""
        super().refresh()
        self._others.reset_choices()
        self._known.reset_choices()
        self._camera.refresh()
        photo = self.session.photo
        self._per_channel.enabled = photo is not None and bool(photo.rgb)
        if not self._per_channel.enabled:
            self._per_channel.value = False

    def _estimating(self) -> list[Widget]:
        preferred = PREFERRED[preferences().response]
        methods = self._methods()
        self._method = MethodForm(
            "method",
            methods,
            preferred if preferred in methods else next(iter(methods)),
            "how the response is found from the profiles across the edges",
            without=["prior"],
        )
        near = self.button(
            "File...",
            "assume that the camera is close to the response in a JSON file",
            self._ask_assumed,
        )
        self._camera = CameraBox(self.session, near)
        self._method.edited.connect(self._show_camera)
        self._show_camera()
        self._per_channel = CheckBox(
            text="one curve per channel",
            value=False,
            tooltip="estimate red, green and blue apart, each from its own profiles; "
            "for color photos",
        )
        self._pool = CheckBox(
            text="with further photos of the same camera",
            value=False,
            tooltip="their edges add to those of this photo, if they were taken with the same "
            "settings",
        )
        self._others = Select(
            choices=self._further,
            tooltip="photos of the same camera; edges that they have in this session are used, "
            "otherwise they are found automatically",
        )
        self._others.native.setMaximumHeight(70)
        add = self.button("Add files...", "choose photos that are not open", self._ask_files)
        self._further_box = tight(self._others, add, visible=False)
        self._pool.changed.connect(self._show_further)
        estimate = self.button(
            "Estimate the response",
            "find the curve that makes the profiles across the edges fall on one another",
            lambda: self.run(block=False),
        )
        return [
            self._method,
            self._camera,
            self._per_channel,
            self._pool,
            self._further_box,
            estimate,
        ]

    def _giving(self) -> list[Widget]:
        preferred = PREFERRED[preferences().response]
        self._known = ComboBox(
            choices=self._known_responses,
            tooltip="a response that is assumed, or with which a layer was made",
        )
        self._known.value = preferred if preferred in given() else GAMMA
        self._gamma = FloatSpinBox(
            value=2.2, min=0.1, max=10, step=0.1, tooltip="exponent of the gamma curve, no unit"
        )
        self._known.changed.connect(self._show_gamma)
        self._show_gamma()
        use = self.button(
            "Use", "take this response instead of an estimate", lambda: self.use(block=False)
        )
        self._compare = self.button(
            "Compare with...", "draw another response beside this one", self._ask_compare
        )
        load = self.button("Load...", "use the response in a JSON file", self._ask_load)
        save = self.button("Save...", "save the response as JSON", self._ask_save)
        return [
            tight(Label(value="or use"), self._known, self._gamma, use, layout="horizontal"),
            tight(load, save, self._compare, layout="horizontal"),
        ]

    def _plots(self) -> list[Widget]:
        viewer = self.session.viewer
        self._group = ComboBox(
            label="profiles of group",
            choices=self._groups,
            tooltip="edges of one orientation; follows the edge that is selected",
        )
        self._group.changed.connect(self._redraw_profiles)
        self._curve = Plot(viewer, self._draw_curve, height=LEAST_HEIGHT)
        self._recorded = Plot(viewer, self._draw_recorded, height=LEAST_HEIGHT)
        self._linear = Plot(viewer, self._draw_linear, height=LEAST_HEIGHT)
        profiles = tight(self._recorded, self._linear, layout="horizontal")
        profiles.native.setSizePolicy(self._curve.native.sizePolicy())
        return [self._curve, tight(self._group, labels=True), profiles]

    def _say(self, message: Message) -> None:
        """Say it; how far the response can be trusted is said above."""
        super()._say(Message("") if message.text.startswith("response: ") else message)

    def followed(self) -> Followed:
        """The response, and what it is estimated from."""
        session = self.session
        return [
            *super().followed(),
            (session.response_changed, self._response_changed),
            (session.edges_changed, self._edges_changed),
            (session.psf_changed, self._offer_methods),
            (session.selection_changed, self._show_group_of),
        ]

    def _connect(self) -> None:
        super()._connect()
        self._tuning.toggled.connect(self._redraw_curves)
        self._tuning.moved.connect(self._move_curves)
        self.session.viewer.events.theme.connect(self._show_trust)
        self._show_trust()

    def _opened(self) -> None:
        super()._opened()
        self.session.viewer.events.theme.connect(self._show_trust)
        self._tuning.watch()

    def _closed(self) -> None:
        super()._closed()
        self.session.viewer.events.theme.disconnect(self._show_trust)
        self._tuning.end()

    def _methods(self) -> dict[str, Any]:
        known = self.session.state.psf
        if known is None:
            return fits()
        psf = known.psf
        return fits() | {KNOWN_PSF: MaximumLikelihood(psf=psf), KNOWN_PSF_EQ4: KnownPsf(psf)}

    def _fit(self) -> ResponseFit:
        """The method with all that is chosen for it."""
        method: ResponseFit = self._method.method
        if isinstance(method, MaximumLikelihood):
            return replace(method, prior=self._camera.prior)
        return method

    def _show_camera(self) -> None:
        """The methods of the paper assume nothing of the camera."""
        chosen = self._methods().get(self._method.chosen)
        self._camera.visible = isinstance(chosen, MaximumLikelihood)

    def _offer_methods(self) -> None:
        self._method.offer(self._methods())

    def _further(self, _: Any) -> list[tuple[str, ImageLayer | Path]]:
        """Photos beside the one at work: layers that were not made here, and added files."""
        layers = [
            (name, layer)
            for name, layer in self._photos(None)
            if layer is not self.session.photo and KEY not in layer.metadata
        ]
        return [*layers, *((str(path), path) for path in self._paths)]

    def _known_responses(self, _: Any) -> list[tuple[str, str | Layer]]:
        """Curves that can be assumed, and layers that say with which they were made."""
        layers = [
            (f"that of “{layer.name}”", layer)
            for layer in self.session.viewer.layers
            if (layer.metadata.get(KEY) or {}).get("response")
        ]
        return [*((name, name) for name in given()), *layers]

    def _chosen(self) -> Response:
        """The response under "or use"."""
        known = self._known.value
        if isinstance(known, Layer):
            curves = responses_from(known.metadata[KEY]["response"], f"“{known.name}”")
            return curves[0] if len(curves) == 1 else curves
        if known == GAMMA:
            return Gamma(self._gamma.value)
        curve: ResponseCurve = given()[known].curve
        return curve

    def _groups(self, _: Any) -> list[tuple[str, int]]:
        edges = self.session.state.edges
        return [
            (f"{number}: edges at {direction(group)}, {len(group)} profiles", number - 1)
            for number, group in enumerate(edges.groups if edges else (), start=1)
        ]

    def _chosen_group(self) -> ProfileGroup | None:
        edges, number = self.session.state.edges, self._group.value
        return None if edges is None or number is None else edges.groups[number]

    def _curves(self) -> Sequence[ResponseCurve]:
        """The response as it is, or as it is tuned."""
        fitted = self.session.state.fitted
        return self._tuning.curves or [e.curve for e in (fitted.estimates if fitted else ())]

    def _response_changed(self) -> None:
        self._show_trust()
        self._redraw_curves()

    def _edges_changed(self) -> None:
        self._group.reset_choices()
        self._show_trust()
        self._redraw_profiles()

    def _show_group_of(self, number: int | None) -> None:
        """Show the group of the selected edge."""
        edges = self.session.state.edges
        group = -1 if edges is None or number is None else edges.group_numbers[number]
        if group >= 0:
            self._group.value = group

    def _show_further(self) -> None:
        self._further_box.visible = bool(self._pool.value)

    def _show_gamma(self) -> None:
        self._gamma.visible = self._known.value == GAMMA

    def _show_trust(self) -> None:
        """Say how far the response can be trusted, and what to do if it cannot."""
        fitted = self.session.state.fitted
        self._trust.value = self.shaded(*trust_in(fitted, self._earlier()))
        self._trust.tooltip = "\n".join(f.value for f in fitted.findings) if fitted else ""

    def _earlier(self) -> bool:
        """Whether the edges have changed since the response was estimated from them."""
        state = self.session.state
        edges = state.fitted.edges if state.fitted else None
        return edges is not None and edges is not state.edges

    def _redraw_curves(self) -> None:
        self._curve.redraw()
        self._linear.redraw()

    def _redraw_profiles(self) -> None:
        self._recorded.redraw()
        self._linear.redraw()

    def _move_curves(self) -> None:
        """Follow the sliders."""
        curves, group = self._curves(), self._chosen_group()
        if self._tuning.curves:
            self._curve.move(lambda lines: move_curves(lines, curves))
        if group is not None and curves:
            self._linear.move(lambda lines: move_profiles(lines[0], group, curves))

    def _draw_curve(self, ax: "Axes") -> "Sequence[Artist]":
        fitted, palette = self.session.state.fitted, palette_of(self.session.viewer)
        estimates = fitted.estimates if fitted else ()
        references = {"gamma 2.2": Gamma(2.2)} | self._compared
        curves = self._tuning.curves
        return draw_response(ax, estimates, references, tuned=curves, palette=palette)

    def _draw_recorded(self, ax: "Axes") -> "Sequence[Artist]":
        group = self._chosen_group()
        if group is None:
            return _note(ax, "no profiles yet:\nfind or draw edges")
        return [draw_profiles(ax, group, palette=palette_of(self.session.viewer))]

    def _draw_linear(self, ax: "Axes") -> "Sequence[Artist]":
        group, curves = self._chosen_group(), self._curves()
        if group is None or not curves:
            return _note(ax, "no response yet")
        return [draw_profiles(ax, group, curves, palette=palette_of(self.session.viewer))]

    def _add_files(self, paths: Sequence[Path]) -> None:
        chosen = list(self._others.value)
        self._paths += [path for path in paths if path not in self._paths]
        self._others.reset_choices()
        self._others.value = [*chosen, *(path for path in paths if path not in chosen)]

    def _ask_files(self) -> None:
        self._add_files(ask_open_many(self.native, "Photos of the same camera", WRITABLE))

    def _ask_assumed(self) -> None:
        path = ask_open(self.native, "Camera response that is close", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.assume(path))

    def _ask_load(self) -> None:
        path = ask_open(self.native, "Camera response", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.load(path))

    def _ask_save(self) -> None:
        path = ask_save(self.native, "Save the camera response", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.save(path))

    def _ask_compare(self) -> None:
        if self._compared:
            self.compare(None)
            return
        path = ask_open(self.native, "Camera response to compare with", SUFFIXES)
        if path is not None:
            self.attempt(lambda: self.compare(path))


def trust_in(fitted: Fitted | None, earlier: bool) -> tuple[str, Level]:
    """What to tell of a response, and how it is meant.

    Parameters
    ----------
    fitted : Fitted or None
        The response, if there is one.
    earlier : bool
        Whether it was estimated from edges that have changed since.
    """
    if fitted is None:
        return NOTHING, Level.INFO
    statuses = {estimate.status for estimate in fitted.estimates}
    bare = [replace(estimate, findings=()) for estimate in fitted.estimates]
    said = sentences(Report("", responses=bare))
    text = " ".join(f"{name}: {sentence}" for name, sentence in said.items())
    text = "\n".join([text, *fitted.doubts])
    if ResponseStatus.NOT_CONVERGED in statuses:
        return text, Level.ERROR
    if earlier:
        return f"Response {EARLIER}.", Level.DOUBT
    return text, Level.INFO if statuses <= TRUSTED else Level.DOUBT


def _note(ax: "Axes", text: str) -> "Sequence[Artist]":
    """Say on empty axes why they are empty."""
    ax.set_axis_off()
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", fontsize=8)
    return []
