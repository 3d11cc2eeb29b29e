"""A batch: what is done and unchanged stays, everything else is handed to workers, and a page tells of all."""

import secrets
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from volprep.batch.guard import Limits
from volprep.batch.jobs import Defaults, Job, expand
from volprep.batch.ledger import Ledger
from volprep.batch.place import Place
from volprep.batch.rules import Matched, Rules, read_rules, require_one_each
from volprep.batch.storage import is_url, require_target
from volprep.batch.store_tree import scans_in_store
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
    to: str | None = None
    """Address below which packages are stored; None leaves them in the folder."""


def find_scans(
    path: Path | str, progress: Progress, *, has_scene: bool, rules: Rules | None, facts: bool
) -> list[Matched]:
    """List the scans of a folder tree, a scan, a table or an address with their rules; `facts` reads all headers.

    Raises what `scans_in_tree`, `scans_in_table` and `scans_in_store` raise.
    """
    if isinstance(path, str) and is_url(path):
        return [Matched(scan, ("",), skip=False) for scan in scans_in_store(path)]
    path = Path(path)
    if is_table(path):
        found = scans_in_table(path, has_scene=has_scene)
    else:
        found = scans_in_tree(path, progress, with_facts=facts or rules is not None)
    return [Matched(scan, ("",), skip=False) if rules is None else rules.chosen(scan) for scan in found]


def find_jobs(
    path: Path | str, place: Place, defaults: Defaults, progress: Progress, rules: Path | None = None
) -> list[Job]:
    """List the jobs of a folder tree, a scan, a table or an address.

    Makes the folder of the batch, which holds the key of names. Raises what `find_scans`, `read_rules`,
    `require_one_each` and `expand` raise, and VP4020 where the folder cannot be written.
    """
    read = None if rules is None else read_rules(rules)
    matched = find_scans(path, progress, has_scene=defaults.scene is not None, rules=read, facts=False)
    found = require_one_each(matched, rules or Path(path))
    place.prepare()
    return expand(found, path, place.key(), defaults)


def run_batch(jobs: Sequence[Job], place: Place, wishes: Wishes, engine: Engine, watcher: Watcher) -> ExitStatus:
    """Do all jobs that are not done, and write the pages. Returns the highest exit status of these jobs.

    Interrupted, it leaves a ledger and pages that tell of what has ended. Raises VP4020 and VP8010 for a ledger that
    cannot be used, what `require_target` raises, and what the engine raises.
    """
    if wishes.to is not None:
        require_target(wishes.to)
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
            task = Task(job, place, run, wishes.validate, wishes.retry_failed, seen, wishes.limits, wishes.to)
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
        from volprep.batch.page import write_pages  # noqa: PLC0415 - loads templates, which a dry run needs not

        write_pages(place, ledger.tidy())
    return highest
