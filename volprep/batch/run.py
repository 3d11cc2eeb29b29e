"""A batch: what is done and unchanged stays, everything else is handed to workers, and a page tells of all."""

import secrets
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from volprep.batch.guard import Limits
from volprep.batch.jobs import Job, expand
from volprep.batch.ledger import Ledger
from volprep.batch.page import write_pages
from volprep.batch.place import Place
from volprep.batch.table import is_table, scans_in_table
from volprep.batch.tree import scans_in_tree
from volprep.batch.work import Ended, Task, is_done
from volprep_formats.diagnostics import ExitStatus
from volprep_formats.progress import Progress


class Engine(Protocol):
    """Does tasks, somewhere."""

    def run(self, tasks: Iterable[Task]) -> Iterator[Ended]:
        """Do tasks; give each result as soon as it is there, in any order."""
        ...


class Watcher(Protocol):
    """Is told how far a batch is."""

    def begin(self, jobs: int) -> None:
        """Take the number of jobs."""
        ...

    def ended(self, ended: Ended) -> None:
        """Take the end of a job."""
        ...


@dataclass(frozen=True)
class Wishes:
    """How a batch is done."""

    validate: bool
    """Whether packages are validated, too."""
    retry_failed: bool
    """Whether to try again what failed before."""
    limits: Limits


def find_jobs(path: Path, place: Place, scene: Path | None, profiles: Sequence[str], progress: Progress) -> list[Job]:
    """List the jobs of a folder tree, a scan or a table. Makes the folder of the batch, which holds the key of names.

    Raises what `scans_in_tree`, `scans_in_table` and `expand` raise, and VP4020 where the folder cannot be written.
    """
    found = scans_in_table(path, has_scene=scene is not None) if is_table(path) else scans_in_tree(path, progress)
    place.prepare()
    return expand(found, path, place.key(), scene, profiles)


def run_batch(jobs: Sequence[Job], place: Place, wishes: Wishes, engine: Engine, watcher: Watcher) -> ExitStatus:
    """Do all jobs that are not done, and write the pages. Returns the highest exit status of these jobs.

    Interrupted, it leaves a ledger and pages that tell of what has ended. Raises VP4020 and VP8010 for a ledger that
    cannot be used, and what the engine raises.
    """
    ledger = Ledger(place)
    before = ledger.tidy()
    run = secrets.token_hex(8)
    highest = ExitStatus.OK
    watcher.begin(len(jobs))
    try:
        waiting: list[Task] = []
        for job in jobs:
            record = before.get((job.name, job.profile))
            seen = None if record is None else record.ended
            task = Task(job, place, run, wishes.validate, wishes.retry_failed, seen, wishes.limits)
            if record is not None and is_done(record, task):
                watcher.ended(Ended(task, record, is_new=False))
                highest = max(highest, record.status)
            else:
                waiting.append(task)
        if waiting:
            for ended in engine.run(waiting):
                watcher.ended(ended)
                if ended.record is not None:
                    highest = max(highest, ended.record.status)
    finally:
        write_pages(place, ledger.tidy())
    return highest
