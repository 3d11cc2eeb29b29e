"""Display of a running batch: one bar on a terminal, and a line for each finished job."""

import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from volprep_cli.console import bytes_text, print_line, print_note
from volprep_cli.streams import unescaped
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.shown import shown

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bar

    from volprep.batch.other_files import OtherFiles
    from volprep.batch.work import TaskResult


@contextmanager
def watching(*, as_json: bool) -> Iterator["BatchWatcher"]:
    """Show the progress of a batch. If stderr is not a terminal, only lines are printed, without a bar."""
    if not sys.stderr.isatty():
        yield BatchWatcher(None, as_json=as_json)
        return
    from rich.console import Console

    # Lines go above the bar where both are on the terminal; what goes to a file is nothing to it.
    with bar_on(Console(file=unescaped(sys.stderr)), over_lines=sys.stdout.isatty()) as bar:
        yield BatchWatcher(bar, as_json=as_json)


def bar_on(console: "Console", *, over_lines: bool = False) -> "Bar":
    """Return the bar of a batch: scans, bytes of packages, failures, time left."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[size]}"),
        TextColumn("{task.fields[failed]} failed"),
        TimeRemainingColumn(),
    )
    return Bar(*columns, console=console, redirect_stdout=over_lines)


def no_scans_json(others: "Sequence[OtherFiles]") -> dict[str, object]:
    """Return the JSON of the files of a tree that are no scans, if there are any."""
    return {"no_scans": {"files": others[0].count, "endings": dict(others[0].endings)}} if others else {}


class BatchWatcher:
    """Prints a line for each job that ends, and moves the bar, if there is one."""

    def __init__(self, bar: "Bar | None", *, as_json: bool) -> None:
        self._bar = bar
        self._as_json = as_json
        self._began = time.monotonic()
        self._counts = {"built": 0, "unchanged": 0, "failed": 0, "elsewhere": 0}
        self._failed_before = 0
        self._jobs = 0
        self._bytes = 0
        self._task = None if bar is None else bar.add_task("scans", total=None, failed=0, size=bytes_text(0))

    def dashboard(self, link: str) -> None:
        """Take the address of a page that shows the workers: it is for who sits at a terminal."""
        if self._bar is not None:
            self._bar.console.print(f"dashboard: {shown(link)}", markup=False, highlight=False)

    def begin(self, jobs: int) -> None:
        """Take the number of jobs."""
        self._jobs = jobs
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, total=jobs)

    def passed(self, error: VolprepError) -> None:
        """Warn about a skipped line of the ledger."""
        if self._as_json:
            self._line(json.dumps({"passed": {"code": error.code, "summary": error.summary}}))
        else:
            self._line(str(error))

    def ended(self, ended: "TaskResult") -> None:
        """Take the end of a job."""
        record = ended.record
        if record is None:
            self._counts["elsewhere"] += 1
        else:
            self._counts["failed"] += record.outcome == "failed"
            self._failed_before += record.outcome == "failed" and not ended.is_new
            self._counts["unchanged" if not ended.is_new else "built"] += record.outcome == "built"
            self._bytes += record.size_bytes
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, advance=1, failed=self._counts["failed"], size=bytes_text(self._bytes))
        if self._as_json:
            self._print_json(ended)
        elif ended.is_new or record is None:
            self._print(ended)

    def finish(self, page: Path, status: ExitStatus, others: "Sequence[OtherFiles]") -> None:
        """Print the summary of all jobs, and the files that are not scans."""
        seconds = round(time.monotonic() - self._began, 1)
        if self._as_json:
            told = no_scans_json(others)
            self._line(json.dumps({"summary": {**self._counts, "seconds": seconds, "status": int(status), **told}}))
            return
        for value in others:
            self._line(str(value))
        counts = self._counts
        elsewhere = f", {counts['elsewhere']} in work by another batch" if counts["elsewhere"] else ""
        self._line(
            f"{counts['built']} built, {counts['unchanged']} unchanged, {counts['failed']} failed{elsewhere}; "
            f"{seconds:.1f} s; {shown(os.fspath(page))}"
        )
        if self._failed_before:
            print_note(f"{self._failed_before} that failed before were not tried again; --retry-failed tries them")
        if counts["failed"]:
            print_note("volprep batch --explain NAME -o FOLDER prints the scan of a name, and why it failed")

    def _print_json(self, ended: "TaskResult") -> None:
        job = ended.task.job
        record = None if ended.record is None else ended.record.model_dump(mode="json")
        self._line(json.dumps({"name": job.name, "profile": job.profile, "new": ended.is_new, "record": record}))

    def _print(self, ended: "TaskResult") -> None:
        job, record = ended.task.job, ended.record
        if record is None:
            end = "another batch works on it"
        elif record.errors:
            end = f"failed: {record.errors[0].code} {record.errors[0].summary}"
        else:
            end = f"{record.verdict or 'built'}, {record.seconds:.1f} s"
        # Where no bar shows how far the batch is, each line does.
        place = "" if self._bar is not None else f" ({sum(self._counts.values())} of {self._jobs})"
        self._line(f"{job.name} {job.profile}: {end}{place}")

    def _line(self, text: str) -> None:
        print_line(text)
        sys.stdout.flush()
