"""Forms make methods: what is shown is what comes out, and every control says what it is."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from napari_crfdeblur import deconvolution, psf
from napari_crfdeblur._napari.docks import choices
from napari_crfdeblur._napari.docks.forms import MethodForm, documented
from napari_crfdeblur.deconvolution import HyperLaplacian, RichardsonLucy
from napari_crfdeblur.estimate import (
    GivenResponse,
    MaximumLikelihood,
    NoiseModel,
    RankMinimization,
    Tail,
)
from napari_crfdeblur.io import to_record
from napari_crfdeblur.psf import RadonFit, line
from napari_crfdeblur.response import SRGB, Cameras, Gamma, around

OFFERED = {
    "fits": choices.fits(),
    "given": choices.given(),
    "psf_estimators": choices.psf_estimators(),
    "deconvolvers": choices.deconvolvers(),
}
METHODS = [method for offered in OFFERED.values() for method in offered.values() if method]
# Those that wrap another method, or hold what was given.
# Those that need places in the picture come from what is drawn on it.
DRAWN = {"Beads", "MotionPath", "PsfAt"}
NOT_OFFERED = {"Deconvolver", "Strengthened", "Tiled", "PsfEstimator", "GivenPsf"} | DRAWN


def form(methods: dict[str, Any], chosen: str | None = None) -> MethodForm:
    return MethodForm("method", methods, chosen or next(iter(methods)), "how it is done")


@pytest.mark.parametrize("family", OFFERED)
def test_an_untouched_form_gives_the_method_itself(qtbot: QtBot, family: str) -> None:  # noqa: ARG001
    methods = OFFERED[family]
    for name, method in methods.items():
        assert form(methods, name).method is method


@pytest.mark.parametrize(
    ("stage", "base", "family"),
    [
        (deconvolution, deconvolution.Deconvolver, "deconvolvers"),
        (psf, psf.PsfEstimator, "psf_estimators"),
    ],
)
def test_every_method_of_a_stage_is_offered(stage: Any, base: type, family: str) -> None:
    members = [getattr(stage, name) for name in stage.__all__]
    kinds = {m.__name__ for m in members if isinstance(m, type) and issubclass(m, base)}
    assert kinds - NOT_OFFERED <= {type(method).__name__ for method in OFFERED[family].values()}


def another(name: str, value: Any) -> Any:
    """A value that every method takes for a field of this name."""
    if name == "size":
        return 25
    if not value and not isinstance(value, bool):
        return 0.05
    if isinstance(value, float):
        return 0.5 if value != 0.5 else 0.25
    return not value if isinstance(value, bool) else value + 1


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_every_number_of_every_method_can_be_edited(qtbot: QtBot, method: Any) -> None:  # noqa: ARG001
    shown = form({"one": method})
    values = {f.name: getattr(method, f.name) for f in fields(method) if f.init}
    given = {name for name, value in values.items() if isinstance(value, (int, float))}
    for name in given | {"size", "weight"} & values.keys():
        value = another(name, values[name])
        shown.field(name).value = value
        edited = getattr(shown.method, name)
        assert (edited, type(edited)) == (value, type(value))
        assert to_record(shown.method) == to_record(replace(method, **{name: value}))
        shown.field(name).value = values[name] or 0
    assert shown.method == method


@pytest.mark.parametrize(
    "kind", [psf.Variational, psf.XuJia, psf.Fergus, psf.Shan], ids=lambda kind: kind.__name__
)
def test_the_size_of_a_psf_is_automatic_again_at_zero(qtbot: QtBot, kind: Any) -> None:  # noqa: ARG001
    shown = form({"blind": kind(size=15)})
    shown.field("size").value = 0
    assert shown.method == kind()
    assert "0: automatic" in shown.field("size").tooltip
    shown.field("size").value = 16  # even
    assert "odd" in shown.refusal
    assert shown.method == kind()


def test_a_changed_field_changes_the_method(qtbot: QtBot) -> None:  # noqa: ARG001
    shown = form({"hyper": HyperLaplacian(), "rl": RichardsonLucy()})
    edited = []
    shown.edited.connect(lambda: edited.append(shown.method))
    shown.field("exponent").value = 0.8
    shown.field("weight").value = 0.002
    assert edited[-1] == HyperLaplacian(exponent=0.8, weight=0.002)
    shown.chosen = "rl"
    assert edited[-1] == RichardsonLucy()


def test_zero_stands_for_automatic(qtbot: QtBot) -> None:  # noqa: ARG001
    shown = form({"hyper": HyperLaplacian(weight=0.5)})
    shown.field("weight").value = 0
    assert shown.method == HyperLaplacian(weight=None)


def test_a_whole_number_can_be_automatic_too(qtbot: QtBot) -> None:  # noqa: ARG001
    shown = form({"edges": RadonFit()})
    assert shown.field("size").value == 0
    shown.field("size").value = 25
    assert shown.method == RadonFit(size=25)
    assert isinstance(shown.method.size, int)
    shown.field("size").value = 0
    assert shown.method == RadonFit()


def test_methods_within_methods_have_controls_too(qtbot: QtBot) -> None:  # noqa: ARG001
    shown = form({"rank": RankMinimization(), "gamma": GivenResponse(Gamma(2.2))})
    shown.field("tail").value = Tail.ALL
    shown.field("polynomial_degree").value = 4
    assert shown.method.tail is Tail.ALL
    assert shown.method.polynomial.degree == 4
    shown.chosen = "gamma"
    shown.field("curve_exponent").value = 1.8
    assert shown.method == GivenResponse(Gamma(1.8))


def test_a_known_response_starts_from_a_camera(qtbot: QtBot) -> None:  # noqa: ARG001
    shown = form({"likelihood": MaximumLikelihood(psf=line(5, 0.3))})
    assert shown.field("prior").choices == tuple(Cameras)
    shown.field("prior").value = Cameras.DORF
    shown.field("noise_floor").value = 0.002
    assert shown.method.prior is Cameras.DORF
    assert shown.method.noise == NoiseModel(floor=0.002)
    np.testing.assert_array_equal(shown.method.psf, line(5, 0.3))


@pytest.mark.parametrize("known", [None, line(5, 0.3)])
def test_only_numbers_and_choices_have_controls(qtbot: QtBot, known: Any) -> None:  # noqa: ARG001
    method = MaximumLikelihood(around(SRGB()), psf=known)
    shown = MethodForm("method", {"likelihood": method}, "likelihood", "how", without=["noise"])
    names = {control.name for control in shown._fields}
    assert {"prior", "psf", "prior_mean"} & names == set()
    assert "shift" in names


def test_a_field_that_is_chosen_elsewhere_has_no_control(qtbot: QtBot) -> None:  # noqa: ARG001
    method = MaximumLikelihood(Cameras.SRGB)
    shown = MethodForm("method", {"one": method}, "one", "how", without=["prior", "noise_floor"])
    assert next(control.name for control in shown._fields) == "noise_mismatch"
    shown.field("shift").value = 0.4
    assert shown.method.prior is Cameras.SRGB


def test_a_value_that_a_method_does_not_take_is_said_beside_it(qtbot: QtBot) -> None:  # noqa: ARG001
    shown = form({"hyper": HyperLaplacian()})
    shown.field("exponent").value = 0.5
    shown.field("exponent").value = 5.0
    assert "exponent" in shown.refusal
    assert shown.method == HyperLaplacian(exponent=0.5)
    shown.field("exponent").value = 0.75
    assert shown.refusal == ""
    assert shown.method == HyperLaplacian(exponent=0.75)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_whatever_is_typed_the_method_is_one_that_its_class_takes(
    qtbot: QtBot,  # noqa: ARG001
    method: Any,
) -> None:
    rng = np.random.default_rng(6)
    shown = form({"one": method})
    for _ in range(40 if len(shown._fields) else 0):
        control = shown._fields[int(rng.integers(len(shown._fields)))]
        before = shown.method
        control.value = typed(rng, control)
        assert to_record(replace(shown.method)) == to_record(shown.method)
        if shown.refusal:
            assert shown.method is before
            assert shown.refusal.isprintable()


def typed(rng: np.random.Generator, control: Any) -> Any:
    """A value that a control can have, often one at the ends of its range."""
    if hasattr(control, "choices"):
        return control.choices[int(rng.integers(len(control.choices)))]
    if isinstance(control.value, bool):
        return bool(rng.integers(2))
    values = [control.min, control.max, 1, 2, 3, float(rng.uniform(0, 2)), rng.uniform(0, 1e6)]
    return type(control.value)(values[int(rng.integers(len(values)))])


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_every_field_is_documented_for_its_tooltip(method: Any) -> None:
    described = documented(type(method))
    for field in fields(method):
        if field.init and not is_dataclass(getattr(method, field.name)):
            assert described.get(field.name), field.name
            assert "`" not in described[field.name]
