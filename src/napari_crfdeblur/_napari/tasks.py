"""Threads, all of them: steps run beside the window, with progress, cancel and a clean end."""

import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib import import_module
from inspect import GEN_RUNNING, getgeneratorstate
from threading import Event
from typing import Any, TypeAlias
from weakref import WeakValueDictionary

from psygnal import Signal
from qtpy.QtCore import QTimer

from ..errors import REFUSALS, CrfDeblurError, in_words
from ..progress import Progress, drain
from .session.facade import Session
from .session.step import Effects, Level, Step, apply

PERIOD = 20  # milliseconds between looks at a running job: seen as immediate


Make: TypeAlias = Callable[[], Step[Any, Any]]
"""Makes a step when its turn has come: from the session as the step before has left it."""


class Stopped(Exception):
    """Raised inside a job that was cancelled, at its next report."""


@dataclass(slots=True, eq=False)
class _Run:
    """A step under way."""

    step: Step[Any, Any]
    following: tuple[Make, ...] = ()
    future: "Future[Any] | None" = None
    cancelled: Event = field(default_factory=Event)
    progress: Progress | None = None
    effects: Effects[Any] | None = None

    def work(self) -> Any:
        return drain(self.step.job, self.report)

    def report(self, progress: Progress) -> None:
        if self.cancelled.is_set():
            raise Stopped
        self.progress = progress


class Lane:
    """One thread for one step at a time: a new step takes the place of the one under way.

    Parameters
    ----------
    session : Session
        Gets the results, on the thread that made the lane.
    on_change : callable
        Called when a step begins, reports or ends.
    """

    def __init__(self, session: Session, on_change: Callable[[], None]) -> None:
        self._session, self._on_change = session, on_change
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="crfdeblur")
        self._run: _Run | None = None
        self._timer = QTimer()
        self._timer.setInterval(PERIOD)
        self._timer.timeout.connect(self._look)

    @property
    def title(self) -> str | None:
        """What is being done; None if nothing."""
        return self._run.step.title if self._run else None

    @property
    def progress(self) -> Progress | None:
        """How far it is, as far as is known."""
        return self._run.progress if self._run else None

    def start(self, step: Step[Any, Any], *following: Make) -> None:
        """Run a step in the place of the one under way, and then those that follow."""
        self.cancel()
        self._run = _Run(step, following)
        self._run.future = self._pool.submit(self._run.work)
        self._timer.start()
        self._on_change()

    def cancel(self) -> None:
        """Give up what is under way: its result is dropped, and it ends at its next report.

        A step whose result is just being shown goes on: half of it would be a partial result.
        """
        run = self._run
        if run is None:
            return
        # A step can ask for another one of its kind while its own result is being shown.
        if run.effects is not None and getgeneratorstate(run.effects) != GEN_RUNNING:
            apply(run.effects)
        run.cancelled.set()
        self._end()

    def _look(self) -> None:
        """Look at the job; once it is done, show its result piece by piece."""
        run = self._run
        if run is None:  # what was to follow could not begin
            self._end()
            return
        if run.future is None or not run.future.done():
            self._on_change()
            return
        goes_on = False
        try:
            if run.effects is None:
                run.effects = run.step.finish(run.future.result())
            goes_on = next(run.effects, self) is not self
            if not goes_on and run.following:
                self._run = None
                make, *following = run.following
                self.start(make(), *following)
        except REFUSALS as error:
            self._session.say(f"{run.step.title}: {in_words(error)}", Level.ERROR)
        finally:
            if not goes_on and self._run is run:
                self._end()

    def _end(self) -> None:
        self._timer.stop()
        self._run = None
        self._on_change()


class Runner:
    """Runs the steps of a session for all its widgets.

    Steps asked for by buttons run one at a time, with progress; those that follow from drawing
    and from sliders run beside them, each kind in a lane where only the newest counts.

    Parameters
    ----------
    session : Session
        Whose steps are run.

    Attributes
    ----------
    changed : Signal
        Emitted when a step begins, reports or ends.
    """

    changed = Signal()

    def __init__(self, session: Session) -> None:
        self._session = session
        self._main = Lane(session, self.changed.emit)
        self._live: dict[str, Lane] = {}
        session.start = self.start_live
        session.photo_changed.connect(self._photo_changed)
        _RUNNERS[id(session)] = self

    @classmethod
    def of(cls, session: Session) -> "Runner":
        """The runner that all widgets of a session share; made on first use."""
        return _RUNNERS.get(id(session)) or cls(session)

    @property
    def busy(self) -> bool:
        """Whether a step is under way that a button has started."""
        return self._main.title is not None

    @property
    def idle(self) -> bool:
        """Whether nothing at all is under way, live steps included."""
        return not self.busy and all(lane.title is None for lane in self._live.values())

    @property
    def title(self) -> str | None:
        """What is being done; None if nothing."""
        return self._main.title

    @property
    def progress(self) -> Progress | None:
        """How far it is, as far as is known."""
        return self._main.progress

    def start(self, step: Step[Any, Any], *following: Make) -> None:
        """Run a step with progress, and then those that follow, unless one fails.

        Raises
        ------
        CrfDeblurError
            Another one is under way.
        """
        if self.busy:
            step.job.close()
            raise CrfDeblurError(f"busy {self.title}: wait for its end, or cancel it")
        self._main.start(step, *following)

    def start_live(self, step: Step[Any, Any]) -> None:
        """Run a step beside the others, in the place of the last one of its kind."""
        if step.title not in self._live:
            self._live[step.title] = Lane(self._session, self.changed.emit)
        self._live[step.title].start(step)

    def stop_live(self, title: str) -> None:
        """Give up the step of a kind that runs beside the others, if there is one."""
        if title in self._live:
            self._live[title].cancel()

    def cancel(self) -> None:
        """Give up what is under way; nothing has changed then."""
        if self.title is not None:
            self._session.say(f"cancelled: {self.title}")
        for lane in (self._main, *self._live.values()):
            lane.cancel()

    def _photo_changed(self) -> None:
        if self._session.photo is None:
            self.cancel()


_RUNNERS: "WeakValueDictionary[int, Runner]" = WeakValueDictionary()


def load_beside(module: str, then: Callable[[], object]) -> None:
    """Import a module in a thread of its own, and call `then` in this one once it is there.

    For what takes long to load and is not needed at once: the window goes on meanwhile.
    """
    if module in sys.modules:
        then()
        return
    future = _LOADER.submit(import_module, module)
    timer = QTimer()
    timer.setInterval(PERIOD)

    def look() -> None:
        if future.done():
            timer.stop()
            _LOADING.discard(timer)
            future.result()
            then()

    timer.timeout.connect(look)
    _LOADING.add(timer)  # Qt does not keep it
    timer.start()


_LOADER = ThreadPoolExecutor(1, thread_name_prefix="crfdeblur-load")
_LOADING: set[QTimer] = set()
