"""Forms for method objects: one control for each field, with the field's own documentation."""

import re
from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from inspect import cleandoc
from types import NoneType
from typing import Any, get_args, get_type_hints

from magicgui.widgets import CheckBox, ComboBox, Container, FloatSpinBox, Label, SpinBox
from magicgui.widgets.bases import ValueWidget, Widget
from psygnal import Signal
from qtpy.QtWidgets import QSizePolicy

from ...errors import REFUSALS, in_words

LARGEST = 1e6
LABELS = {"prior": "camera"}  # where the name of a field is no word of the user


class MethodForm(Container[Widget]):
    """A choice between methods, and the fields of the chosen one, hidden until asked for.

    Parameters
    ----------
    label : str
        What the methods do.
    methods : mapping of str to object
        Frozen dataclasses by name, with the values to begin with; None for "decide later".
    chosen : str
        Name of the method to begin with.
    tooltip : str
        What is chosen here.
    without : collection of str
        Fields that get no control, since they are chosen elsewhere.

    Attributes
    ----------
    edited : Signal
        Emitted when another method is chosen or a field has changed.
    """

    edited = Signal()

    def __init__(
        self,
        label: str,
        methods: Mapping[str, Any],
        chosen: str,
        tooltip: str,
        without: Collection[str] = (),
    ) -> None:
        super().__init__(labels=False)
        self.margins = (0, 0, 0, 0)
        self._methods, self._without = dict(methods), frozenset(without)
        self._choice = ComboBox(label=label, choices=list(methods), value=chosen, tooltip=tooltip)
        self._more = CheckBox(
            text="parameters", value=False, tooltip="show the parameters of the method"
        )
        self._fields: Container[ValueWidget[Any]] = Container(visible=False)
        self._refusal = sentence()
        self._refusal.visible = False
        self.extend([tight(self._choice, labels=True), self._more, self._fields, self._refusal])
        self._choice.changed.connect(self._rebuild)
        self._more.changed.connect(self._show_fields)
        self._rebuild()

    @property
    def chosen(self) -> str:
        """Name of the chosen method."""
        return str(self._choice.value)

    @chosen.setter
    def chosen(self, name: str) -> None:
        self._choice.value = name

    @property
    def method(self) -> Any:
        """The chosen method with the values of its fields, the last that it takes."""
        return self._good

    @property
    def refusal(self) -> str:
        """Why the values of the fields are not taken; empty if they are."""
        return str(self._refusal.value)

    def field(self, name: str) -> ValueWidget[Any]:
        """The control of a field; those of a method within it are named ``outer_inner``."""
        return self._fields[name]

    def offer(self, methods: Mapping[str, Any]) -> None:
        """Offer other methods; the chosen one stays with its fields if it is among them."""
        chosen, self._methods = self.chosen, dict(methods)
        with self._choice.changed.blocked():
            self._choice.choices = list(methods)
        if self.chosen != chosen:
            self._rebuild()
        else:
            self._take()

    def _rebuild(self) -> None:
        self._fields.clear()
        method = self._methods[self.chosen]
        if method is not None:
            self._fields.extend(_controls(method, without=self._without))
        self._shown = {control.name: control.value for control in self._fields}
        for control in self._fields:
            control.changed.connect(self._edit)
        self._more.enabled = len(self._fields) > 0
        self._show_fields()
        self._edit()

    def _edit(self) -> None:
        self._take()
        self.edited.emit()

    def _take(self) -> None:
        """Take the values of the fields, or say why the method cannot have them."""
        method, said = self._methods[self.chosen], ""
        # Untouched fields keep what was given: the controls may show fewer digits of it.
        touched = {c.name: c.value for c in self._fields if c.value != self._shown[c.name]}
        try:
            self._good = _changed(method, touched) if touched else method
        except REFUSALS as error:
            said = f"{in_words(error)}: the last values that fit are used"
        self._refusal.value = said
        self._refusal.visible = bool(said)

    def _show_fields(self) -> None:
        self._fields.visible = bool(self._more.value) and len(self._fields) > 0


