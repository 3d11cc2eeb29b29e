"""volprep batch --dry-run: list the jobs, the rule that each scan matches, and the estimated costs."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from volprep_cli.batch_watch import no_scans_json
from volprep_cli.console import bytes_text, end_beyond, print_json, print_line, print_table, progress, wants_json
from volprep_formats.diagnostics import VolprepError

if TYPE_CHECKING:
    from volprep.batch.estimate import Estimate
    from volprep.batch.jobs import Defaults, Job
    from volprep.batch.other_files import OtherFiles
    from volprep.batch.place import Place
    from volprep.batch.rules import Matched


@dataclass(frozen=True)
class _Row:
    """A job, or a scan without one."""

    job: "Job | None"
    estimate: "Estimate | None"
    rule: str
    source: str


def print_dry_run(
    jobs: str,
    place: "Place",
    defaults: "Defaults",
    rules: Path | None,
    part: tuple[int, int] | None,
    *,
    workers: int | None,
) -> None:
    """Print a table of all jobs. Raises what `find_jobs` raises, for a scan that matches no rule after the table."""
    from volprep.batch.estimate import estimate, rates_of
    from volprep.batch.jobs import expand, in_shard
    from volprep.batch.ledger import Ledger
    from volprep.batch.rules import read_rules, require_one_each
    from volprep.batch.run import find_scans
    from volprep_formats.isolation import available_cores

    read = None if rules is None else read_rules(rules)
    others: list[OtherFiles] = []
    with progress() as finding:
        has_scene = defaults.scene is not None
        matched = find_scans(jobs, finding, has_scene=has_scene, rules=read, facts=True, others=others.append)
    taken = [scan.scan for scan in matched if len(scan.rules) == 1 and not scan.skip]
    place.prepare()
    found = [job for job in expand(taken, jobs, place.key(), defaults) if part is None or in_shard(job.name, *part)]
    rates = rates_of(Ledger(place).records().values())
    rows = [_Row(job, estimate(job, rates), job.rule, _source(job)) for job in found]
    rows += [_left_out(scan) for scan in matched if len(scan.rules) != 1 or scan.skip]
    measured = sum(rate.measured for rate in rates.values())
    if wants_json():
        print_json({"jobs": [_as_json(row) for row in rows], "measured_packages": measured, **no_scans_json(others)})
    else:
        _print(rows, measured, workers or available_cores(), has_rules=rules is not None)
        for value in others:
            print_line(str(value))
    try:
        require_one_each(matched, rules or Path(jobs))
    except VolprepError as error:
        end_beyond(error)


def _source(job: "Job") -> str:
    """Return where a scan is, and which series of a folder is meant."""
    from volprep_formats.readers.dicom.naming import series_name

    if job.request.scene.source.series is None or not job.files:
        return job.shown_source
    name = series_name(job.files[0])
    number = "series without a number" if name.number is None else f"series {name.number}"
    files = f"{len(job.files)} file{'s' if len(job.files) > 1 else ''}"
    told = ", ".join(part for part in (number, name.kernel, files) if part)
    return f"{job.shown_source} ({told})"


def _left_out(matched: "Matched") -> _Row:
    return _Row(None, None, matched.said, matched.scan.where)


def _as_json(row: _Row) -> dict[str, object]:
    return {
        "name": row.job and row.job.name,
        "profile": row.job and row.job.profile,
        "rule": row.rule or None,
        "source": row.source,
        "seconds": row.estimate and round(row.estimate.seconds, 2),
        "size_bytes": row.estimate and round(row.estimate.size_bytes),
    }


def _print(rows: list[_Row], measured: int, workers: int, *, has_rules: bool) -> None:
    cells = [_cells(row) for row in rows]
    headings = ("name", "profile", "rule", "time", "size", "source")
    kept = [number for number, heading in enumerate(headings) if has_rules or heading != "rule"]
    print_table([headings[k] for k in kept], [[cell[k] for k in kept] for cell in cells])
    known = [row.estimate for row in rows if row.estimate is not None]
    unknown = sum(row.job is not None and row.estimate is None for row in rows)
    seconds, size = sum(estimate.seconds for estimate in known), round(sum(estimate.size_bytes for estimate in known))
    print_line(f"{sum(row.job is not None for row in rows)} packages; nothing was built")
    basis = f"as {measured} packages in the ledger took" if measured else "as common builds take"
    if unknown:
        basis += f"; {unknown} scans cannot be estimated"
    together = f"{seconds:.0f} s of one process, {seconds / workers:.0f} s with {workers}"
    print_line(f"about {together}, {bytes_text(size)}: {basis}")


def _cells(row: _Row) -> tuple[str, ...]:
    name, profile = ("-", "-") if row.job is None else (row.job.name, row.job.profile)
    time, size = (
        ("?", "?")
        if row.estimate is None
        else (f"{row.estimate.seconds:.1f} s", bytes_text(round(row.estimate.size_bytes)))
    )
    return name, profile, row.rule, time, size, row.source
