"""A response tuned by hand, with sliders: seen at once, used only when asked for."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from magicgui.widgets import CheckBox, Container, FloatSlider, PushButton
from magicgui.widgets.bases import Widget
from napari.layers import Image as ImageLayer
from psygnal import Signal, SignalInstance
from qtpy.QtCore import QTimer

from ...errors import REFUSALS, CrfDeblurError, in_words
from ...response import ResponseCurve, tuned
from ...response.prior import DORF_DEVIATIONS
from ..outputs import remove_preview
from ..session.facade import Session
from ..session.restore import previewing
from ..session.step import Effects, Level, Step
from ..tasks import Runner
from .forms import tight

COEFFICIENTS = 3  # sliders: the further ones change a curve less than can be seen
DEVIATIONS = 2  # reach of a slider, in standard deviations over the cameras of DoRF
GAMMAS = 0.4, 2.5


class Tuning(Container[Widget]):
    """Sliders on top of the present response, and a preview of what they do.

    Parameters
    ----------
    session : Session
        Whose response is tuned; nothing of it changes.
    runner : Runner
        Runs the previews: one at a time, the newest curve next.
    use : PushButton
        Button that makes the tuned curve the response.

    Attributes
    ----------
    toggled : Signal
        Emitted when tuning begins or ends.
    moved : Signal
        Emitted when the curve has changed, at most once in a turn of the event loop.
    """

    toggled = Signal()
    moved = Signal()

    def __init__(self, session: Session, runner: Runner, use: PushButton) -> None:
        super().__init__(labels=False)
        self._session, self._runner = session, runner
        self._previewed: ImageLayer | None = None
        self._slid = self._wanted = False
        self._round = 0  # previews of an earlier one come too late
        self._timer = QTimer()
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._turn)
        self._on = CheckBox(
            text="tune by hand",
            value=False,
            tooltip="change the curve with sliders; nothing else changes until you use it",
        )
        self._sliders: list[FloatSlider] = [*_offset_sliders(), _gamma_slider()]
        self._rest = [slider.value for slider in self._sliders]
        self._preview = CheckBox(
            text="preview",
            value=False,
            tooltip="deblur what the canvas shows with the tuned curve; needs a PSF",
        )
        reset = PushButton(text="Reset", tooltip="return to the response as it is")
        row = tight(self._preview, reset, use, layout="horizontal")
        self._box = tight(tight(*self._sliders, labels=True), row, visible=False)
        self.margins = (0, 0, 0, 0)
        self.extend([self._on, self._box])
        self._connect(reset)

    @property
    def on(self) -> bool:
        """Whether the response is being tuned."""
        return bool(self._on.value)

    @on.setter
    def on(self, value: bool) -> None:
        self._on.value = value

    @property
    def previews(self) -> bool:
        """Whether what is visible is deblurred with the tuned curve."""
        return self.on and bool(self._preview.value) and self._session.state.psf is not None

    @previews.setter
    def previews(self, value: bool) -> None:
        self._preview.value = value

    @property
    def curves(self) -> tuple[ResponseCurve, ...]:
        """The tuned response: one curve, or one for each channel; none while not tuning."""
        fitted = self._session.state.fitted
        if not self.on or fitted is None:
            return ()
        *offsets, gamma = (slider.value for slider in self._sliders)
        return tuple(tuned(estimate.curve, offsets, gamma) for estimate in fitted.estimates)

    def tune(self, *offsets: float, gamma: float = 1.0) -> None:
        """Move the sliders: offsets of the EMoR coefficients, the first ones, and a gamma."""
        self.on = True
        given = (*offsets, *[0.0] * (COEFFICIENTS - len(offsets)), gamma)
        for slider, value in zip(self._sliders, given, strict=True):
            slider.value = value

    def used(self) -> tuple[ResponseCurve, ...]:
        """The tuned response, to be used.

        Raises
        ------
        CrfDeblurError
            There is no response, or no slider has been moved.
        """
        self._session.required_response()
        if not self.curves or [s.value for s in self._sliders] == self._rest:
            raise CrfDeblurError("the curve is still as it was: move a slider first")
        return self.curves

    def reset(self) -> None:
        """Return to the response as it is, without a preview."""
        for slider, value in zip(self._sliders, self._rest, strict=True):
            with slider.changed.blocked():
                slider.value = value
        self._stop_previews()
        self._slid = True
        self._timer.start()

    def refresh(self) -> None:
        """Allow what the session permits: tuning with a response, previews with a PSF."""
        self._box.enabled = self._session.state.fitted is not None
        self._preview.enabled = self._session.state.psf is not None

    def watch(self) -> None:
        """Follow the session; once is enough."""
        for signal, act in self._followed():
            signal.connect(act, unique=True)

    def end(self) -> None:
        """Follow it no more, and leave no preview; the controls may be gone already."""
        for signal, act in self._followed():
            signal.disconnect(act, missing_ok=True)
        self._timer.stop()
        self._slid = False
        self._stop_previews()

    def _followed(self) -> list[tuple[SignalInstance, Callable[..., None]]]:
        return [
            (self._session.response_changed, self._response_changed),
            (self._session.psf_changed, self.refresh),
            (self._runner.changed, self._runner_changed),
        ]

    def _connect(self, reset: PushButton) -> None:
        self._on.changed.connect(self._toggle)
        for slider in self._sliders:
            slider.changed.connect(self._slide)
        self._preview.changed.connect(self._preview_chosen)
        reset.changed.connect(lambda: self.reset())
        self.watch()
        self.refresh()

    def _toggle(self) -> None:
        self._box.visible = self.on
        self.reset()
        self.toggled.emit()

    def _slide(self) -> None:
        self._slid = self._wanted = True
        self._timer.start()

    def _preview_chosen(self) -> None:
        if self.previews:
            self._slide()
        else:
            self._stop_previews()

    def _response_changed(self) -> None:
        self.refresh()
        self.reset()

    def _runner_changed(self) -> None:
        if self._wanted:
            self._timer.start()

    def _turn(self) -> None:
        if self._slid:
            self._slid = False
            self.moved.emit()
        # A preview in the place of the one under way would never be seen while a slider moves.
        if self._wanted and self._runner.idle:
            self._wanted = False
            if self.previews and self.curves:
                self._start_preview()

    def _start_preview(self) -> None:
        curves = self.curves
        try:
            step = previewing(self._session, curve=curves[0] if len(curves) == 1 else curves)
        except REFUSALS as error:
            self._session.say(f"preview: {in_words(error)}", Level.ERROR)
            return
        show = partial(self._show, self._round, self._session.photo, step)
        self._session.start(replace(step, finish=show))

    def _show(
        self, wanted: int, photo: ImageLayer, step: Step[Any, ImageLayer], pixels: Any
    ) -> Effects[Any]:
        """Show a preview, unless it is wanted no more."""
        if wanted == self._round:
            self._previewed = photo
            return (yield from step.finish(pixels))
        return None

    def _stop_previews(self) -> None:
        self._wanted = False
        self._round += 1
        if self._previewed is not None:
            remove_preview(self._session, self._previewed)
            self._previewed = None


def _offset_sliders() -> list[FloatSlider]:
    """Sliders for the first coefficients, as far as cameras differ in them."""
    return [
        FloatSlider(
            label=f"EMoR {number}",
            value=0,
            min=-round(DEVIATIONS * deviation, 1),
            max=round(DEVIATIONS * deviation, 1),
            step=0.02,
            tooltip=f"added to coefficient {number} of the EMoR model, no unit; as far as cameras "
            "differ, less where the curve would fall",
        )
        for number, deviation in enumerate(DORF_DEVIATIONS[:COEFFICIENTS], start=1)
    ]


def _gamma_slider() -> FloatSlider:
    low, high = GAMMAS
    return FloatSlider(
        label="gamma",
        value=1,
        min=low,
        max=high,
        step=0.01,
        tooltip="power to which the light is raised after the response is undone; 1: as it is",
    )
