"""volprep batch: packages of many scans."""

import json
import os
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import print_json, print_line, print_table, progress
from volprep_formats.diagnostics import ExitStatus
from volprep_formats.shown import shown

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from volprep.batch.guard import Limits
    from volprep.batch.jobs import Job
    from volprep.batch.run import Engine
    from volprep.batch.work import Ended

Jobs = Annotated[
    Path,
    typer.Argument(
        help="Folder tree with scans, or a table of jobs: CSV or JSON lines with the columns source, series, volume, "
        "scene, profiles, name.",
        metavar="JOBS",
    ),
]
Folder = Annotated[
    Path, typer.Option("-o", "--output", help="Folder of the packages, the ledger and the pages.", metavar="FOLDER")
]
Scene = Annotated[
    Path | None,
    typer.Option(
        help="Scene file for all scans that have none in the table; its source is replaced. If not given, scans are "
        "drawn with a grey ramp over all their values.",
        metavar="SCENE",
    ),
]
Profiles = Annotated[
    list[str],
    typer.Option(
        "--profile",
        help="Class of devices for all scans that have none in the table; can be given several times.",
        metavar="PROFILE",
    ),
]
Validate = Annotated[bool, typer.Option("--validate", help="Validate each package, and write its report.")]
Workers = Annotated[
    int | None,
    typer.Option(min=1, help="Processes at a time on this machine; if not given, its cores.", metavar="N"),
]
Scheduler = Annotated[
    str | None,
    typer.Option(help="Address of a Dask scheduler, whose workers are used.", metavar="tcp://HOST:PORT"),
]
Shard = Annotated[
    str | None,
    typer.Option(
        help="Do only part I of N, for job arrays. The parts may run at the same time. Without --workers, one scan "
        "after the other is built.",
        metavar="I/N",
    ),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Only list the jobs. The list shows paths.")]
Retry = Annotated[bool, typer.Option("--retry-failed", help="Try again what failed before.")]
TimeLimit = Annotated[
    float, typer.Option(min=0.1, help="Longest time that a scan may take, in seconds.", metavar="SECONDS")
]
MemoryLimit = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Largest memory of a process, in MB; if not given, an equal share of this machine's, or no limit with "
        "--scheduler.",
        metavar="MB",
    ),
]
Lines = Annotated[
    bool, typer.Option("--json", help="Print JSON lines: the record of each job, and a summary at the end.")
]


def batch(
    jobs: Jobs,
    output: Folder,
    scene: Scene = None,
    profile: Profiles = [],  # noqa: B006 - typer asks for a list, and nothing changes it
    *,
    validate: Validate = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    shard: Shard = None,
    dry_run: DryRun = False,
    retry_failed: Retry = False,
    time_limit: TimeLimit = 3600.0,
    memory_limit: MemoryLimit = None,
    as_json: Lines = False,
) -> None:
    """Build packages of many scans, and keep a ledger of what became of each.

    Run again, it leaves out what is done and unchanged. One scan that fails stops no other. The exit status is the
    highest of all jobs': 0 all well, 1 a picture beyond its tolerance, 3 a scan that cannot be read, and so on.
    """
    if scheduler is not None and workers is not None:
        msg = "--workers are processes of this machine, and --scheduler has workers of its own: give one of them"
        raise typer.BadParameter(msg)
    part = _part(shard)
    from volprep.batch.jobs import in_shard
    from volprep.batch.place import Place
    from volprep.batch.run import Wishes, find_jobs, run_batch

    place = Place(output.absolute())
    with progress() as finding:
        found = find_jobs(jobs, place, scene, profile, finding)
    if part is not None:
        found = [job for job in found if in_shard(job.name, *part)]
    if dry_run:
        _print_jobs(found, as_json=as_json)
        return
    engine, count = _engine(workers, scheduler, alone=part is not None)
    wishes = Wishes(validate, retry_failed, _limits(time_limit, memory_limit, count))
    with _watcher(as_json=as_json) as watcher:
        status = run_batch(found, place, wishes, engine, watcher)
    watcher.finish(place.folder / "index.html", status)
    if status is not ExitStatus.OK:
        raise typer.Exit(status)


