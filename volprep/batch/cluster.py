"""Dask distributed as engine: worker processes on this machine, or of a running scheduler.

The scheduler notices a worker that dies; no other worker is affected, and its scan is scheduled again. A worker's notes
beside the lock of a job show the next one how the attempt ended, so that it does not matter who counts deaths.
"""

import asyncio
import logging
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib.metadata import version
from importlib.util import find_spec
from itertools import islice

import dask
from distributed import Client, Future, LocalCluster, Worker, WorkerPlugin, as_completed
from distributed.comm.core import CommClosedError
from distributed.scheduler import KilledWorker

from volprep.batch.work import ATTEMPTS, Task, TaskError, TaskResult, answer, give_up, understood
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import NO_ROOM

_WAIT_S = 30.0
"""For an answer of a scheduler, and for its first worker."""
_AT_A_TIME = 1000
"""Tasks that the scheduler knows at the same time: enough for that number of cores, and little memory."""
_ONLY_HERE = "127.0.0.1:0"
"""Address of the scheduler's status page: reachable from this machine alone, on any free port."""
_SEMAPHORES = "/dev/shm"  # noqa: S108 - nothing is written there by name
"""Folder of semaphores, which multiprocessing makes for each worker."""
_SETTINGS = {
    # Each crash is returned to us: this program counts a second attempt.
    "distributed.scheduler.allowed-failures": 0,
    # A killed worker is restarted by its nanny. After this time the cluster would give up both for good: with Dask's 15
    # s, a batch on a busy machine was left without workers, and waited.
    "distributed.deploy.lost-worker-timeout": "10 days",
    # Dask would look at every worker's stack a hundred times a second, under the lock that the scan needs.
    "distributed.worker.profile.enabled": False,
    # A worker has one scan and holds no results: limits of memory are watched where the work is done.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
}


class Local:
    """Worker processes of this machine, with one thread each."""

    def __init__(self, workers: int, dashboard: Callable[[str], None]) -> None:
        self._workers = workers
        self._dashboard = dashboard

    def run(self, tasks: Iterable[Task]) -> Iterator[TaskResult]:
        """Do tasks; yield each result as soon as it is available. Raises VP4020 and the errors of `work`."""
        with dask.config.set(_SETTINGS), self._cluster() as cluster, Client(cluster, set_as_default=False) as client:
            _tell_dashboard(client, self._dashboard)
            client.register_plugin(_LeaveInterruptsToParent())
            yield from _run(client, tasks)

    def _cluster(self) -> LocalCluster:
        """Start the workers. Raises VP4020 if there is no room for their semaphores."""
        try:
            return LocalCluster(
                n_workers=self._workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=_ONLY_HERE,
                silence_logs=logging.CRITICAL,
            )
        except RuntimeError as error:
            cause: BaseException | None = error
            while cause is not None and not isinstance(cause, OSError):
                cause = cause.__cause__ or cause.__context__
            if cause is None or cause.errno not in NO_ROOM:
                raise
            raise VolprepError("VP4020", path=_SEMAPHORES, error=cause.strerror) from error


class Remote:
    """The workers of a scheduler."""

    def __init__(self, address: str, dashboard: Callable[[str], None]) -> None:
        self._address = address
        self._dashboard = dashboard

    def run(self, tasks: Iterable[Task]) -> Iterator[TaskResult]:
        """Do tasks; yield each result as soon as it is available.

        Raises VP8030 for a scheduler that does not answer, VP8031 for workers of another version, VP8032 if there are
        no workers, and the errors of `work`.
        """
        with self._client() as client:
            try:
                yield from _run(client, tasks)
            except (CancelledError, asyncio.CancelledError, CommClosedError) as error:
                raise VolprepError("VP8030", address=self._address, error="the connection is lost") from error

    @contextmanager
    def _client(self) -> Iterator[Client]:
        try:
            client = Client(self._address, timeout=_WAIT_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise VolprepError("VP8030", address=self._address, error=error) from error
        with client:
            try:
                client.wait_for_workers(1, timeout=_WAIT_S)
            except TimeoutError as error:
                raise VolprepError("VP8032", address=self._address, limit_s=_WAIT_S) from error
            here = version("volprep")
            for found in client.run(_version).values():
                if found != here:
                    raise VolprepError("VP8031", address=self._address, found=found, here=here)
            _tell_dashboard(client, self._dashboard)
            yield client


class _LeaveInterruptsToParent(WorkerPlugin):
    """Ctrl-C reaches all processes of a terminal; the parent ends its workers."""

    def setup(self, worker: Worker) -> None:  # noqa: ARG002 - so Dask calls it
        """Begin in a worker, in its main thread."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _tell_dashboard(client: Client, tell: Callable[[str], None]) -> None:
    """Report the address of the scheduler's page, if it has one: without bokeh there is no page."""
    if client.run_on_scheduler(_has_dashboard) and client.dashboard_link:
        tell(client.dashboard_link)


def _has_dashboard() -> bool:
    return find_spec("bokeh") is not None


def _version() -> str:
    try:
        return version("volprep")
    except ImportError:
        return "none"


def _run(client: Client, tasks: Iterable[Task]) -> Iterator[TaskResult]:
    waiting = iter(tasks)
    pending: dict[Future[TaskResult | TaskError], tuple[Task, int]] = {}

    def submitted(task: Task, attempt: int) -> "Future[TaskResult | TaskError]":
        future = client.submit(answer, task, pure=False)
        pending[future] = task, attempt
        return future

    done = as_completed([submitted(task, 1) for task in islice(waiting, _AT_A_TIME)], loop=client.loop)
    for future in done:
        task, attempt = pending.pop(future)
        try:
            ended = understood(future.result())
        except KilledWorker:
            if attempt <= ATTEMPTS:  # the one after the last finds that all have died, and records it
                done.add(submitted(task, attempt + 1))
                continue
            ended = give_up(task)
        future.release()
        for following in islice(waiting, 1):
            done.add(submitted(following, 1))
        yield ended