def tight(*widgets: Widget, labels: bool = False, **options: Any) -> Container[Widget]:
    """Widgets in a container that takes no more room than they do."""
    container = Container[Widget](widgets=list(widgets), labels=labels, **options)
    container.margins = (0, 0, 0, 0)
    return container


def row(*widgets: Widget) -> Container[Widget]:
    """Widgets beside one another."""
    return tight(*widgets, layout="horizontal")


def sentence() -> Label:
    """A text as wide as the widget, in as many lines as it needs."""
    label = Label(value="")
    label.native.setWordWrap(True)
    label.native.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
    return label


def blur_extent_box(value: float | None) -> FloatSpinBox:
    """Asks for the largest width of a blurred edge in pixels; 0 stands for None."""
    return FloatSpinBox(
        label="blur extent, px (0: automatic)",
        value=value or 0,
        min=0,
        max=200,
        tooltip="largest width of a blurred edge in pixels; 0: judged from the photo",
    )


def documented(kind: type) -> dict[str, str]:
    """Description of each parameter in a numpydoc docstring, as plain text."""
    text = cleandoc(kind.__doc__ or "").partition("Parameters\n----------\n")[2]
    text = re.split(r"\n\n?[A-Z]\w+\n-+\n", text)[0]
    found = re.findall(r"^(\w+(?:, \w+)*) : [^\n]*\n((?:[ ]+[^\n]*\n?|\n(?=[ ]))+)", text, re.M)
    return {
        name: re.sub(r":\w+:`~?\.?([^`]*)`|`+", r"\1", " ".join(body.split()))
        for names, body in found
        for name in names.split(", ")
    }


def _controls(
    method: Any, prefix: str = "", without: Collection[str] = ()
) -> list[ValueWidget[Any]]:
    """A control for each field of a method, those of nested methods included."""
    described, hints = documented(type(method)), get_type_hints(type(method))
    controls = []
    for field in fields(method):
        value, name = getattr(method, field.name), prefix + field.name
        if not field.init or name in without:
            continue
        if is_dataclass(value):
            controls += _controls(value, name + "_", without)
        else:
            tooltip = described.get(field.name, field.name)
            control = _control(name, value, get_args(hints[field.name]), tooltip)
            controls += [] if control is None else [control]
    return controls


def _control(
    name: str, value: Any, kinds: Collection[Any], tooltip: str
) -> ValueWidget[Any] | None:
    optional = NoneType in kinds
    options: dict[str, Any] = {
        "name": name,
        "label": LABELS.get(name, name.replace("_", " ")),
        "tooltip": tooltip + (" (0: automatic)" if optional else ""),
    }
    if isinstance(value, bool):
        return CheckBox(value=value, **options)
    if isinstance(value, Enum):
        choices = [(str(member.value), member) for member in type(value)]
        return ComboBox(value=value, choices=choices, **options)
    if isinstance(value, int) or (value is None and int in kinds):
        return SpinBox(value=value or 0, min=0, max=int(LARGEST), **options)
    if isinstance(value, float) or (value is None and float in kinds):
        step = 10 ** _magnitude(value) if value else 0.001
        return FloatSpinBox(value=value or 0, min=0, max=LARGEST, step=step, **options)
    return None


def _magnitude(value: float) -> int:
    """Power of ten of the digit after the first of a positive value."""
    return int(f"{value:e}".partition("e")[2]) - 1


def _changed(method: Any, touched: Mapping[str, Any], prefix: str = "") -> Any:
    """A method with other values of the fields that the user has touched."""
    changes: dict[str, Any] = {}
    for field in fields(method):
        value, name = getattr(method, field.name), prefix + field.name
        if field.init and is_dataclass(value):
            changes[field.name] = _changed(value, touched, name + "_")
        elif name in touched:
            optional = "None" in str(field.type)
            changes[field.name] = None if optional and not touched[name] else touched[name]
    return replace(method, **changes)
