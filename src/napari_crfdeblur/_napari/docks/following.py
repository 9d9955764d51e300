"""The response kept in step with the edges: at once from the last one, in full after a pause."""

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial

from napari.layers import Image as ImageLayer
from qtpy.QtCore import QTimer

from ...errors import REFUSALS, in_words
from ..preferences import preferences
from ..session.facade import Session
from ..session.response import estimating_response, following_edges
from ..session.step import Level
from ..tasks import Runner
from .choices import PREFERRED, fits

PAUSE = 600  # milliseconds without a change before the full estimate: edges come one by one
FULL = "estimating the response"  # title of the step


class Following:
    """Estimates the response again when edges are drawn, moved or deleted.

    If there is a response that can follow them, it does so at once, and the full estimate waits
    for a pause. Otherwise, the full estimate begins at once.

    Parameters
    ----------
    session : Session
        Whose edges are followed.
    runner : Runner
        Runs the estimates, the newest of each kind.
    wanted : callable
        Whether the user wants it.
    """

    def __init__(self, session: Session, runner: Runner, wanted: Callable[[], bool]) -> None:
        self._session, self._runner, self._wanted = session, runner, wanted
        self._photo: ImageLayer | None = None
        self._timer = QTimer()
        self._timer.setSingleShot(True)
        self._timer.setInterval(PAUSE)
        self._timer.timeout.connect(self._confirm)

    @property
    def waits(self) -> bool:
        """Whether a full estimate is to come after a pause."""
        return bool(self._timer.isActive())

    def foresee(self, stay: Collection[int]) -> None:
        """The edges are about to change: go on without those that do not stay."""
        edges = self._session.state.edges
        less = edges is not None and len(stay) < len(edges.edges)
        if self._wanted() and less and self._go_on(stay):
            self._timer.start()  # for a change that fails, too

    def follow(self) -> None:
        """The edges have changed: go on from the last response, or estimate it."""
        if not self._wanted():
            return
        if self._go_on(None):
            self._timer.start()
        else:
            self.estimate()

    def estimate(self) -> None:
        """Estimate the response as it was done last; one that was given is left alone."""
        self._timer.stop()
        state, edges = self._session.state, self._session.state.edges
        if edges is None or not edges.groups or (state.fitted and not state.fitted.groups):
            return
        method = fits().get(PREFERRED[preferences().response])
        others: tuple[str, ...] = ()
        if state.fitted is not None:
            method, others = state.fitted.method, state.fitted.others
        if method is not None:
            step = partial(estimating_response, self._session, method, others=others)
            self._attempt(lambda: self._session.start(step()))

    def end(self) -> None:
        """Follow no more: what is not confirmed is dropped."""
        self._timer.stop()
        photo, self._photo = self._photo, None
        if photo is not None:
            self._drop(photo)

    def _confirm(self) -> None:
        """The pause is over, but for a change that is still under way."""
        if self._runner.idle:
            self.estimate()
        else:
            self._timer.start()

    def _go_on(self, stay: Collection[int] | None) -> bool:
        """Follow the edges, if the response can; a full estimate of earlier ones comes too late."""
        state, photo = self._session.state, self._session.photo
        able = state.fitted is not None and bool(state.fitted.responses.fits)
        if photo is None or not able or not (state.edges and state.edges.groups):
            return False
        self._photo = photo
        self._runner.stop_live(FULL)
        # Here and now: a few hundredths of a second, and many times as much beside a busy thread.
        self._attempt(lambda: self._session.do(following_edges(self._session, stay)))
        live = self._session.state.live
        if live is not None and live.edges is not state.edges:
            self._drop(photo)  # it could not follow
        return True

    def _drop(self, photo: ImageLayer) -> None:
        state = self._session.state_of(photo)
        if state.live is not None:
            self._session.commit(photo, replace(state, live=None))

    def _attempt(self, act: Callable[[], object]) -> None:
        try:
            act()
        except REFUSALS as error:
            self._session.say(in_words(error), Level.ERROR)
