"""The work on one job, in any process: build, validate, and write the record to the ledger.

Only the owner of the job's lock works on it, and releases it when the record is on the disk: two batches never build
one scan twice, and a process that crashes leaves either no record or a whole one.
"""

import hashlib
import shutil
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path

from volprep.batch.attempts import Attempts, End, job_locked
from volprep.batch.guard import Limits, guarded
from volprep.batch.jobs import Job
from volprep.batch.ledger import Ledger
from volprep.batch.place import Place
from volprep.batch.records import JobRecord, job_error, unexpected
from volprep.batch.stamp import stamp_of
from volprep.batch.storage import fetch, mark_of, store
from volprep.pipeline.build import build
from volprep.pipeline.origin import read_origin, write_origin
from volprep.scene.request import Request
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors, write_file
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.manifest_json import read_manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.storage.publish import remove_package
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.path_text import path_text
from volprep_formats.progress import Silent
from volprep_formats.shown import without_secrets

ATTEMPTS = 2
"""A scan whose process died is tried once more."""


@dataclass(frozen=True)
class Task:
    """A job of a batch."""

    job: Job
    place: Place
    run: str
    """Number of the batch."""
    validate: bool
    """Whether packages are validated."""
    retry_failed: bool
    """Whether to retry jobs that failed before."""
    seen: str | None
    """When the record ended that was there as the batch began; None if there was none."""
    limits: Limits
    to: str | None = None
    """Address below which packages are stored; None leaves them in the folder."""
    digests: bool = False
    """Whether to compare the digest of each file of a package that is there."""


@dataclass(frozen=True)
class TaskResult:
    """Result of a task."""

    task: Task
    record: JobRecord | None
    """The record; none if another batch works on this job now."""
    is_new: bool
    """Whether this batch made the record."""


@dataclass(frozen=True)
class TaskError:
    """Reason why the batch cannot continue: an error in a form that can be sent between processes."""

    code: str
    fields: dict[str, object]


def answer(task: Task) -> TaskResult | TaskError:
    """Do a job as `work` does, for an engine in another process."""
    try:
        return work(task)
    except VolprepError as error:
        return TaskError(error.code, error.fields)


def understood(given: object) -> TaskResult:
    """Return the result in an answer. Raises the error in it."""
    if isinstance(given, TaskError):
        raise VolprepError(given.code, **given.fields)
    assert isinstance(given, TaskResult)  # noqa: S101 - `answer` gives nothing else
    return given


def work(task: Task) -> TaskResult:
    """Do a job, if it is not done, and return its record. Faults of the scan are in the record.

    Raises VP8011 if the folder of the batch cannot be reached, VP4020 for a ledger that cannot be used.
    """
    if not task.place.is_there:
        raise VolprepError("VP8011", path=task.place.folder)
    return _recorded(task, is_given_up=False)


def give_up(task: Task) -> TaskResult:
    """Record that this job kills every process, unless it is done."""
    return _recorded(task, is_given_up=True)


def _recorded(task: Task, *, is_given_up: bool) -> TaskResult:
    job, place = task.job, task.place
    with output_errors(place.folder), job_locked(place.job_lock(job.name, job.profile), task.run) as attempts:
        if attempts is None:
            return TaskResult(task, None, is_new=False)
        ledger = Ledger(place)
        record = ledger.last(job.name, job.profile)
        is_new = record is None or not is_done(record, task)
        if is_new:
            deaths = attempts.deaths()
            if is_given_up or len(deaths) >= ATTEMPTS:
                record = _record_of_deaths(task, deaths or ["killed"] * ATTEMPTS)
            else:
                attempts.begin()
                record = _attempt(task, attempts, len(deaths), record)
            shutil.rmtree(place.fetched(job.name, job.profile), ignore_errors=True)
            ledger.append(record)
        attempts.forget()
        return TaskResult(task, record, is_new=is_new)


def is_done(record: JobRecord, task: Task) -> bool:
    """Whether the record of a job is still valid for this task."""
    if not _is_of_same_work(record, task):
        return False
    if record.outcome == "failed":
        # Another batch may have tried it again while this one ran.
        return not task.retry_failed or record.ended != task.seen
    return _has_package(record, task) and (not task.validate or _has_report(record, task))


def _is_of_same_work(record: JobRecord, task: Task) -> bool:
    return (
        record.version == _version()
        and record.scene_sha256 == task.job.scene_sha256
        and record.source_stamp == stamp_of(task.job, task.place.key())
    )


def _has_package(record: JobRecord, task: Task) -> bool:
    if task.to is not None and record.stored is not None:
        return record.stored_mark == mark_of(f"{task.to.rstrip('/')}/{record.stored}", task.place.key())
    return task.to is None and _has_folder(record, task)


def _has_folder(record: JobRecord, task: Task) -> bool:
    """Return whether the package is there, with its manifest and with files of their sizes; on request, digests."""
    package = task.place.package(record.name, record.profile)
    try:
        if hashlib.sha256((package / MANIFEST).read_bytes()).hexdigest() != record.package_sha256:
            return False
        opened = Package.open(package)
        if task.digests:
            for file in opened.manifest.files:
                opened.read_start(file.path, 0)
    except (OSError, VolprepError):
        return False
    return True


def _has_report(record: JobRecord, task: Task) -> bool:
    return record.report is not None and (task.place.folder / record.report).is_file()


