"""Where a verb spends its time, task by task."""

import os
import time
from dataclasses import dataclass

from volprep_cli.console import print_table
from volprep_formats.progress import Progress


@dataclass
class TaskTime:
    """A task and its time."""

    task: str
    """As progress names it; `prepare` until the first one starts."""
    seconds: float
    """On the clock."""
    processor_seconds: float
    """Of all threads of this process, and of worker processes that ended meanwhile."""


class Timing:
    """Progress that adds up the time of each task, and shows the task to another progress."""

    def __init__(self, shown: Progress) -> None:
        self._shown = shown
        self._now = _clocks()
        self._tasks = {"prepare": TaskTime("prepare", 0.0, 0.0)}
        self._task = self._tasks["prepare"]

    def start(self, task: str, total: int) -> None:
        """Begin a task. One that starts again goes on."""
        self._add()
        self._task = self._tasks.setdefault(task, TaskTime(task, 0.0, 0.0))
        self._shown.start(task, total)

    def advance(self, units: int = 1) -> None:
        """Pass the units on."""
        self._shown.advance(units)

    def tasks(self) -> list[TaskTime]:
        """Return the tasks up to now, in the order in which they first started."""
        self._add()
        return list(self._tasks.values())

    def _add(self) -> None:
        before, self._now = self._now, _clocks()
        self._task.seconds += self._now[0] - before[0]
        self._task.processor_seconds += self._now[1] - before[1]


def _clocks() -> tuple[float, float]:
    return time.perf_counter(), sum(os.times()[:4])


def print_times(tasks: list[TaskTime]) -> None:
    """Print a row for each task, and their sum."""
    total = TaskTime("together", sum(task.seconds for task in tasks), sum(task.processor_seconds for task in tasks))
    rows = [
        (task.task, f"{task.seconds:.2f}", f"{task.processor_seconds:.2f}", f"{task.seconds / total.seconds:.0%}")
        for task in (*tasks, total)
    ]
    print_table(("task", "s", "processor s", "share"), rows)
