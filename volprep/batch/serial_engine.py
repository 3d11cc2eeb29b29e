"""Engine that builds one scan after another in a child process that may crash: for each machine of a job array."""

import multiprocessing
import signal
from collections.abc import Iterable, Iterator
from multiprocessing.connection import Connection

from volprep.batch.work import ATTEMPTS, Task, TaskResult, answer, give_up, understood

# Not forked: threads and graphics contexts do not survive that.
_CONTEXT = multiprocessing.get_context("spawn")


class Alone:
    """An engine of one process."""

    def run(self, tasks: Iterable[Task]) -> Iterator[TaskResult]:
        """Do each task; yield its result as soon as it is available. Raises the errors of `work`."""
        worker = _Worker()
        try:
            for task in tasks:
                for _ in range(ATTEMPTS + 1):  # the one after the last finds that all have died, and records it
                    ended = worker.work(task)
                    if ended is not None:
                        break
                    worker = _Worker()
                yield ended or give_up(task)
        finally:
            worker.kill()


class _Worker:
    """A process that works on one task after the other."""

    def __init__(self) -> None:
        self._connection, theirs = _CONTEXT.Pipe()
        self._process = _CONTEXT.Process(target=_serve, args=(theirs,), daemon=False)
        self._process.start()
        theirs.close()

    def work(self, task: Task) -> TaskResult | None:
        """Return the result of a task; None if the process crashed. Raises the errors of `work`."""
        try:
            self._connection.send(task)
            given = self._connection.recv()
        except (EOFError, ConnectionError):
            self.kill()
            return None
        return understood(given)

    def kill(self) -> None:
        """End the process, whatever it does."""
        self._connection.close()
        self._process.kill()
        self._process.join()


def _serve(connection: Connection) -> None:
    # Ctrl-C is for the parent, which then ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            task = connection.recv()
        except EOFError:  # the parent has gone
            return
        try:
            connection.send(answer(task))
        except ConnectionError:
            return
