"""All in one: a button for the whole path."""

from typing import Any

from magicgui.widgets import Container, FloatSpinBox
from magicgui.widgets.bases import Widget

from ...pipeline import DeblurOptions
from ..preferences import preferences
from ..step import Step
from ..steps import deblurring
from .base import Dock
from .choices import PREFERRED, deconvolvers, fits, given, psf_estimators
from .forms import MethodForm


class DeblurDock(Dock):
    """Deblur a photo: edges, response, PSF and restoration in one step."""

    def body(self) -> list[Widget]:
        """The methods, and the button."""
        chosen = preferences()
        self._extent = FloatSpinBox(
            label="blur extent, px (0: automatic)",
            value=chosen.blur_extent or 0,
            min=0,
            max=200,
            tooltip="largest width of a blurred edge in pixels; 0: judged from the photo",
        )
        self._response = MethodForm(
            "response", fits() | given(), PREFERRED[chosen.response], "how the response is found"
        )
        self._psf = MethodForm("PSF", psf_estimators(), "automatic", "how the PSF is found")
        self._method = MethodForm(
            "deconvolution", deconvolvers(), "automatic", "how the blur is undone"
        )
        button = self.button(
            "Deblur the photo",
            "find edges, response and PSF, deconvolve in linear light, and show the result",
            lambda: self.run(block=False),
        )
        return [Container(widgets=[self._extent]), self._response, self._psf, self._method, button]

    def step(self) -> Step[Any, Any]:
        """The whole path with the chosen methods."""
        options = DeblurOptions(
            response=self._response.method,
            blur_extent=self._extent.value or None,
            psf=self._psf.method,
            method=self._method.method,
        )
        return deblurring(self.session, options)