def _part(shard: str | None) -> tuple[int, int] | None:
    if shard is None:
        return None
    numbers = re.fullmatch(r"([1-9]\d{0,8})/([1-9]\d{0,8})", shard)
    if numbers is None or int(numbers[1]) > int(numbers[2]):
        msg = f"--shard is {shard}, and must be I/N with I from 1 to N, such as 3/20"
        raise typer.BadParameter(msg)
    return int(numbers[1]), int(numbers[2])


def _engine(workers: int | None, scheduler: str | None, *, alone: bool) -> "tuple[Engine, int | None]":
    """Return the engine, and how many processes share this machine; None if they are elsewhere."""
    if alone and workers is None and scheduler is None:
        from volprep.batch.alone import Alone

        return Alone(), 1
    from volprep.batch.cluster import Local, Remote

    if scheduler is not None:
        return Remote(scheduler), None
    from volprep_formats.isolation import available_cores

    count = workers or available_cores()
    return Local(count), count


def _limits(seconds: float, memory_mb: int | None, count: int | None) -> "Limits":
    from volprep.batch.guard import Limits, machine_memory_bytes

    if memory_mb is not None:
        return Limits(seconds, memory_mb * 10**6)
    return Limits(seconds, None if count is None else machine_memory_bytes() // count)


def _print_jobs(jobs: "list[Job]", *, as_json: bool) -> None:
    rows = [(job.name, job.profile, job.shown_source) for job in jobs]
    if as_json:
        print_json({"jobs": [dict(zip(("name", "profile", "source"), row, strict=True)) for row in rows]})
    else:
        print_table(("name", "profile", "source"), rows)
        print_line(f"{len(rows)} packages; nothing was built")


@contextmanager
def _watcher(*, as_json: bool) -> "Iterator[_Watcher]":
    if not sys.stderr.isatty():
        yield _Watcher(None, as_json=as_json)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]} failed"),
        TimeRemainingColumn(),
    )
    # Lines go above the bar where both are on the terminal; what goes to a file is nothing to it.
    with Bar(*columns, console=Console(stderr=True), redirect_stdout=sys.stdout.isatty()) as bar:
        yield _Watcher(bar, as_json=as_json)


class _Watcher:
    """Prints a line for each job that ends, and moves the bar, if there is one."""

    def __init__(self, bar: "Bar | None", *, as_json: bool) -> None:
        self._bar = bar
        self._as_json = as_json
        self._began = time.monotonic()
        self._counts = {"built": 0, "unchanged": 0, "failed": 0, "elsewhere": 0}
        self._task = None if bar is None else bar.add_task("scans", total=None, failed=0)

    def begin(self, jobs: int) -> None:
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, total=jobs)

    def ended(self, ended: "Ended") -> None:
        record = ended.record
        if record is None:
            self._counts["elsewhere"] += 1
        else:
            self._counts["failed"] += record.outcome == "failed"
            self._counts["unchanged" if not ended.is_new else "built"] += record.outcome == "built"
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, advance=1, failed=self._counts["failed"])
        if self._as_json:
            self._print_json(ended)
        elif ended.is_new or record is None:
            self._print(ended)

    def finish(self, page: Path, status: ExitStatus) -> None:
        """Print what came of all."""
        seconds = round(time.monotonic() - self._began, 1)
        if self._as_json:
            self._line(json.dumps({"summary": {**self._counts, "seconds": seconds, "status": int(status)}}))
            return
        counts = self._counts
        elsewhere = f", {counts['elsewhere']} in work by another batch" if counts["elsewhere"] else ""
        self._line(
            f"{counts['built']} built, {counts['unchanged']} unchanged, {counts['failed']} failed{elsewhere}; "
            f"{seconds:.1f} s; {shown(os.fspath(page))}"
        )

    def _print_json(self, ended: "Ended") -> None:
        job = ended.task.job
        record = None if ended.record is None else ended.record.model_dump(mode="json")
        self._line(json.dumps({"name": job.name, "profile": job.profile, "new": ended.is_new, "record": record}))

    def _print(self, ended: "Ended") -> None:
        job, record = ended.task.job, ended.record
        name = f"{job.name} {job.profile}"
        if record is None:
            self._line(f"{name}: another batch works on it")
        elif record.errors:
            self._line(f"{name}: failed: {record.errors[0].code} {record.errors[0].summary}")
        else:
            self._line(f"{name}: {record.verdict or 'built'}, {record.seconds:.1f} s")

    def _line(self, text: str) -> None:
        print_line(text)
        sys.stdout.flush()
