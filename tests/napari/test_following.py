"""The response follows the edges: at once beside the one in force, in full after a pause."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.docks import EdgesDock, ResponseDock, following
from napari_crfdeblur._napari.docks.trust import EARLIER, FOLLOWS
from napari_crfdeblur._napari.session.response import estimating_response, following_edges
from napari_crfdeblur._napari.session.state import Fitted
from napari_crfdeblur.estimate import (
    Finding,
    MaximumLikelihood,
    MeanProfile,
    ResponseStatus,
    estimate_response,
)
from napari_crfdeblur.response import Gamma

pytestmark = pytest.mark.usefixtures("qapp")
LEVELS = np.linspace(0.1, 0.9, 65)


@pytest.fixture
def dock(edged: Session, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot) -> EdgesDock:
    """The edges on a photo with a response estimated from the better ones, and no pause to wait."""
    monkeypatch.setattr(following, "PAUSE", 1)
    good = [edge for edge in edged.state.edges.edges if edge.good]
    edged.set_edges(good[:12])
    dock = EdgesDock(edged.viewer)
    qtbot.addWidget(dock.native)
    edged.estimate_response()
    return dock


@pytest.fixture
def paused(dock: EdgesDock) -> EdgesDock:
    """The same, and the pause never ends by itself."""
    dock._following._timer.setInterval(10**7)
    return dock


def irradiance(fitted: Fitted) -> Any:
    return fitted.curve.to_irradiance(LEVELS)


def confirmed(dock: EdgesDock, qtbot: QtBot) -> None:
    def settled() -> bool:
        return dock.session.state.live is None and not dock._following.waits and dock.runner.idle

    qtbot.waitUntil(settled, timeout=20000)


def test_a_deleted_edge_moves_the_curve_before_the_edges_are_there(paused: EdgesDock) -> None:
    session, seen = paused.session, []
    before = session.state.edges
    session.response_changed.connect(lambda: seen.append(session.state))
    session.remove_edges([3])
    first, last = seen
    assert first.edges is before
    assert sum(map(len, first.live.groups)) < sum(map(len, before.groups))
    assert last.live.edges is session.state.edges


def test_the_response_in_force_stays_until_the_pause(paused: EdgesDock) -> None:
    session = paused.session
    before = session.state.fitted
    session.remove_edges([3])
    state = session.state
    assert state.fitted is before
    assert state.live is not None
    assert state.shown is state.live
    assert state.live.edges is state.edges
    assert state.by_hand
    assert paused._following.waits
    session.linearize()
    assert session.state.linear.fitted is before


def test_a_full_estimate_confirms_it_after_the_pause(dock: EdgesDock, qtbot: QtBot) -> None:
    session = dock.session
    session.remove_edges([3])
    live = session.state.live
    confirmed(dock, qtbot)
    full = session.state.fitted
    assert full.edges is session.state.edges
    # What a step and a search leave to each other, of irradiance.
    np.testing.assert_allclose(irradiance(live), irradiance(full), atol=0.01)
    by_verb = session.estimate_response()
    np.testing.assert_array_equal(irradiance(full), irradiance(by_verb))


def test_undo_takes_back_edges_and_knows_nothing_of_live_curves(paused: EdgesDock) -> None:
    session = paused.session
    depth, before = len(session.state.undo), session.state.edges
    session.remove_edges([3])
    session.remove_edges([5])
    assert len(session.state.undo) == depth + 2
    session.undo_edges()
    session.undo_edges()
    assert session.state.edges is before
    again = session.state.live
    assert again.edges is before
    # The search ends a little before the minimum, to which the steps of each change go on: they
    # settle .002 from it here, of irradiance, less than the error to expect.
    np.testing.assert_allclose(irradiance(again), irradiance(session.state.fitted), atol=5e-3)


def test_of_many_changes_only_the_last_is_estimated_in_full(
    paused: EdgesDock, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    started = []

    def note(session: Session, *method: Any, **how: Any) -> Any:
        started.append(session.state.edges)
        return estimating_response(session, *method, **how)

    monkeypatch.setattr(following, "estimating_response", note)
    for _ in range(3):
        paused.session.remove_edges([3])
    assert not started
    paused._following._timer.setInterval(1)
    paused.session.remove_edges([3])
    confirmed(paused, qtbot)
    assert started == [paused.session.state.edges]


def test_closing_while_it_waits_drops_what_is_not_confirmed(
    make_napari_viewer: Any, blurred: Any, found: Any, qtbot: QtBot
) -> None:
    viewer = make_napari_viewer()
    session = Session.of(viewer)
    session.photo = viewer.add_image(blurred.photo)
    session.set_edges([edge for edge in found.edges if edge.good][:12])
    session.estimate_response()
    dock = EdgesDock(viewer)
    frame = viewer.window.add_dock_widget(dock, name="1 Edges")
    before = session.state.fitted
    dock._following._timer.setInterval(200)
    session.remove_edges([3])
    assert dock._following.waits
    assert session.state.live is not None
    viewer.window.remove_dock_widget(frame)
    assert not dock._following.waits
    assert session.state.live is None
    qtbot.wait(300)
    assert session.state.fitted is before
    session.remove_edges([3])
    assert session.state.live is None


def test_closing_during_the_full_estimate_stops_it(paused: EdgesDock, qtbot: QtBot) -> None:
    session = paused.session
    before = session.state.fitted
    session.remove_edges([3])
    paused._following.estimate()
    assert not paused.runner.idle
    paused._closed()
    assert paused.runner.idle
    qtbot.wait(100)
    assert session.state.fitted is before
    assert session.state.live is None


def test_without_the_tick_nothing_follows(paused: EdgesDock) -> None:
    paused.session.remove_edges([3])
    paused._again.value = False
    assert paused.session.state.live is None
    paused.session.remove_edges([3])
    assert paused.session.state.live is None
    assert not paused._following.waits


def test_another_photo_ends_it(paused: EdgesDock, blurred: Any) -> None:
    session, first = paused.session, paused.session.photo
    session.remove_edges([3])
    session.photo = session.viewer.add_image(blurred.photo[:, ::-1], name="other")
    assert not paused._following.waits
    assert session.state_of(first).live is None
    assert session.state_of(first).fitted is not None


def test_a_given_response_does_not_follow(paused: EdgesDock) -> None:
    session = paused.session
    session.remove_edges([3])
    session.set_response(Gamma(1.7))
    assert session.state.live is None
    session.remove_edges([3])
    assert session.state.live is None
    with pytest.raises(CrfDeblurError, match="maximum likelihood"):
        session.do(following_edges(session))


def test_other_methods_are_estimated_in_full_at_once(dock: EdgesDock, qtbot: QtBot) -> None:
    session = dock.session
    session.estimate_response(MeanProfile())
    assert session.state.fitted.responses.fits == ()
    session.remove_edges([3])
    assert session.state.live is None
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=20000)
    assert session.state.fitted.edges is session.state.edges


def test_three_curves_follow(paused: EdgesDock) -> None:
    session = paused.session
    session.estimate_response(per_channel=True)
    session.remove_edges([3])
    assert len(session.state.live.estimates) == 3


def test_the_profiles_of_further_photos_stay(paused: EdgesDock, blurred: Any) -> None:
    session = paused.session
    other = session.viewer.add_image(blurred.photo[:75, ::-1], name="other")
    session.estimate_response(others=[other])
    further = [g for g in session.state.fitted.groups if g.sources[0].image]
    session.remove_edges([3])
    assert [g for g in session.state.live.groups if g.sources[0].image] == further


def test_without_a_usable_edge_what_was_assumed_is_followed(paused: EdgesDock) -> None:
    session = paused.session
    before = session.state.fitted
    flat = [
        replace(group, sides=np.full_like(group.sides, 0.5)) for group in session.state.edges.groups
    ]
    edges = replace(session.state.edges, groups=tuple(flat))
    session.commit(session.photo, replace(session.state, edges=edges))
    paused._following.follow()
    (live,) = session.state.live.estimates
    assert live.status is ResponseStatus.CANNOT_TELL
    assert live.findings == (Finding.NO_EDGES,)
    assumed = estimate_response((), MaximumLikelihood()).curve.to_irradiance(LEVELS)
    np.testing.assert_array_equal(live.curve.to_irradiance(LEVELS), assumed)
    assert session.state.fitted is before
    assert paused._following.waits


def test_too_few_edges_for_a_method_of_the_paper_are_told(
    dock: EdgesDock, blurred: Any, qtbot: QtBot
) -> None:
    session, edges = dock.session, dock.session.state.edges.edges
    # Gray: of each edge one profile, of colors three.
    session.photo = session.viewer.add_image(blurred.photo[..., 1], name="gray")
    session.set_edges(edges)
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=20000)
    said: list[Any] = []
    session.said.connect(said.append)
    before = session.estimate_response(MeanProfile())
    session.set_edges(edges[:1])
    qtbot.waitUntil(lambda: dock.runner.idle, timeout=20000)
    assert "at least 3 straight edges" in said[-1].text
    assert session.state.fitted is before


def test_a_change_that_is_given_up_is_no_change(dock: EdgesDock, qtbot: QtBot) -> None:
    session = dock.session
    before = session.state.edges
    dock._following._timer.setInterval(50)
    session.selected = 3
    dock.remove_selected(block=False)
    assert session.state.live is not None
    dock.cancel()
    confirmed(dock, qtbot)
    assert session.state.edges is before
    assert session.state.fitted.edges is before


def test_a_response_that_cannot_follow_is_shown_no_more(paused: EdgesDock) -> None:
    session = paused.session
    session.remove_edges([3])
    few = [edge for edge in session.state.edges.edges if edge.good][:4]
    edges = session.state.edges
    session.set_edges(few)
    assert session.state.live is not None
    session.set_edges(edges.edges)  # most are new
    assert session.state.live is None
    assert paused._following.waits


def test_the_response_dock_shows_what_follows(paused: EdgesDock) -> None:
    session = paused.session
    dock = ResponseDock(session.viewer)
    line = dock._plots.curve.axes.lines[-1]
    before = line.get_ydata()
    session.remove_edges([0, 3, 5])
    assert FOLLOWS in dock._trust.value
    assert EARLIER not in dock._trust.value
    (live,) = session.state.live.estimates
    after = dock._plots.curve.axes.lines[-1]
    assert not np.array_equal(before, after.get_ydata())
    np.testing.assert_allclose(after.get_ydata(), live.curve.to_irradiance(after.get_xdata()))
    paused._following.end()
    assert FOLLOWS not in dock._trust.value
    assert EARLIER in dock._trust.value
