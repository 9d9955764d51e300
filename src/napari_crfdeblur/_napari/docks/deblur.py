"""All in one: a button for the whole path."""

from typing import Any

from magicgui.widgets import Container
from magicgui.widgets.bases import Widget

from ...pipeline import DeblurOptions
from ..preferences import preferences
from ..session.step import Step
from ..session.whole import deblurring
from .base import Dock
from .choices import (
    PREFERRED,
    chosen_regions,
    deconvolvers,
    fits,
    given,
    psf_estimators,
    regions_box,
)
from .forms import MethodForm, blur_extent_box, tight
from .strength import DeconvolutionForm


class DeblurDock(Dock):
    """Deblur a photo: edges, response, PSF and restoration in one step."""

    def body(self) -> list[Widget]:
        """The methods, and the button."""
        chosen = preferences()
        self._extent = blur_extent_box(chosen.blur_extent)
        self._response = MethodForm(
            "response", fits() | given(), PREFERRED[chosen.response], "how the response is found"
        )
        self._psf = MethodForm("PSF", psf_estimators(), "automatic", "how the PSF is found")
        self._parts = regions_box()
        self._method = DeconvolutionForm(deconvolvers(), "automatic")
        button = self.button(
            "Deblur the photo",
            "find edges, response and PSF, deconvolve in linear light, and show the result",
            lambda: self.run(block=False),
        )
        return [
            Container(widgets=[self._extent]),
            self._response,
            self._psf,
            tight(self._parts, labels=True),
            self._method,
            button,
        ]

    def step(self) -> Step[Any, Any]:
        """The whole path with the chosen methods."""
        options = DeblurOptions(
            response=self._response.method,
            blur_extent=self._extent.value or None,
            psf=self._psf.method,
            method=self._method.method,
            regions=chosen_regions(self._parts),
        )
        return deblurring(self.session, options)
