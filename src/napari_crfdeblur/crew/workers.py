"""Who computes the tiles: dask's threads here, or the workers of a cluster."""

import asyncio
import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, ThreadPoolExecutor
from concurrent.futures import wait as wait_for_futures
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from time import monotonic
from typing import TYPE_CHECKING, Any, TypeAlias

from ..errors import CrfDeblurError

if TYPE_CHECKING:
    from distributed import Client

ANSWER = 10.0  # seconds within which a scheduler has to answer
PATIENCE = 30.0  # seconds without any worker, or any answer, after which a cluster is given up
LOOK = 1.0  # seconds between two looks at a cluster, and for its answer
TICK = 0.2  # seconds that a job waits at most until it can be stopped

Task: TypeAlias = Any
"""Work in progress, of this process or of a cluster: has ``result()`` and ``cancel()``."""


class ClusterError(CrfDeblurError):
    """The cluster, not the photo, is at fault."""


class WorkersDied(CrfDeblurError):
    """A piece of work was given up, since workers died at it again and again."""


class Workers(ABC):
    """Those who do pieces of work that do not depend on each other."""

    size: int
    """How many pieces are worked on at a time; can change."""

    @abstractmethod
    def compute(self, lazy: Any) -> Task:
        """Begin to compute a dask collection."""

    @abstractmethod
    def call(self, function: Callable[..., Any], *arguments: Any) -> Task:
        """Begin to call a function."""

    @abstractmethod
    def done(self, tasks: Collection[Task]) -> set[Task]:
        """Those that have ended; waits a moment for the first of them."""

    @abstractmethod
    def result(self, task: Task) -> Any:
        """What a task that has ended gave; raises what it raised."""

    @abstractmethod
    def drop(self, tasks: Collection[Task]) -> None:
        """Do without the results of tasks."""


class Threads(Workers):
    """Threads of this process: as many as dask is configured to use."""

    def __init__(self, pool: ThreadPoolExecutor, size: int) -> None:
        self._pool, self.size = pool, size

    def compute(self, lazy: Any) -> Task:
        """Begin to compute a dask collection in one of the threads."""
        return self._pool.submit(lazy.compute, scheduler="synchronous")

    def call(self, function: Callable[..., Any], *arguments: Any) -> Task:
        """Begin to call a function in one of the threads."""
        return self._pool.submit(function, *arguments)

    def done(self, tasks: Collection[Task]) -> set[Task]:
        """Those that have ended; waits a moment for the first of them."""
        return wait_for_futures(tasks, timeout=TICK, return_when=FIRST_COMPLETED).done

    def result(self, task: Task) -> Any:
        """What a task that has ended gave."""
        return task.result()

    def drop(self, tasks: Collection[Task]) -> None:
        """Do without the results of tasks that have not begun."""
        for task in tasks:
            task.cancel()


class Cluster(Workers):
    """Workers of a ``dask.distributed`` cluster; whatever one of them loses, another repeats.

    Nothing is waited for without looking, every second, whether the scheduler and any worker are
    there: what a scheduler that is gone owes never comes.
    """

    def __init__(self, client: "Client") -> None:
        self._client = client
        self._ended: SimpleQueue[Task] = SimpleQueue()
        self.size = 1
        self._next_look = 0.0
        self._missed: float | None = None
        self._look()

    def compute(self, lazy: Any) -> Task:
        """Begin to compute a dask collection on the cluster."""
        # Optimized by itself, each tile would give other tasks the names of its neighbors' ones.
        with _sending():
            return self._begun(self._client.compute(_culled(lazy), optimize_graph=False))

    def call(self, function: Callable[..., Any], *arguments: Any) -> Task:
        """Begin to call a function on one of the workers."""
        with _sending():
            return self._begun(self._client.submit(function, *arguments, pure=False))

    def _begun(self, task: Task) -> Task:
        task.add_done_callback(self._ended.put)
        return task

    def done(self, tasks: Collection[Task]) -> set[Task]:
        """Those that have ended; waits a moment for the first of them."""
        self._look()
        try:
            found = {self._ended.get(timeout=TICK)}
        except Empty:
            return set()
        self._missed = None
        return {task for task in tasks if task in found or task.done()}

    def result(self, task: Task) -> Any:
        """What a task that has ended gave; says who is to blame if it was not the photo."""
        from distributed import KilledWorker

        loop: Any = self._client.loop
        coming = asyncio.run_coroutine_threadsafe(
            self._client.gather(task, asynchronous=True), loop.asyncio_loop
        )
        try:
            while not wait_for_futures([coming], timeout=TICK).done:
                self._look()
            return coming.result()
        except KilledWorker as error:
            raise WorkersDied(
                "workers of the cluster died again and again at the same piece of work; give "
                "them more memory, or fewer threads each"
            ) from error
        except CancelledError as error:
            raise _lost() from error
        except OSError as error:
            if task.status == "error":
                raise  # its own
            raise _lost() from error
        finally:
            coming.cancel()

    def drop(self, tasks: Collection[Task]) -> None:
        """Do without the results of tasks; a cluster that is lost has dropped them already."""
        with suppress(OSError):
            for task in tasks if self._client.status == "running" else ():
                task.cancel()

    def _look(self) -> None:
        """Count the workers; give up if the scheduler is gone, or all workers are, for long."""
        if self._client.status != "running":
            raise _lost()
        if monotonic() < self._next_look:
            return
        wanting = "no workers; start some"
        try:
            threads = self._client.nthreads(callback_timeout=LOOK)
        except TimeoutError:
            threads, wanting = {}, "no answer from its scheduler; look what that is busy with"
        except OSError as error:
            raise _lost() from error
        now = monotonic()
        self._next_look = now + LOOK
        if threads:
            self.size, self._missed = sum(threads.values()), None
            return
        self._missed = self._missed or now
        if now - self._missed > PATIENCE:
            raise ClusterError(
                f"the cluster has had for {PATIENCE:.0f} s {wanting}, and do it again"
            )


