"""What a session does: one step is a job for any thread, and its effect on the layers."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeAlias, TypeVar

from ...progress import Job

T = TypeVar("T")
R = TypeVar("R")

Effects: TypeAlias = Generator[None, None, R]
"""What a result does to a session and its layers, in pieces short enough for a window."""


class Level(Enum):
    """How a message is meant."""

    INFO = "information"
    DOUBT = "a doubtful result"
    ERROR = "nothing was done"


@dataclass(frozen=True, slots=True)
class Message:
    """A sentence for the user."""

    text: str
    level: Level = Level.INFO


@dataclass(frozen=True, slots=True, eq=False)
class Step(Generic[T, R]):
    """One step of a session.

    Parameters
    ----------
    title : str
        What is being done, for the progress bar.
    job : Job
        The computation: takes arrays and gives arrays, in any thread.
    finish : callable
        Gives the effects of the result: they change the session and its layers, on the main
        thread only, and return what scripts get. If the job fails or is stopped there are
        none, and nothing has changed.
    """

    title: str
    job: Job[T]
    finish: Callable[[T], Effects[R]]


def at_once(act: Callable[[T], R]) -> Callable[[T], Effects[R]]:
    """Effects of a single piece."""

    def effects(result: T) -> Effects[R]:
        return act(result)
        yield

    return effects


def apply(effects: Effects[R]) -> R:
    """Let all effects happen here and now."""
    try:
        while True:
            next(effects)
    except StopIteration as stop:
        result: R = stop.value
        return result
