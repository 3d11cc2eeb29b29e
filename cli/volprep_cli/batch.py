"""volprep batch: packages of many scans."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.choices import Choices, complete_profiles, takes_choices
from volprep_cli.console import print_line, progress
from volprep_formats.diagnostics import ExitStatus

if TYPE_CHECKING:
    from volprep.batch.guard import Limits
    from volprep.batch.other_files import OtherFiles
    from volprep.batch.run import Engine

Jobs = Annotated[
    str | None,
    typer.Argument(
        help="Folder tree with scans, its address in a store (s3://...), or a table of jobs: CSV or JSON lines "
        "with the columns source, series, volume, mask, scene, profiles, name.",
        metavar="JOBS",
    ),
]
Folder = Annotated[
    Path, typer.Option("-o", "--output", help="Folder of the packages, the ledger and the pages.", metavar="FOLDER")
]
Names = Annotated[
    str | None,
    typer.Option(
        "-f",
        "--names",
        help="Names of the packages of DICOM series, such as {series_number}_{kernel}; also {echo} and {hash}. A "
        "part of the hash is appended. If not given, names contain nothing about a scan.",
        metavar="PATTERN",
    ),
]
Explain = Annotated[
    str | None,
    typer.Option(
        help="Only print which scan a name of this batch belongs to, and why it failed. Takes the place of JOBS.",
        metavar="NAME",
    ),
]
Scene = Annotated[
    Path | None,
    typer.Option(
        help="Scene file for all scans that have none in the table; its source is replaced. If not given, the look "
        "of each scan is chosen by its values.",
        metavar="SCENE",
    ),
]
Profiles = Annotated[
    list[str],
    typer.Option(
        "--profile",
        help="Class of devices for all scans that have none in the table; can be given several times.",
        metavar="PROFILE",
        autocompletion=complete_profiles,
    ),
]
RuleFile = Annotated[
    Path | None,
    typer.Option(
        "--rules",
        help="Rule file, TOML: which scans of a folder tree get which scene. The batch does not start if a scan "
        "matches no rule, or several.",
        metavar="FILE",
    ),
]
To = Annotated[
    str | None,
    typer.Option(
        "--to",
        help="Store packages as NAME.volpkg.zip below this address (s3://...) instead of in FOLDER, which keeps "
        "ledger, previews and pages.",
        metavar="URL",
    ),
]
Validate = Annotated[bool, typer.Option("--validate", help="Validate each package, and write its report.")]
Workers = Annotated[
    int | None,
    typer.Option(min=1, help="Number of processes on this machine; if not given, one for each core.", metavar="N"),
]
Scheduler = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler, whose workers are used.", metavar="tcp://HOST:PORT")
]
Shard = Annotated[
    str | None,
    typer.Option(
        help="Run only part I of N, for job arrays. The parts may run at the same time. Without --workers, one "
        "scan is built at a time.",
        metavar="I/N",
    ),
]
RequireMask = Annotated[
    bool, typer.Option("--require-mask", help="Refuse the batch if a scan has no mask: heads can be recognised.")
]
DryRun = Annotated[
    bool, typer.Option("--dry-run", help="Only list the jobs, with estimates of time and size. The list shows paths.")
]
Digests = Annotated[
    bool, typer.Option("--check-digests", help="Read existing packages again, and compare every digest.")
]
Retry = Annotated[bool, typer.Option("--retry-failed", help="Try scans again that failed before.")]
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


@takes_choices
def batch(
    jobs: Jobs = None,
    *,
    output: Folder,
    scene: Scene = None,
    profile: Profiles = [],  # noqa: B006 - typer asks for a list, and nothing changes it
    explain: Explain = None,
    names: Names = None,
    rules: RuleFile = None,
    to: To = None,
    validate: Validate = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    shard: Shard = None,
    require_mask: RequireMask = False,
    dry_run: DryRun = False,
    retry_failed: Retry = False,
    check_digests: Digests = False,
    time_limit: TimeLimit = 3600.0,
    memory_limit: MemoryLimit = None,
    as_json: Lines = False,
    choices: Choices,
) -> None:
    """Build packages of many scans, and keep a ledger with the result of each.

    A second run skips finished scans that have not changed. A scan that fails does not stop the others. The exit status
    is the highest of all jobs: 0 all done, 1 a picture beyond its tolerance, 3 a scan that cannot be read, and so on.
    """
    if explain is not None:
        _explain(explain, output)
        return
    if jobs is None:
        msg = "Missing argument 'JOBS'."
        raise typer.BadParameter(msg)
    if scheduler is not None and workers is not None:
        msg = "--workers are processes of this machine, and --scheduler has workers of its own: give one of them"
        raise typer.BadParameter(msg)
    if rules is not None and (jobs.lower().endswith((".csv", ".jsonl", ".ndjson")) or "://" in jobs):
        msg = "--rules read headers, so JOBS must be a folder tree; a table has a column for scenes"
        raise typer.BadParameter(msg)
    part = _part(shard)
    from volprep_formats.installation import require_extra

    require_extra("batch")
    if validate:
        require_extra("validate")
    from volprep.batch.jobs import Defaults, in_shard
    from volprep.batch.place import Place
    from volprep.batch.run import Wishes, find_jobs, run_batch

    place = Place(output.absolute())
    defaults = Defaults(scene, tuple(profile), choices.of, names, require_mask)
    if dry_run:
        from volprep_cli.batch_dry_run import print_dry_run

        print_dry_run(jobs, place, defaults, rules, part, workers=workers)
        return
    others: list[OtherFiles] = []
    with progress() as finding:
        found = find_jobs(jobs, place, defaults, finding, rules, others=others.append)
    if part is not None:
        found = [job for job in found if in_shard(job.name, *part)]
    from volprep_cli.batch_watch import watching

    with watching(as_json=as_json) as watcher:
        engine, count = _engine(workers, scheduler, watcher.dashboard, alone=part is not None)
        wishes = Wishes(validate, retry_failed, _limits(time_limit, memory_limit, count), to, check_digests)
        status = run_batch(found, place, wishes, engine, watcher)
    watcher.finish(place.folder / "index.html", status, others)
    if status is not ExitStatus.OK:
        raise typer.Exit(status)


def _explain(name: str, output: Path) -> None:
    from volprep.batch.explain import explain as explained
    from volprep.batch.place import Place

    for line in explained(name, Place(output.absolute())):
        print_line(line)


def _part(shard: str | None) -> tuple[int, int] | None:
    if shard is None:
        return None
    numbers = re.fullmatch(r"([1-9]\d{0,8})/([1-9]\d{0,8})", shard)
    if numbers is None or int(numbers[1]) > int(numbers[2]):
        msg = f"--shard is {shard}, and must be I/N with I from 1 to N, such as 3/20"
        raise typer.BadParameter(msg)
    return int(numbers[1]), int(numbers[2])


def _engine(
    workers: int | None, scheduler: str | None, dashboard: Callable[[str], None], *, alone: bool
) -> "tuple[Engine, int | None]":
    """Return the engine, and how many processes share this machine; None if they are elsewhere."""
    if alone and workers is None and scheduler is None:
        from volprep.batch.serial_engine import Alone

        return Alone(), 1
    from volprep.batch.cluster import Local, Remote

    if scheduler is not None:
        return Remote(scheduler, dashboard), None
    from volprep_formats.isolation import available_cores

    count = workers or available_cores()
    return Local(count, dashboard), count


def _limits(seconds: float, memory_mb: int | None, count: int | None) -> "Limits":
    from volprep.batch.guard import Limits, machine_memory_bytes

    if memory_mb is not None:
        return Limits(seconds, memory_mb * 10**6)
    return Limits(seconds, None if count is None else machine_memory_bytes() // count)