def _culled(lazy: Any) -> Any:
    """A dask collection with no more of its graph than it needs."""
    from dask.core import flatten

    graph = lazy.__dask_graph__().cull(set(flatten(lazy.__dask_keys__())))
    rebuild, arguments = lazy.__dask_postpersist__()
    return rebuild(graph, *arguments)


@contextmanager
def _sending() -> Iterator[None]:
    """Say in words that a scheduler takes no work any more."""
    from distributed.client import ClosedClientError

    try:
        yield
    except (OSError, ClosedClientError) as error:
        raise _lost() from error


def _lost() -> ClusterError:
    return ClusterError("the scheduler of the cluster is gone; start it, and do it again")


@contextmanager
def workers(scheduler: str | None = None) -> Iterator[Workers]:
    """Those who compute: dask's threads, or a cluster; what is not done at the end is dropped.

    Parameters
    ----------
    scheduler : str, optional
        Address of the scheduler of a ``dask.distributed`` cluster, such as
        ``tcp://host:8786``.

    Raises
    ------
    CrfDeblurError
        It does not answer within 10 s.
    """
    if scheduler is not None:
        with _connected(scheduler) as client:
            yield Cluster(client)
        return
    size = _threads()
    pool = ThreadPoolExecutor(size)
    try:
        yield Threads(pool, size)
    finally:
        pool.shutdown(cancel_futures=True)


def _threads() -> int:
    import dask
    from dask.system import CPU_COUNT

    return int(dask.config.get("num_workers", None) or CPU_COUNT)


@contextmanager
def _connected(address: str) -> "Iterator[Client]":
    try:
        from distributed import Client
    except ImportError as error:
        raise CrfDeblurError(
            "a cluster needs dask.distributed; install it with "
            'pip install "napari-crfdeblur[large]"'
        ) from error
    try:
        # A client that never found its scheduler would hold up the end of the program. Asked from
        # a thread, since notebooks have an event loop in this one.
        with ThreadPoolExecutor(1) as pool:
            pool.submit(asyncio.run, _ask(address)).result()
        client = Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        raise CrfDeblurError(
            f"the scheduler {address} did not answer within {ANSWER:.0f} s; start it with "
            "`dask scheduler`, and give the address that it prints"
        ) from error
    try:
        yield client
    finally:
        _close(client)


def _close(client: "Client") -> None:
    """Part from a cluster, be it there or not, and without its last words about that."""
    from distributed.utils import silence_logging_cmgr

    with silence_logging_cmgr(logging.CRITICAL), suppress(TimeoutError):
        client.close(timeout=ANSWER)


async def _ask(address: str) -> None:
    """Raise OSError, of which TimeoutError is one, unless a scheduler answers."""
    from distributed.core import rpc

    async with rpc(address, timeout=ANSWER) as scheduler:
        await asyncio.wait_for(scheduler.identity(), ANSWER)
