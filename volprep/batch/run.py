"""Run a batch: finished, unchanged jobs are kept, all others go to workers, and a page reports all of them."""

import secrets
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from volprep.batch.attempts import forget_done
from volprep.batch.guard import Limits
from volprep.batch.jobs import Defaults, Job, expand
from volprep.batch.ledger import Ledger
from volprep.batch.other_files import OtherFiles, other_files
from volprep.batch.place import Place
from volprep.batch.rules import Matched, Rules, read_rules, require_one_each
from volprep.batch.storage import is_url, require_target
from volprep.batch.store_tree import scans_in_store
from volprep.batch.table import is_table, scans_in_table
from volprep.batch.tree import scans_in_tree
from volprep.batch.work import Task, TaskResult, is_done
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.output import output_errors
from volprep_formats.progress import Progress


class Engine(Protocol):
    """Does tasks, somewhere."""

    def run(self, tasks: Iterable[Task]) -> Iterator[TaskResult]:
        """Do tasks; yield each result as soon as it is available, in any order."""
        ...


class Watcher(Protocol):
    """Progress callbacks of a batch."""

    def begin(self, jobs: int) -> None:
        """Take the number of jobs."""
        ...

    def ended(self, ended: TaskResult) -> None:
        """Take the end of a job."""
        ...

    def passed(self, error: VolprepError) -> None:
        """Take the error of a ledger line that was skipped."""
        ...


@dataclass(frozen=True)
class Wishes:
    """Settings of a batch."""

    validate: bool
    """Whether packages are validated, too."""
    retry_failed: bool
    """Whether to retry jobs that failed before."""
    limits: Limits
    to: str | None = None
    """Address below which packages are stored; None leaves them in the folder."""
    digests: bool = False
    """Whether to compare the digest of each file of packages that are there; their sizes are always compared."""


def find_scans(
    path: Path | str,
    progress: Progress,
    *,
    has_scene: bool,
    rules: Rules | None,
    facts: bool,
    others: Callable[[OtherFiles], None] | None = None,
) -> list[Matched]:
    """List the scans of a folder tree, a scan, a table or an address with their rules; `facts` reads all headers.

    `others` is called with the files of a tree that are no scans, if there are any.

    Raises the errors of `scans_in_tree`, `scans_in_table` and `scans_in_store`.
    """
    if isinstance(path, str) and is_url(path):
        return [Matched(scan, ("",), skip=False) for scan in scans_in_store(path)]
    path = Path(path)
    if is_table(path):
        found = scans_in_table(path, has_scene=has_scene)
    else:
        found = scans_in_tree(path, progress, with_facts=facts or rules is not None)
        left_out = other_files(path, found)
        if others is not None and left_out.count:
            others(left_out)
    return [Matched(scan, ("",), skip=False) if rules is None else rules.chosen(scan) for scan in found]


def find_jobs(
    path: Path | str,
    place: Place,
    defaults: Defaults,
    progress: Progress,
    rules: Path | None = None,
    *,
    others: Callable[[OtherFiles], None] | None = None,
) -> list[Job]:
    """List the jobs of a folder tree, a scan, a table or an address; `others` as for `find_scans`.

    Makes the folder of the batch, which holds the key of names. Raises the errors of `find_scans`, `read_rules`,
    `require_one_each` and `expand`, and VP4020 if the folder cannot be written.
    """
    read = None if rules is None else read_rules(rules)
    matched = find_scans(path, progress, has_scene=defaults.scene is not None, rules=read, facts=False, others=others)
    found = require_one_each(matched, rules or Path(path))
    place.prepare()
    return expand(found, path, place.key(), defaults)


def run_batch(jobs: Sequence[Job], place: Place, wishes: Wishes, engine: Engine, watcher: Watcher) -> ExitStatus:
    """Do all jobs that are not done, and write the pages. Returns the highest exit status of these jobs.

    If interrupted, it leaves a ledger and pages that cover the finished jobs. Raises VP4020 for a ledger that cannot be
    used, and the errors of `require_target` and of the engine.
    """
    if wishes.to is not None:
        require_target(wishes.to)
    place.note_names({job.name: job.shown_source for job in jobs})
    ledger = Ledger(place)
    passed: list[VolprepError] = []
    before = ledger.tidy(passed)
    run = secrets.token_hex(8)
    highest = ExitStatus.OK
    watcher.begin(len(jobs))
    for error in passed:
        watcher.passed(error)
    try:
        waiting: list[Task] = []
        for job in jobs:
            record = before.get((job.name, job.profile))
            seen = None if record is None else record.ended
            task = Task(
                job, place, run, wishes.validate, wishes.retry_failed, seen, wishes.limits, wishes.to, wishes.digests
            )
            if record is not None and is_done(record, task):
                with output_errors(place.folder):
                    forget_done(place.job_lock(job.name, job.profile))
                watcher.ended(TaskResult(task, record, is_new=False))
                highest = max(highest, record.status)
            else:
                waiting.append(task)
        if waiting:
            for ended in engine.run(waiting):
                watcher.ended(ended)
                if ended.record is not None:
                    highest = max(highest, ended.record.status)
    finally:
        from volprep.batch.page import write_pages  # noqa: PLC0415 - loads templates, which a dry run needs not

        write_pages(place, ledger.tidy())
    return highest
