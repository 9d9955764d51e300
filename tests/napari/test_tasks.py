"""Steps beside the window: one at a time, cancelled at once, and never half done."""

import gc
import threading
import weakref
from collections.abc import Callable
from typing import Any

import pytest
from napari.components import ViewerModel
from pytestqt.qtbot import QtBot

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.session.step import Effects, Step
from napari_crfdeblur._napari.tasks import Runner
from napari_crfdeblur.progress import Job, Progress

SOON = 5000  # milliseconds: only a broken run takes as long


class Trial:
    """A step that waits to be let on, and tells what has become of it."""

    def __init__(self, title: str = "waiting", error: Exception | None = None) -> None:
        self.go, self.begun = threading.Event(), threading.Event()
        self.stopped, self.thread = False, ""
        self.finished: list[str] = []
        self.error = error
        self.step: Step[int, int] = Step(title, self._job(), self._finish)

    def _job(self) -> Job[int]:
        self.thread = threading.current_thread().name
        try:
            self.begun.set()
            while not self.go.wait(0.01):
                yield Progress("waiting", 1, 4)
            if self.error is not None:
                raise self.error
        except GeneratorExit:
            self.stopped = True
            raise
        return 7

    def _finish(self, result: int) -> Effects[int]:
        self.finished.append(threading.current_thread().name)
        yield
        self.finished.append("whole")
        return result


@pytest.fixture
def session() -> Session:
    viewer = ViewerModel()
    return Session(viewer)


@pytest.fixture
def runner(qtbot: QtBot, session: Session) -> Runner:  # noqa: ARG001 - timers need Qt
    return Runner.of(session)


def idle(runner: Runner) -> Callable[[], bool]:
    return lambda: runner.idle


def test_a_step_works_in_a_thread_and_is_shown_in_the_main_one(
    qtbot: QtBot, runner: Runner
) -> None:
    trial = Trial()
    runner.start(trial.step)
    assert runner.busy
    qtbot.waitUntil(lambda: runner.progress == Progress("waiting", 1, 4), timeout=SOON)
    trial.go.set()
    qtbot.waitUntil(idle(runner), timeout=SOON)
    assert trial.thread.startswith("crfdeblur")
    assert trial.finished == [threading.main_thread().name, "whole"]


def test_a_second_step_is_refused_while_one_is_under_way(qtbot: QtBot, runner: Runner) -> None:
    first, second = Trial("finding edges"), Trial()
    runner.start(first.step)
    with pytest.raises(CrfDeblurError, match="busy finding edges"):
        runner.start(second.step)
    first.go.set()
    qtbot.waitUntil(idle(runner), timeout=SOON)
    assert first.finished
    assert not second.finished


def test_a_cancelled_step_stops_at_its_next_report_and_shows_nothing(
    qtbot: QtBot, runner: Runner, session: Session
) -> None:
    said = []
    session.said.connect(lambda message: said.append(message.text))
    trial = Trial("finding edges")
    runner.start(trial.step)
    assert trial.begun.wait(SOON / 1000)
    runner.cancel()
    assert not runner.busy
    assert said == ["cancelled: finding edges"]
    qtbot.waitUntil(lambda: trial.stopped, timeout=SOON)
    qtbot.wait(60)
    assert not trial.finished


def test_after_a_cancel_the_next_step_runs(qtbot: QtBot, runner: Runner) -> None:
    first, second = Trial(), Trial()
    runner.start(first.step)
    runner.cancel()
    runner.start(second.step)
    second.go.set()
    qtbot.waitUntil(idle(runner), timeout=SOON)
    assert not first.finished
    assert second.finished


@pytest.mark.parametrize("error", [CrfDeblurError("too dark"), ValueError("expected more")])
def test_a_failing_step_is_told_in_a_sentence_and_shows_nothing(
    qtbot: QtBot, runner: Runner, session: Session, error: Exception
) -> None:
    said = []
    session.said.connect(lambda message: said.append(message.text))
    trial = Trial("restoring", error)
    runner.start(trial.step)
    trial.go.set()
    qtbot.waitUntil(idle(runner), timeout=SOON)
    assert said == [f"restoring: {error}"]
    assert not trial.finished


def test_an_unforeseen_error_is_raised_and_the_runner_is_free_again(
    qtbot: QtBot, runner: Runner
) -> None:
    trial = Trial(error=ZeroDivisionError("a bug"))
    with qtbot.captureExceptions() as raised:
        runner.start(trial.step)
        trial.go.set()
        qtbot.waitUntil(idle(runner), timeout=SOON)
    assert raised[0][0] is ZeroDivisionError


def test_steps_that_follow_run_in_turn_and_end_with_the_first_failure(
    qtbot: QtBot, runner: Runner
) -> None:
    trials = [Trial("1"), Trial("2"), Trial("3", CrfDeblurError("no")), Trial("4")]
    for trial in trials:
        trial.go.set()
    first, *others = trials
    runner.start(first.step, *[lambda t=t: t.step for t in others])
    qtbot.waitUntil(idle(runner), timeout=SOON)
    assert [bool(trial.finished) for trial in trials] == [True, True, False, False]


def test_of_live_steps_of_one_kind_only_the_newest_is_shown(qtbot: QtBot, runner: Runner) -> None:
    trials = [Trial("preview") for _ in range(4)]
    other = Trial("refining edges")
    runner.start_live(other.step)
    for trial in trials:
        runner.start_live(trial.step)
    assert not runner.busy
    for trial in (*trials, other):
        trial.go.set()
    qtbot.waitUntil(idle(runner), timeout=SOON)
    assert [bool(trial.finished) for trial in trials] == [False, False, False, True]
    assert other.finished


def test_closing_the_photo_ends_what_is_under_way(qtbot: QtBot) -> None:
    import numpy as np

    viewer = ViewerModel()
    session = Session(viewer, viewer.add_image(np.zeros((20, 30), np.uint8), name="photo"))
    runner, trial = Runner.of(session), Trial()
    runner.start(trial.step)
    assert trial.begun.wait(SOON / 1000)
    viewer.layers.remove("photo")
    assert not runner.busy
    qtbot.waitUntil(lambda: trial.stopped, timeout=SOON)
    assert not trial.finished


def test_every_session_has_one_runner(qtbot: QtBot, session: Session) -> None:  # noqa: ARG001
    assert Runner.of(session) is Runner.of(session)
    assert Runner.of(Session(ViewerModel())) is not Runner.of(session)


def test_a_session_goes_when_its_viewer_goes(qtbot: QtBot) -> None:  # noqa: ARG001
    viewer: Any = ViewerModel()
    session = Session(viewer)
    runner = Runner.of(session)
    left = [weakref.ref(thing) for thing in (viewer, session, runner)]
    del viewer, session, runner
    gc.collect()
    assert [thing() for thing in left] == [None, None, None]
