"""index.json and index.html: all jobs of a batch with preview, size and time, and failures by their code."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from volprep.batch.place import Place
from volprep.batch.records import JobError, JobRecord
from volprep.report.environment import environment
from volprep_formats.output import write_file


@dataclass(frozen=True)
class Failure:
    """All jobs that failed with one code."""

    error: JobError
    """That of the first of them."""
    records: tuple[JobRecord, ...]


def write_pages(place: Place, records: Mapping[tuple[str, str], JobRecord]) -> None:
    """Write both pages of a ledger. Raises VP4020 if they cannot be written."""
    ordered = [records[key] for key in sorted(records)]
    index = {"jobs": [record.model_dump(mode="json") for record in ordered], "summary": summary(ordered)}
    write_file(place.folder / "index.json", (json.dumps(index, indent=1, sort_keys=True) + "\n").encode())
    write_file(place.folder / "index.html", page(ordered).encode())


def summary(records: Iterable[JobRecord]) -> dict[str, int]:
    """Count jobs by outcome; "beyond" counts every verdict but "within"."""
    found = Counter(result_of(record) for record in records)
    counts = {result: found.pop(result, 0) for result in ("built", "within", "failed")}
    return {**counts, "beyond": found.total()}


def result_of(record: JobRecord) -> str:
    """Describe the outcome of a job in one word."""
    return "failed" if record.outcome == "failed" else record.verdict or "built"


def page(records: list[JobRecord]) -> str:
    """Return the page of all jobs as HTML; pictures and reports lie below it, under the paths in the records."""
    template = environment(0.0).get_template("batch.html.j2")
    shown = [record for record in records if record.outcome == "built"]
    return template.render(
        shown=shown,
        profiles=sorted({record.profile for record in shown}),
        results=sorted({result_of(record) for record in shown}),
        failures=_failures(records),
        summary=summary(records),
        total=len(records),
        size_bytes=sum(record.size_bytes for record in shown),
        seconds=sum(record.seconds for record in records),
    )


def _failures(records: list[JobRecord]) -> list[Failure]:
    """Group failed jobs by the code of their error, the most frequent first."""
    found: dict[str, list[JobRecord]] = {}
    for record in records:
        if record.outcome == "failed":
            found.setdefault(record.errors[0].code, []).append(record)
    groups = [Failure(some[0].errors[0], tuple(some)) for some in found.values()]
    return sorted(groups, key=lambda group: (-len(group.records), group.error.code))
