"""Who computes the tiles: dask's threads here, or the workers of a cluster."""

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor
from concurrent.futures import wait as wait_for_futures
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from time import monotonic
from typing import TYPE_CHECKING, Any, TypeAlias

from ..errors import CrfDeblurError

if TYPE_CHECKING:
    from distributed import Client

ANSWER = 10.0  # seconds within which a scheduler has to answer
PATIENCE = 30.0  # seconds without any worker after which a cluster is given up
TICK = 0.2  # seconds between two looks, so that a job can be stopped

Task: TypeAlias = Any
"""Work in progress, of this process or of a cluster: has ``result()`` and ``cancel()``."""


class ClusterError(CrfDeblurError):
    """The cluster, not the photo, is at fault."""


class Workers(ABC):
    """Those who do pieces of work that do not depend on each other."""

    size: int
    """How many pieces are worked on at a time."""

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


class Cluster(Workers):
    """Workers of a ``dask.distributed`` cluster; whatever one of them loses, another repeats."""

    def __init__(self, client: "Client") -> None:
        self._client = client
        self._ended: SimpleQueue[Task] = SimpleQueue()
        self.size = max(1, sum(client.nthreads().values()))
        self._alone_since: float | None = None

    def compute(self, lazy: Any) -> Task:
        """Begin to compute a dask collection on the cluster."""
        # Optimized by itself, each tile would give other tasks the names of its neighbors' ones.
        return self._begun(self._client.compute(_culled(lazy), optimize_graph=False))

    def call(self, function: Callable[..., Any], *arguments: Any) -> Task:
        """Begin to call a function on one of the workers."""
        return self._begun(self._client.submit(function, *arguments, pure=False))

    def _begun(self, task: Task) -> Task:
        task.add_done_callback(self._ended.put)
        return task

    def done(self, tasks: Collection[Task]) -> set[Task]:
        """Those that have ended; waits a moment for the first of them."""
        try:
            found = {self._ended.get(timeout=TICK)}
        except Empty:
            self._check_alive()
            return set()
        return {task for task in tasks if task in found or task.done()}

    def result(self, task: Task) -> Any:
        """What a task that has ended gave; says who is to blame if it was not the photo."""
        from distributed import KilledWorker
        from distributed.client import FutureCancelledError

        try:
            return task.result()
        except KilledWorker as error:
            raise CrfDeblurError(
                "several workers of the cluster died at the same tile; give them more memory, or "
                "fewer threads each"
            ) from error
        except FutureCancelledError as error:
            raise _lost(error) from error

    def _check_alive(self) -> None:
        """Give up if the scheduler, or every worker, is gone."""
        if self._client.status != "running":
            raise _lost(self._client.status)
        if self._client.scheduler_info(n_workers=-1)["workers"]:
            self._alone_since = None
            return
        self._alone_since = self._alone_since or monotonic()
        if monotonic() - self._alone_since > PATIENCE:
            raise ClusterError(
                f"the cluster has had no workers for {PATIENCE:.0f} s; start some, and do it again"
            )


def _culled(lazy: Any) -> Any:
    """A dask collection with no more of its graph than it needs."""
    from dask.core import flatten

    graph = lazy.__dask_graph__().cull(set(flatten(lazy.__dask_keys__())))
    rebuild, arguments = lazy.__dask_postpersist__()
    return rebuild(graph, *arguments)


def _lost(reason: object) -> ClusterError:
    return ClusterError(f"the scheduler of the cluster is gone ({reason}); start it again")


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
        It does not answer within 10 s, or has no workers within 30 s.
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
        # a client that never found its scheduler would hold up the end of the program
        asyncio.run(_ask(address))
        client = Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        raise CrfDeblurError(
            f"the scheduler {address} did not answer within {ANSWER:.0f} s; start it with "
            "`dask scheduler`, and give the address that it prints"
        ) from error
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
        yield client
    except TimeoutError as error:
        raise CrfDeblurError(
            f"the scheduler {address} has no workers; start some with `dask worker {address}`"
        ) from error
    finally:
        client.close()


async def _ask(address: str) -> None:
    """Raise OSError, of which TimeoutError is one, unless a scheduler answers."""
    from distributed.core import rpc

    async with rpc(address, timeout=ANSWER) as scheduler:
        await asyncio.wait_for(scheduler.identity(), ANSWER)
