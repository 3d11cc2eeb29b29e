"""Decoders of foreign code run in worker processes, where a crash, a hang or a flood of memory costs one message.

A worker is a fresh Python, not a fork: threads and graphics contexts do not survive one. Results come back through
memory that parent and worker share and that has no name, so nothing is left behind. Workers start when the first task
is met, are used again, and end with the last user of the pool; one whose parent has gone ends by itself.
"""

import json
import math
import mmap
import os
import pickle
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError

Function = Callable[[Any], NDArray[np.generic]]
"""Module-level function that a worker calls, found by its name. Its argument must be picklable."""
Take = Callable[[int, NDArray[np.generic]], None]
"""Gets the index of a task and its result, which is a view that the next result overwrites."""

_WORKER = Path(__file__).with_name("isolation_worker.py")
_LARGEST_REPLY = 2**16
_START_SECONDS = 300.0
_WAITING = 20
"""Times of its processor time for which a decoder may take: the rest is for others on a busy machine."""
# One thread each: the pool has a worker for every core, and the stack of each thread counts as memory, as does the room
# that the allocator keeps for it.
_ONE_THREAD = {
    "MALLOC_ARENA_MAX": "1",
    "MKL_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "OPENIMAGEIO_THREADS": "1",
    "OPJ_NUM_THREADS": "1",
}


@dataclass(frozen=True)
class WorkerRequest:
    """A function call to run in a worker, and its limits."""

    function: Function
    argument: object
    path: Path
    """The file that is decoded, for messages."""
    result_bytes: int
    """Largest size of the returned array."""
    memory_bytes: int
    """Memory that the call may add to the worker's own, without the result."""
    seconds: float
    """Limit of processor time."""


