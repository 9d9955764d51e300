"""Long work as generators: they report progress and can be stopped at every report."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a job is: `done` of `total` steps of the named `stage`."""

    stage: str
    done: int
    total: int


Job: TypeAlias = Generator[Progress, None, T]
"""A long job: yields :class:`Progress`, returns its result; ``close()`` stops it."""


def drain(job: "Job[T]", report: Callable[[Progress], None] | None = None) -> T:
    """Run a job to its end and return its result.

    Parameters
    ----------
    job : Job
        The generator to run.
    report : callable, optional
        Called with every :class:`Progress`; an exception that it raises stops the job.
    """
    try:
        while True:
            progress = next(job)
            if report is not None:
                report(progress)
    except StopIteration as stop:
        result: T = stop.value
        return result
    finally:
        job.close()


def nth(job: "Job[T]", number: int, count: int, part: str) -> "Job[T]":
    """One of several equal jobs; its progress is the share of all of them that is done.

    Parameters
    ----------
    job : Job
        The part that is done now.
    number : int
        Of the part, from 0.
    count : int
        Of all parts.
    part : str
        What the user calls a part, such as "slice".
    """
    if count == 1:
        return (yield from job)
    try:
        while True:
            progress = next(job)
            done = number * progress.total + progress.done
            title = f"{progress.stage}, {part} {number + 1} of {count}"
            yield Progress(title, done, count * progress.total)
    except StopIteration as stop:
        result: T = stop.value
        return result
    finally:
        job.close()


def reporting(job: "Job[T]", at: Progress) -> "Job[T]":
    """Long job that reports where the whole is, in place of the progress of this part of it."""
    try:
        while True:
            next(job)
            yield at
    except StopIteration as stop:
        result: T = stop.value
        return result
    finally:
        job.close()