def _attempt(task: Task, attempts: Attempts, retries: int, last: JobRecord | None) -> JobRecord:
    began = time.monotonic()
    record = _blank(task).model_copy(update={"retries": retries})
    with guarded(task.limits, attempts.note) as peak:
        try:
            record = _made(task, record, last)
        except VolprepError as error:
            record = record.model_copy(update={"outcome": "failed", "errors": (job_error(error, task.job.name),)})
        except Exception as error:  # noqa: BLE001 - the others go on, and this one is in the ledger
            record = record.model_copy(update={"outcome": "failed", "errors": (unexpected(error, task.job.name),)})
        peak.look()
    taken = {"seconds": round(time.monotonic() - began, 3), "peak_memory_bytes": peak.bytes, "ended": _now()}
    return record.model_copy(update=taken)


def _made(task: Task, record: JobRecord, last: JobRecord | None) -> JobRecord:
    """Build the package, unless only its report is missing, validate it and store it, if that is wished."""
    package = task.place.package(task.job.name, task.job.profile)
    if last is not None and _is_of_same_work(last, task) and last.outcome == "built" and _has_folder(last, task):
        manifest = read_manifest(package)
    else:
        manifest = build(_at_hand(task), package, Silent())
        if stamp_of(task.job, task.place.key()) != record.source_stamp:
            remove_package(package)
            raise VolprepError("VP8023", path=package)
    record = record.model_copy(update=_facts(package, manifest, task.place))
    if task.validate:
        record = record.model_copy(update=_proved(package, task.place))
    if task.job.url is not None:
        _name_address(package, task.job.url)
    return record if task.to is None else record.model_copy(update=_stored(package, manifest, task, task.to))


def _at_hand(task: Task) -> Request:
    """Return the request of a job with its scan on this machine: a scan in a store is fetched."""
    job = task.job
    if job.url is None:
        return job.request
    return job.request.with_source(path=path_text(fetch(job.url, task.place.fetched(job.name, job.profile))))


def _name_address(package: Path, url: str) -> None:
    """Set the scan's address in a package's origin, without secrets, in place of its temporary path."""
    origin = read_origin(package)
    if origin is not None:
        source = origin.scene.source.model_copy(update={"path": without_secrets(url)})
        write_origin(package, origin.model_copy(update={"scene": origin.scene.with_source(source)}))


def _stored(package: Path, manifest: Manifest, task: Task, to: str) -> dict[str, object]:
    """Store a package as one object, and remove its folder; its preview stays for the page."""
    inside = f"{task.job.profile}/{task.job.name}.volpkg.zip"
    url = f"{to.rstrip('/')}/{inside}"
    packed = task.place.fetched(task.job.name, task.job.profile) / package.with_suffix(".volpkg.zip").name
    packed.parent.mkdir(mode=0o700, exist_ok=True)
    with packed.open("wb") as file:
        write_single_file(package, [*(record.path for record in manifest.files), MANIFEST], file, Silent())
    store(packed, url)
    found: dict[str, object] = {"package": None, "stored": inside, "stored_mark": mark_of(url, task.place.key())}
    if manifest.preview is not None:
        preview = package.with_suffix(Path(manifest.preview).suffix)
        write_file(preview, (package / manifest.preview).read_bytes())
        found["preview"] = preview.relative_to(task.place.folder).as_posix()
    remove_package(package)
    return found


def _facts(package: Path, manifest: Manifest, place: Place) -> dict[str, object]:
    inside = package.relative_to(place.folder).as_posix()
    return {
        "outcome": "built",
        "source_sha256": manifest.source.sha256,
        "package": inside,
        "package_sha256": hashlib.sha256((package / MANIFEST).read_bytes()).hexdigest(),
        "preview": None if manifest.preview is None else f"{inside}/{manifest.preview}",
        "shape_zyx": manifest.levels[0].grid.shape_zyx,
        "size_bytes": sum(file.size_bytes for file in manifest.files),
    }


def _proved(package: Path, place: Place) -> dict[str, object]:
    from volprep.report.validate import validate  # noqa: PLC0415 - loads plots and OpenGL
    from volprep.validation.folder import default_report_path  # noqa: PLC0415 - as above

    folder = default_report_path(package)
    report = validate(package, folder, Silent())
    page = (place.folder.resolve() / folder / "index.html").relative_to(place.folder.resolve())
    return {"verdict": report.verdict.code, "report": page.as_posix()}


def _record_of_deaths(task: Task, deaths: list[End]) -> JobRecord:
    name, times = task.job.name, len(deaths)
    if deaths[-1] == "time":
        error = VolprepError("VP8021", path=name, limit_s=task.limits.seconds, times=times)
    elif deaths[-1] == "memory":
        limit_mb = (task.limits.memory_bytes or 0) / 1e6
        error = VolprepError("VP8022", path=name, limit_mb=limit_mb, times=times)
    else:
        error = VolprepError("VP8020", path=name, times=times)
    return _blank(task).model_copy(update={"errors": (job_error(error, name),), "retries": times - 1})


def _blank(task: Task) -> JobRecord:
    return JobRecord(
        name=task.job.name,
        profile=task.job.profile,
        outcome="failed",
        source_stamp=stamp_of(task.job, task.place.key()),
        scene_sha256=task.job.scene_sha256,
        version=_version(),
        ended=_now(),
    )


@cache
def _version() -> str:
    return version("volprep")


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="microseconds")
