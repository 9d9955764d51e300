"""The response dock: what its buttons do, what it says and draws, and tuning by hand."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.docks import ResponseDock
from napari_crfdeblur._napari.docks import response as module
from napari_crfdeblur._napari.docks.base import SHADES
from napari_crfdeblur._napari.docks.response import KNOWN_PSF, KNOWN_PSF_EQ4
from napari_crfdeblur._napari.docks.trust import EARLIER, trust_in
from napari_crfdeblur._napari.preferences import Preferences
from napari_crfdeblur._napari.session.state import MOST_DOUBTS, Fitted
from napari_crfdeblur._napari.session.step import Level
from napari_crfdeblur.estimate import (
    Finding,
    GivenResponse,
    KnownPsf,
    MaximumLikelihood,
    MeanProfile,
    PerChannel,
    RankMinimization,
    ResponseEstimate,
    Responses,
    ResponseStatus,
)
from napari_crfdeblur.io import to_record, write_photo, write_responses
from napari_crfdeblur.io.responses import responses_content
from napari_crfdeblur.psf import line
from napari_crfdeblur.response import SRGB, Cameras, Gamma, Identity, Tuned

pytestmark = pytest.mark.usefixtures("qapp")
LEVELS = np.linspace(0, 1, 65)


@pytest.fixture
def dock(edged: Session) -> ResponseDock:
    """The dock on a photo with edges."""
    return ResponseDock(edged.viewer)


@pytest.fixture
def few(dock: ResponseDock) -> ResponseDock:
    """The dock on a photo with a few edges, for a quick estimate."""
    good = [edge for edge in dock.session.state.edges.edges if edge.good]
    dock.session.set_edges(good[:6])
    return dock


@pytest.fixture
def estimated(dock: ResponseDock, fitted: Fitted) -> ResponseDock:
    """The dock on a photo with edges and a response estimated from them."""
    dock.session.commit(dock.session.photo, replace(dock.session.state, fitted=fitted))
    return dock


@pytest.fixture
def empty(viewer: ViewerModel) -> ResponseDock:
    """The dock in a viewer without layers."""
    return ResponseDock(viewer)


@pytest.fixture
def said(session: Session) -> list[Any]:
    """What the user was told."""
    messages: list[Any] = []
    session.said.connect(messages.append)
    return messages


def labels(dock: ResponseDock) -> list[str]:
    """What the legend of the curves names."""
    return [text.get_text() for text in dock._plots.curve.axes.get_legend().get_texts()]


def irradiance(curve: Any) -> Any:
    return curve.to_irradiance(LEVELS)


def estimate(status: ResponseStatus, *findings: Finding) -> ResponseEstimate:
    curve = Gamma(2.0)
    band = irradiance(curve)
    covered = (0.1, 0.9)
    return ResponseEstimate(curve, LEVELS, band, band, covered, status, findings=findings)


def a_file(path: Path, *curves: Any) -> Path:
    write_responses(path, [GivenResponse(curve).estimate() for curve in curves])
    return path


def press(dock: ResponseDock, text: str) -> None:
    next(button for button in dock._buttons if button.text == text).changed.emit(True)


def test_the_button_estimates_what_the_verb_does(few, qtbot):
    dock = few
    by_verb = dock.session.estimate_response()
    press(dock, "Estimate the response")
    qtbot.waitUntil(lambda: not dock.busy, timeout=20000)
    by_button = dock.session.state.fitted
    assert by_button is not by_verb
    np.testing.assert_array_equal(irradiance(by_button.curve), irradiance(by_verb.curve))


def test_a_cancelled_estimate_changes_nothing(dock, qtbot):
    before = dock.session.state
    dock.run(block=False)
    dock.cancel()
    qtbot.waitUntil(lambda: dock.runner.idle)
    qtbot.wait(100)
    assert dock.session.state is before


def test_the_method_of_the_settings_comes_first(viewer, monkeypatch):
    monkeypatch.setattr(module, "preferences", lambda: Preferences(response="mean"))
    assert ResponseDock(viewer)._method.method == MeanProfile()
    monkeypatch.setattr(module, "preferences", lambda: Preferences(response="srgb"))
    dock = ResponseDock(viewer)
    assert dock._method.chosen == "maximum likelihood"
    assert dock._known.response == SRGB()


def test_nothing_chosen_is_the_default(dock):
    assert to_record(dock._fit()) == to_record(MaximumLikelihood())


@pytest.mark.parametrize(
    ("name", "kind"), [(KNOWN_PSF, MaximumLikelihood), (KNOWN_PSF_EQ4, KnownPsf)]
)
def test_the_known_psf_is_a_method_only_when_there_is_one(few, name, kind):
    dock = few
    assert name not in dock._methods()
    with pytest.raises(ValueError, match="known PSF"):
        dock._method.chosen = name
    dock.session.set_psf(line(7, 0.4))
    dock._method.chosen = name
    assert isinstance(dock._fit(), kind)
    np.testing.assert_array_equal(dock._fit().psf, dock.session.state.psf.psf)
    assert dock.run().estimates[0].status is not ResponseStatus.GIVEN
    dock.session.photo = None
    assert dock._method.chosen == "maximum likelihood"


def test_another_psf_leaves_the_fields_of_the_method(dock):
    dock._method.field("shift").value = 0.5
    dock.session.set_psf(line(7, 0.4))
    assert dock._fit().shift == 0.5


@pytest.mark.parametrize("kind", Cameras)
def test_the_kind_of_camera_reaches_the_method(few, kind):
    few.assume(kind)
    fitted = few.run()
    method = few.session.state.fitted.method
    assert method.prior is kind
    by_verb = few.session.estimate_response(MaximumLikelihood(kind))
    np.testing.assert_array_equal(irradiance(fitted.curve), irradiance(by_verb.curve))


def test_the_methods_of_the_paper_assume_no_camera(dock):
    dock.native.show()
    assert dock._camera.visible
    dock.assume(Cameras.SRGB)
    dock._method.chosen = "rank minimization"
    assert not dock._camera.visible
    assert dock._fit() == RankMinimization()
    dock._method.chosen = "maximum likelihood"
    assert dock._camera.visible
    assert dock._fit().prior is Cameras.SRGB
    dock.native.hide()


def test_a_camera_close_to_that_of_a_file_can_be_assumed(dock, tmp_path, monkeypatch):
    path = a_file(tmp_path / "phone.json", Gamma(1.7))
    monkeypatch.setattr(module, "ask_open", lambda *_: path)
    press(dock, "File...")
    assert dock._camera.chosen == path
    curve = dock._fit().prior.curve()
    np.testing.assert_allclose(irradiance(curve), irradiance(Gamma(1.7)), atol=1e-3)
    dock.session.viewer.add_image(np.zeros((20, 30)), name="other")
    assert dock._camera.chosen == path
    assert dock.session.state.fitted is None


def test_a_file_that_is_no_single_response_is_not_assumed(dock, tmp_path, said):
    three = a_file(tmp_path / "three.json", Gamma(1.7), Gamma(1.8), Gamma(1.9))
    with pytest.raises(CrfDeblurError, match=r"three\.json.*one curve for all"):
        dock.assume(three)
    with pytest.raises(CrfDeblurError, match="nowhere"):
        dock.assume(str(tmp_path / "nowhere.json"))
    assert dock._camera.chosen is Cameras.DIGITAL
    gone = a_file(tmp_path / "gone.json", Gamma(1.7))
    dock.assume(gone)
    gone.unlink()
    dock.run(block=False)
    assert "gone.json" in said[-1].text
    assert said[-1].level is Level.ERROR


def test_a_camera_close_to_that_of_a_layer_can_be_assumed(dock, blurred):
    dock.session.set_response(Gamma(1.7))
    light = dock.session.linearize()
    assert light not in dock._camera.offered
    dock.photo = dock.session.viewer.add_image(blurred.photo, name="other")
    dock.assume(light)
    curve = dock._fit().prior.curve()
    np.testing.assert_allclose(irradiance(curve), irradiance(Gamma(1.7)), atol=1e-3)
    light.metadata.clear()
    with pytest.raises(CrfDeblurError, match="linear"):
        dock.run()


def test_long_names_of_layers_leave_the_dock_as_wide(dock, blurred):
    dock.session.viewer.add_image(blurred.photo, name="other")
    dock.photo = dock.session.viewer.layers["other"]
    metadata = {
        "napari-crfdeblur": {"response": responses_content([estimate(ResponseStatus.GOOD)])}
    }
    before = dock._camera.native.minimumSizeHint().width()
    layer = dock.session.viewer.add_image(np.zeros((9, 7)), name="long " * 30, metadata=metadata)
    assert layer in dock._camera.offered
    assert dock._camera.native.minimumSizeHint().width() == before


def test_what_another_photo_told_of_its_camera_can_be_assumed(estimated, blurred):
    dock, first = estimated, estimated.photo
    assert first not in dock._camera.offered
    dock.photo = dock.session.viewer.add_image(blurred.photo[::-1], name="other")
    dock.assume(first)
    assert dock._fit().prior is dock.session.state_of(first).fitted.estimates[0].posterior
    dock.photo = first
    assert dock._camera.chosen is Cameras.DIGITAL


def test_a_gray_photo_has_one_curve(dock, blurred):
    dock._per_channel.value = True
    assert dock._per_channel.enabled
    dock.photo = dock.session.viewer.add_image(blurred.photo[..., 1], name="gray")
    assert not dock._per_channel.enabled
    assert not dock._per_channel.value


def test_each_channel_gets_its_curve_and_is_drawn(few):
    dock = few
    dock._per_channel.value = True
    dock.assume(Cameras.SRGB)
    assert len(dock.run().estimates) == 3
    assert isinstance(dock.session.state.fitted.method, PerChannel)
    assert {"red", "green", "blue"} <= set(labels(dock))


def test_a_further_photo_adds_its_edges(few, blurred):
    dock = few
    alone = len(dock.run().groups)
    other = dock.session.viewer.add_image(blurred.photo[:75, ::-1], name="other")
    dock.others = [other]
    assert len(dock.run().groups) > alone
    dock._further.pool.value = False
    assert dock.others == []


def test_a_further_photo_can_be_a_file(few, blurred, tmp_path):
    dock = few
    path = tmp_path / "other.png"
    write_photo(path, blurred.photo[:75, ::-1])
    dock.others = [path]
    assert any(s.image == 1 for group in dock.run().groups for s in group.sources)


def test_a_bad_file_is_named_and_changes_nothing(dock, qtbot, tmp_path, said):
    path = tmp_path / "broken.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\nno picture")
    before = dock.session.state
    dock.others = [path]
    dock.run(block=False)
    qtbot.waitUntil(lambda: not dock.busy)
    assert dock.session.state is before
    assert said[-1].level is Level.ERROR
    assert "broken.png" in said[-1].text
    dock.others = [tmp_path / "nowhere.png"]
    with pytest.raises(CrfDeblurError, match=r"nowhere\.png"):
        dock.run()


def test_a_gray_file_for_three_curves_is_named(dock, blurred, tmp_path):
    path = tmp_path / "gray.png"
    write_photo(path, blurred.photo[:75, :, 0])
    dock.others, dock._per_channel.value = [path], True
    with pytest.raises(CrfDeblurError, match=r"gray\.png.*one response for all"):
        dock.run()


def test_chosen_files_stay_chosen_when_layers_come_and_go(dock, blurred, tmp_path):
    dock.others = [tmp_path / "one.png"]
    other = dock.session.viewer.add_image(blurred.photo, name="other")
    dock._further.add_files([tmp_path / "two.png"])
    assert dock.others == [tmp_path / "one.png", tmp_path / "two.png"]
    assert other in dock._further.choice.choices
    dock.session.viewer.layers.remove(other)
    assert other not in dock._further.choice.choices


@pytest.mark.parametrize(
    ("name", "curve"), [("gamma", Gamma(1.9)), ("sRGB", SRGB()), ("linear", Identity())]
)
def test_a_response_can_be_assumed(dock, name, curve):
    dock._known.chosen, dock._known.gamma.value = name, 1.9
    assert dock.use().curve == curve
    assert dock._known.gamma.native.isHidden() == (name != "gamma")


def test_the_response_of_a_layer_can_be_used(dock, blurred):
    dock.session.set_response(Gamma(1.7))
    light = dock.session.linearize()
    other = dock.session.viewer.add_image(blurred.photo, name="other")
    dock.photo = other
    dock._known.chosen = light
    np.testing.assert_allclose(irradiance(dock.use().curve), irradiance(Gamma(1.7)), atol=1e-4)


def test_a_damaged_response_of_a_layer_is_refused_by_name(dock, said):
    metadata = {"napari-crfdeblur": {"response": {"format": "other"}}}
    layer = dock.session.viewer.add_image(np.zeros((9, 7)), name="odd", metadata=metadata)
    dock._known.chosen = layer
    press(dock, "Use")
    assert said[-1].level is Level.ERROR
    assert "odd" in said[-1].text


def test_a_saved_response_is_loaded_again(estimated, tmp_path):
    dock, before = estimated, estimated.session.state.fitted.curve
    dock.save(tmp_path / "curve.json")
    dock.session.set_response(SRGB())
    after = dock.load(tmp_path / "curve.json").curve
    np.testing.assert_allclose(irradiance(after), irradiance(before), atol=1e-3)


def test_the_dialogs_lead_to_the_same(dock, tmp_path, monkeypatch, said):
    dock.session.set_response(Gamma(1.7))
    path = tmp_path / "curve.json"
    monkeypatch.setattr(module, "ask_save", lambda *_: path)
    press(dock, "Save...")
    dock.session.set_response(SRGB())
    monkeypatch.setattr(module, "ask_open", lambda *_: path)
    press(dock, "Compare with...")
    press(dock, "Load...")
    assert "curve" in labels(dock)
    monkeypatch.setattr(module, "ask_open_many", lambda *_: [tmp_path / "a.png"])
    press(dock, "Add files...")
    assert dock._further.choice.value == [tmp_path / "a.png"]
    assert all(message.level is Level.INFO for message in said)


@pytest.mark.parametrize("content", ["no JSON", '{"format": "crfdeblur-edges"}'])
def test_a_file_of_another_format_is_refused(dock, tmp_path, monkeypatch, said, content):
    path = tmp_path / "other.json"
    path.write_text(content)
    monkeypatch.setattr(module, "ask_open", lambda *_: path)
    for text in ("Load...", "Compare with..."):
        before = dock.session.state
        press(dock, text)
        assert said[-1].level is Level.ERROR
        assert "other.json" in said[-1].text
        assert dock.session.state is before


def test_three_curves_do_not_fit_a_gray_photo(dock, blurred, tmp_path):
    path = a_file(tmp_path / "three.json", Gamma(1.7), Gamma(1.8), Gamma(1.9))
    dock.load(path)
    dock.photo = dock.session.viewer.add_image(blurred.photo[..., 1], name="gray")
    with pytest.raises(CrfDeblurError, match=r"gray.*one curve"):
        dock.load(path)


def test_nothing_to_save_is_said(dock, tmp_path, monkeypatch, said):
    monkeypatch.setattr(module, "ask_save", lambda *_: tmp_path / "curve.json")
    press(dock, "Save...")
    assert "no response yet" in said[-1].text
    assert not (tmp_path / "curve.json").exists()


def test_a_loaded_curve_is_drawn_beside_until_it_is_dropped(dock, tmp_path):
    assert labels(dock) == ["gamma 2.2"]
    dock.session.set_response(Gamma(1.8))
    dock.compare(a_file(tmp_path / "phone.json", SRGB()))
    assert labels(dock) == ["gamma 2.2", "phone", "given"]
    dock.compare(a_file(tmp_path / "slr.json", Gamma(1.7), Gamma(1.8), Gamma(1.9)))
    assert labels(dock)[1:4] == ["slr red", "slr green", "slr blue"]
    dock.compare(None)
    assert labels(dock) == ["gamma 2.2", "given"]


@pytest.mark.parametrize(
    ("status", "level"),
    [
        (ResponseStatus.GOOD, Level.INFO),
        (ResponseStatus.GIVEN, Level.INFO),
        (ResponseStatus.DOUBTFUL, Level.DOUBT),
        (ResponseStatus.CANNOT_TELL, Level.DOUBT),
        (ResponseStatus.NOT_CONVERGED, Level.ERROR),
    ],
)
def test_trust_is_told_in_words_and_color(status, level):
    text, found = trust_in(Fitted(Responses((estimate(status),))), earlier=False)
    assert status.value in text
    assert found is level


def test_one_doubtful_channel_is_named():
    good, bad = (estimate(s) for s in (ResponseStatus.GOOD, ResponseStatus.DOUBTFUL))
    text, level = trust_in(Fitted(Responses((good, good, bad))), earlier=False)
    assert "(blue)" in text
    assert level is Level.DOUBT


def test_the_first_reasons_stand_below_and_all_in_the_tooltip(dock):
    own = (Finding.NARROW, Finding.UNSURE), (Finding.NARROW,), (Finding.ALIKE, Finding.MISFIT)
    channels = tuple(estimate(ResponseStatus.CANNOT_TELL, *each) for each in own)
    dock.session.commit(dock.photo, replace(dock.session.state, fitted=Fitted(Responses(channels))))
    sentence, *why = dock._trust.value.split("<br>")
    assert SHADES["dark"][Level.DOUBT] in sentence
    assert ResponseStatus.CANNOT_TELL.value in sentence
    assert len(why) == MOST_DOUBTS
    assert Finding.NARROW.value in why[0]
    assert Finding.UNSURE.value in why[1]
    named = (Finding.NARROW, Finding.UNSURE, Finding.ALIKE, Finding.MISFIT)
    assert dock._trust.tooltip == "\n".join(finding.value for finding in named)
    dock.session.set_response(SRGB())
    assert "<br>" not in dock._trust.value
    assert not dock._trust.tooltip


def test_an_estimate_from_earlier_edges_is_told(estimated):
    dock = estimated
    assert EARLIER not in dock._trust.value
    dock.session.remove_edges([0])
    assert EARLIER in dock._trust.value
    assert SHADES["dark"][Level.DOUBT] in dock._trust.value
    dock.session.viewer.theme = "light"
    assert SHADES["light"][Level.DOUBT] in dock._trust.value
    dock.session.undo_edges()
    assert EARLIER not in dock._trust.value


def test_the_profiles_fall_on_one_another_once_linearized(dock, fitted):
    assert "no response" in dock._plots.linear.axes.texts[0].get_text()
    dock.session.commit(dock.photo, replace(dock.session.state, fitted=fitted))

    def spread(plot):
        rows = np.array([s[:, 1] for s in plot.axes.collections[0].get_segments()])
        return np.median(rows.std(axis=0))

    assert spread(dock._plots.linear) < spread(dock._plots.recorded)


def test_the_group_of_the_selected_edge_is_shown(dock):
    session = dock.session
    number = next(n for n in range(len(session.state.edges.edges)) if edge_group(session, n) == 1)
    session.selected = number
    assert dock._plots.group.value == 1
    shown = dock._plots.recorded.axes.collections[0].get_segments()
    assert len(shown) == len(session.state.edges.groups[1])
    session.selected = None
    assert dock._plots.group.value == 1


def test_fewer_groups_leave_one_that_there_is(dock):
    edges = dock.session.state.edges
    dock._plots.group.value = len(edges.groups) - 1
    dock.session.set_edges([])
    assert "no profiles" in dock._plots.recorded.axes.texts[0].get_text()
    dock.session.undo_edges()
    assert dock._plots.group.value in range(len(edges.groups))


def edge_group(session: Session, number: int) -> int:
    return session.state.edges.group_numbers[number]


def test_without_a_photo_every_button_says_so(empty):
    messages: list[Any] = []
    empty.session.said.connect(messages.append)
    for text in ("Estimate the response", "Use", "Use this curve"):
        press(empty, text)
        assert messages[-1].level is Level.ERROR
    assert not empty.busy


def test_without_edges_the_estimate_says_what_to_do(session, said):
    dock = ResponseDock(session.viewer)
    dock.run(block=False)
    assert "find them automatically, or draw some" in said[-1].text


def test_sliders_change_the_plots_and_nothing_else(estimated):
    dock = estimated
    before = dock.session.state
    dock.tuning.tune(1.0, 0.2, gamma=1.3)
    (curve,) = dock.tuning.curves
    assert isinstance(curve, Tuned)
    assert curve.gamma == 1.3
    line = dock._plots.curve.axes.lines[-1]
    np.testing.assert_allclose(line.get_ydata(), curve.to_irradiance(line.get_xdata()))
    assert labels(dock)[-1] == "tuned"
    assert dock.session.state is before


def test_sliders_are_followed_once_in_a_turn(dock, qtbot):
    dock.session.set_response(Gamma(2.0))
    dock.tuning.on = True
    qtbot.wait(20)
    moved: list[Any] = []
    dock.tuning.moved.connect(lambda: moved.append(dock.tuning.curves[0].gamma))
    for gamma in (1.1, 1.2, 1.3):
        dock.tuning.tune(gamma=gamma)
    qtbot.waitUntil(lambda: bool(moved))
    qtbot.wait(20)
    assert moved == [1.3]


def test_moving_a_slider_moves_the_drawn_curves(dock, qtbot):
    dock.session.set_response(Gamma(2.0))
    dock.tuning.on = True
    line, rows = dock._plots.curve.axes.lines[-1], dock._plots.linear.axes.collections[0]
    before = np.array(rows.get_segments())
    dock.tuning.tune(gamma=1.5)
    qtbot.waitUntil(lambda: not np.array_equal(rows.get_segments(), before))
    np.testing.assert_allclose(line.get_ydata(), line.get_xdata() ** 3.0)


def test_offsets_of_any_size_leave_a_response(dock):
    dock.session.set_response(Gamma(2.2))
    dock.tuning.tune(-6.8, 2.6, -0.9, gamma=0.4)
    assert np.all(np.diff(irradiance(dock.tuning.curves[0])) > 0)


def test_a_tuned_curve_becomes_the_response(dock):
    base = dock.session.set_response(Gamma(2.0)).curve
    dock.tuning.tune(0.5, gamma=1.2)
    (curve,) = dock.tuning.curves
    assert dock.use_tuned().curve == curve
    assert curve.base == base
    assert dock.tuning.curves[0].gamma == 1
    assert dock.session.state.fitted.way == GivenResponse(curve)


def test_every_channel_is_tuned(dock):
    dock.session.set_response([Gamma(1.8), Gamma(2.0), Gamma(2.2)])
    dock.tuning.tune(gamma=1.1)
    assert [curve.base.exponent for curve in dock.tuning.curves] == [1.8, 2.0, 2.2]
    assert len(dock.use_tuned().estimates) == 3


def test_an_untouched_curve_is_not_used(dock):
    dock.session.set_response(Gamma(2.0))
    dock.tuning.on = True
    with pytest.raises(CrfDeblurError, match="move a slider first"):
        dock.use_tuned()


def test_reset_returns_to_the_response(dock):
    dock.session.set_response(Gamma(2.0))
    dock.tuning.tune(0.5, gamma=1.2)
    dock.tuning.reset()
    assert dock.tuning.curves[0].gamma == 1
    assert dock.tuning.curves[0].offsets == (0, 0, 0)
    dock.tuning.on = False
    assert dock.tuning.curves == ()


def test_without_a_response_there_is_nothing_to_tune(dock):
    dock.tuning.on = True
    assert dock.tuning.curves == ()
    assert not dock.tuning._box.enabled
    with pytest.raises(CrfDeblurError, match="no response yet"):
        dock.use_tuned()


@pytest.fixture
def previewing(dock: ResponseDock) -> ResponseDock:
    """A dock that is ready to preview."""
    dock.session.set_response(Gamma(1.8))
    dock.session.set_psf(line(5, 0.3))
    dock.tuning.on = dock.tuning.previews = True
    return dock


def test_the_preview_shows_the_tuned_curve_and_goes_in_the_end(previewing, qtbot):
    dock, layers = previewing, previewing.session.viewer.layers
    before = dock.session.state.fitted
    dock.tuning.tune(gamma=1.3)
    qtbot.waitUntil(lambda: "panels [preview]" in layers, timeout=10000)
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=10000)
    qtbot.wait(50)
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=10000)
    shown = np.array(layers["panels [preview]"].data)
    whole = dock.session.preview(curve=dock.tuning.curves[0])
    np.testing.assert_array_equal(shown, whole.data)
    assert dock.session.state.fitted is before
    dock.tuning.reset()
    assert "panels [preview]" not in layers


@pytest.mark.parametrize("how", ["reset", "untick", "use", "other photo", "no tuning"])
def test_a_preview_that_comes_too_late_is_not_shown(previewing, qtbot, how):
    dock = previewing
    dock.tuning.tune(gamma=1.3)
    qtbot.waitUntil(lambda: not dock.runner.idle)
    match how:
        case "reset":
            dock.tuning.reset()
        case "untick":
            dock.tuning.previews = False
        case "use":
            dock.use_tuned()
        case "other photo":
            dock.photo = dock.session.viewer.add_image(np.zeros((40, 30)), name="other")
        case _:
            dock.tuning.on = False
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=10000)
    qtbot.wait(100)
    assert "panels [preview]" not in dock.session.viewer.layers


def test_no_preview_without_a_psf(dock, qtbot):
    dock.session.set_response(Gamma(2.0))
    dock.tuning.on = dock.tuning.previews = True
    dock.tuning.tune(gamma=1.3)
    qtbot.wait(50)
    assert dock.runner.idle
    assert not dock.tuning._preview.enabled


def test_it_works_in_a_window_and_ends_with_it(make_napari_viewer_proxy, blurred, qtbot):
    viewer = make_napari_viewer_proxy(show=True)
    viewer.add_image(blurred.photo, name="panels")
    dock = ResponseDock(viewer)
    viewer.window.add_dock_widget(dock, name="2 Response")
    dock.session.set_response(Gamma(1.8))
    dock.session.detect_edges()
    press(dock, "Estimate the response")
    qtbot.waitUntil(lambda: not dock.busy, timeout=20000)
    assert dock.session.state.fitted.edges is dock.session.state.edges
    assert dock.native.minimumSizeHint().width() < 450
    dock.tuning.on = True
    qtbot.wait(50)
    assert dock.native.minimumSizeHint().height() < 950
    dock.session.set_psf(line(5, 0.3))
    dock.tuning.previews = True
    qtbot.waitUntil(lambda: "panels [preview]" in viewer.layers, timeout=20000)
    viewer.window.remove_dock_widget(dock.native)
    assert "panels [preview]" not in viewer.layers
    dock.session.set_response(Gamma(2.0))
    qtbot.wait(50)
