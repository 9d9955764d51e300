"""A response that is taken as known: a usual curve, or that with which a layer was made."""

from typing import Any

from magicgui.widgets import ComboBox, Container, FloatSpinBox, Label, PushButton
from magicgui.widgets.bases import Widget
from napari.layers import Layer

from ...io.responses import responses_from
from ...response import Gamma, Response, ResponseCurve
from ..pixels import KEY
from ..session.facade import Session
from .choices import given

GAMMA = "gamma"


class KnownResponse(Container[Widget]):
    """Asks for a response that is assumed.

    Parameters
    ----------
    session : Session
        Whose layers say with which response they were made.
    preferred : str
        What is chosen at first, if it is a known curve and no method.
    use : PushButton
        Takes it.
    """

    def __init__(self, session: Session, preferred: str, use: PushButton) -> None:
        super().__init__(layout="horizontal", labels=False)
        self.margins = (0, 0, 0, 0)
        self._session = session
        self._choice = ComboBox(
            choices=self._found,
            tooltip="a response that is assumed, or with which a layer was made",
        )
        self._choice.value = preferred if preferred in given() else GAMMA
        self.gamma = FloatSpinBox(
            value=2.2, min=0.1, max=10, step=0.1, tooltip="exponent of the gamma curve, no unit"
        )
        self.extend([Label(value="or use"), self._choice, self.gamma, use])
        self._choice.changed.connect(self._show_gamma)
        self._show_gamma()

    @property
    def chosen(self) -> str | Layer:
        """Name of a curve, or the layer that says with which one it was made."""
        value: str | Layer = self._choice.value
        return value

    @chosen.setter
    def chosen(self, value: str | Layer) -> None:
        self._choice.value = value

    @property
    def response(self) -> Response:
        """The curve, or those of the channels."""
        if isinstance(self.chosen, Layer):
            name = f"“{self.chosen.name}”"
            curves = responses_from(self.chosen.metadata[KEY]["response"], name)
            return curves[0] if len(curves) == 1 else curves
        if self.chosen == GAMMA:
            return Gamma(self.gamma.value)
        curve: ResponseCurve = given()[self.chosen].curve
        return curve

    def _found(self, _: Any) -> list[tuple[str, str | Layer]]:
        """Curves that can be assumed, and layers that say with which they were made."""
        layers = [
            (f"that of “{layer.name}”", layer)
            for layer in self._session.viewer.layers
            if (layer.metadata.get(KEY) or {}).get("response")
        ]
        return [*((name, name) for name in given()), *layers]

    def _show_gamma(self) -> None:
        self.gamma.visible = self.chosen == GAMMA