class Workers:
    """A pool of worker processes. Use `workers` to get it."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._workers: list[_Worker] = []
        self._lock = threading.Lock()

    def run(self, requests: Sequence[WorkerRequest], take: Take) -> None:
        """Run all requests, on one worker per core, and pass each result to `take` in this process.

        Results arrive in any order. Raises the error of the first request that fails: a VolprepError raised by the
        function, VP1270 (it crashed), VP1271 (too slow), VP1272 (too much memory), VP1273 (no worker), VP7070 (a worker
        without limits) or VP7071 (this machine's own limits are too low).
        """
        with self._lock:
            try:
                self._run(requests, take)
            finally:  # after an error, or Ctrl-C, some may still be at work
                for worker in self._workers:
                    if worker.index is not None:
                        worker.kill()
                self._workers = [worker for worker in self._workers if worker.is_alive]

    def result_of(self, request: WorkerRequest) -> NDArray[np.generic]:
        """Run one request and return its result, a copy. Raises what `run` raises."""
        results: list[NDArray[np.generic]] = []
        self.run([request], lambda _index, result: results.append(result.copy()))
        return results[0]

    def close(self) -> None:
        """End all workers."""
        with self._lock:
            for worker in self._workers:
                worker.kill()
            self._workers.clear()

    def _run(self, requests: Sequence[WorkerRequest], take: Take) -> None:
        waiting = deque(range(len(requests)))
        failures: dict[int, VolprepError] = {}
        while True:
            while waiting and not failures and (idle := self._idle(requests[waiting[0]].path)):
                first = waiting.popleft()
                idle.begin(first, requests[first])
            # Requests begin in order, so the first failure is known when all before it are done.
            busy = [w for w in self._workers if w.index is not None and w.index < min(failures, default=math.inf)]
            if not busy:
                break
            for worker in _ready(busy):
                index = worker.index
                assert index is not None  # noqa: S101 - it is busy
                try:
                    result = worker.result()
                    if result is not None:
                        take(index, result)
                except VolprepError as error:
                    failures[index] = error
        if failures:
            raise failures[min(failures)]

    def _idle(self, path: Path) -> "_Worker | None":
        for worker in self._workers:
            if worker.index is None and worker.is_alive:
                return worker
        self._workers = [worker for worker in self._workers if worker.is_alive]
        if len(self._workers) == self._count:
            return None
        try:
            self._workers.append(_Worker())
        except OSError as error:
            if self._workers:
                self._count = len(self._workers)
                return None
            raise VolprepError("VP1273", path=path, error=error.strerror or error) from error
        return self._workers[-1]


class _Worker:
    """One worker process, and the request that it is at."""

    def __init__(self) -> None:
        self.index: int | None = None
        """Index of its request; None when it is idle."""
        self.deadline = math.inf
        self._request: WorkerRequest | None = None
        self._reply = b""
        self._has_begun = False
        self._shared_file = _unnamed_file()
        self._shared = mmap.mmap(-1, 1)
        self.socket, theirs = socket.socketpair()
        """Socket that receives the replies."""
        quiet = None if os.environ.get("VOLPREP_TRACEBACK") == "1" else subprocess.DEVNULL
        try:
            with theirs:
                self._process = subprocess.Popen(  # noqa: S603 - ourselves
                    [sys.executable, "-P", _WORKER, str(theirs.fileno()), str(self._shared_file)],
                    pass_fds=(theirs.fileno(), self._shared_file),
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=quiet,
                    process_group=0,  # Ctrl-C is for the parent, which then ends its workers
                    env=os.environ | _ONE_THREAD,
                )
        except OSError:
            self._release()
            raise
        self._send(sys.path)

    @property
    def is_alive(self) -> bool:
        """Whether it can accept a request; the resources of a dead worker are released."""
        if self.socket.fileno() < 0:
            return False
        if self._process.poll() is not None:
            self._release()
            return False
        return True

    def begin(self, index: int, request: WorkerRequest) -> None:
        """Send a request."""
        size = max(request.result_bytes, 1)
        if len(self._shared) < size:
            os.ftruncate(self._shared_file, size)
            self._shared = mmap.mmap(self._shared_file, size)
        self.index, self._request, self._reply, self._has_begun = index, request, b"", False
        self.deadline = time.monotonic() + _START_SECONDS  # until Python and all imports are there
        self._send(request)

    def result(self) -> NDArray[np.generic] | None:
        """Return the worker's answer as a view, or None if it is not complete yet. Raises VolprepError."""
        request = self._request
        assert request is not None  # noqa: S101 - it is busy
        if not wait([self.socket], 0):
            if time.monotonic() <= self.deadline:
                return None
            self.kill()
            if not self._has_begun:
                raise VolprepError("VP1273", path=request.path, error=f"it had not begun after {_START_SECONDS:.0f} s")
            raise _too_slow(request, _WAITING * request.seconds, "waiting")
        try:
            received = self.socket.recv(_LARGEST_REPLY)
        except ConnectionError:
            received = b""
        self._reply += received
        if not received or len(self._reply) > _LARGEST_REPLY:
            how = self.kill()
            if not self._has_begun:
                raise VolprepError("VP1273", path=request.path, error=f"it ended before it began ({how})")
            if how == "SIGXCPU":
                raise VolprepError("VP7071", path=request.path, what="processor time", option="ulimit -t")
            if how == "SIGPROF":
                raise _too_slow(request, request.seconds, "processor time")
            raise self._crash(request, how)
        if self._reply.startswith(b"\n"):
            self._has_begun = True
            self._reply = self._reply[1:]
            self.deadline = time.monotonic() + _WAITING * request.seconds
        if not self._reply.endswith(b"\n"):
            return None
        self.index = None
        return self._understood(request, json.loads(self._reply))

    def kill(self) -> str:
        """End the process and return a description of its exit status."""
        try:
            status = self._process.wait(timeout=1 if self._has_ended() else 0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            status = self._process.wait()
        self._release()
        return signal.Signals(-status).name if status < 0 else f"exit status {status}"

    def _has_ended(self) -> bool:
        """Whether its end of the socket is closed, so that its exit status is about to come."""
        try:
            return not self.socket.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
        except BlockingIOError:
            return False
        except OSError:
            return True

    def _understood(self, request: WorkerRequest, answer: dict[str, Any]) -> NDArray[np.generic]:
        if "code" in answer:
            raise VolprepError(answer["code"], **answer["fields"])
        if "unlimited" in answer:
            raise VolprepError("VP7070", path=request.path, error=answer["unlimited"])
        if "memory" in answer:
            if answer["memory"] < request.memory_bytes:
                raise VolprepError("VP7071", path=request.path, what="memory", option="ulimit -v")
            raise VolprepError("VP1272", path=request.path, limit_mb=request.memory_bytes / 1e6)
        if "failed" in answer:
            raise self._crash(request, answer["failed"])
        dtype, shape = np.dtype(answer["dtype"]), answer["shape"]
        return np.frombuffer(self._shared, dtype, math.prod(shape)).reshape(shape)

    @staticmethod
    def _crash(request: WorkerRequest, how: str) -> VolprepError:
        return VolprepError("VP1270", path=request.path, how=how, limit_mb=request.memory_bytes / 1e6)

    def _send(self, message: object) -> None:
        # Without a signal: the command line lets SIGPIPE end it. That the worker has died shows when it is read from.
        try:
            self.socket.sendall(pickle.dumps(message), getattr(socket, "MSG_NOSIGNAL", 0))
        except ConnectionError:
            return

    def _release(self) -> None:
        if self.socket.fileno() >= 0:
            self.index = None
            self.socket.close()
            os.close(self._shared_file)


def _too_slow(request: WorkerRequest, limit_s: float, of: str) -> VolprepError:
    return VolprepError("VP1271", path=request.path, limit_s=limit_s, of=of)


def _ready(busy: Sequence[_Worker]) -> list[_Worker]:
    """Wait until some have answered or used up their time."""
    timeout_s = max(0.0, min(worker.deadline for worker in busy) - time.monotonic())
    answered = wait([worker.socket for worker in busy], timeout_s)
    return [worker for worker in busy if worker.socket in answered or worker.deadline < time.monotonic()]


def _unnamed_file() -> int:
    """Return the descriptor of a file that vanishes with its last user, in memory where the system has such."""
    if sys.platform == "linux":
        return os.memfd_create("volprep-result")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


_pool: Workers | None = None
_users = 0
_guard = threading.Lock()


@contextmanager
def workers() -> Iterator[Workers]:
    """Return the pool of this process, with a worker for each core. Its workers end with its last user."""
    global _pool, _users  # noqa: PLW0603 - one pool for all decoders
    with _guard:
        _pool = _pool or Workers(available_cores())
        _users += 1
        pool = _pool
    try:
        yield pool
    finally:
        with _guard:
            _users -= 1
            if _users == 0:
                pool.close()


def available_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
