"""A form for methods of deconvolution, and how much of them: the amount by eye."""

from collections.abc import Mapping
from typing import Any

from magicgui.widgets import FloatSlider

from ...deconvolution import Deconvolver, Strengthened
from ...methods import MOST_STRENGTH
from ...pipeline import DEFAULT_METHOD
from .forms import MethodForm, tight


class DeconvolutionForm(MethodForm):
    """A choice between methods of deconvolution, and their strength.

    Parameters
    ----------
    methods : mapping of str to Deconvolver or None
        As for :class:`MethodForm`.
    chosen : str
        Name of the method to begin with.
    """

    def __init__(self, methods: Mapping[str, Any], chosen: str) -> None:
        super().__init__("deconvolution", methods, chosen, "how the blur is undone")
        self.strength = FloatSlider(
            label="strength",
            value=1.0,
            min=0.0,
            max=MOST_STRENGTH,
            step=0.05,
            tooltip="how much of it: 0 is the photo as it was, 1 what is found right, 2 the most",
        )
        self.strength.changed.connect(self._edit)
        self.append(tight(self.strength, labels=True))

    @property
    def method(self) -> Deconvolver | None:
        """The chosen method, as it is at strength 1."""
        method: Deconvolver | None = super().method
        if self.strength.value == 1:
            return method
        return Strengthened(method or DEFAULT_METHOD, self.strength.value)
