"""The record of a job in the ledger. It holds no path and no text of a scan: its name says which scan it is."""

import errno
import os
from numbers import Number
from typing import Annotated, Literal

from pydantic import Field

from volprep.truth.verdict_code import VerdictCode
from volprep_formats.diagnostics import CATALOGUE, ExitStatus, SafeText, VolprepError
from volprep_formats.package.values import Sha256
from volprep_formats.record import Record

_NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_SYSTEM_TEXTS = frozenset(os.strerror(number) for number in errno.errorcode)
"""Error texts of the system, which contain nothing from a scan."""


class JobError(Record):
    """Why a job failed."""

    code: str
    """Permanent code of the message."""
    summary: str
    """Description of the fault, with the numbers. The name of the job replaces every path, and … other text."""
    remedy: str
    """How to fix it."""

    @property
    def status(self) -> ExitStatus:
        """Exit status of the code; a code that this version does not know counts as a defect."""
        return CATALOGUE[self.code].status if self.code in CATALOGUE else ExitStatus.INTERNAL


class JobRecord(Record):
    """Outcome of a job."""

    name: str
    """Name of the job, and of its package."""
    profile: str
    """Class of devices."""
    outcome: Literal["built", "failed"]
    """Whether there is a package."""
    source_stamp: Sha256
    """Changes when a file of the scan does; made with a key of this folder."""
    source_sha256: Sha256 | None = None
    """Digest of the geometry and the stored values of the scan, as in the manifest."""
    scene_sha256: Sha256
    """Digest of scene and profile, without the place of the source."""
    version: str
    """Version of volprep."""
    package: str | None = None
    """Path of the package, from the folder of the ledger."""
    package_sha256: Sha256 | None = None
    """Digest of manifest.json, which names the digests of all other files."""
    stored: str | None = None
    """Path of the package below the address of --to, if it is there and no longer in the folder."""
    stored_mark: Sha256 | None = None
    """Changes when that object does; made with a key of this folder."""
    preview: str | None = None
    """Path of the preview, from the folder of the ledger."""
    shape_zyx: tuple[int, int, int] | None = None
    """Voxels of the finest level."""
    size_bytes: Annotated[int, Field(ge=0)] = 0
    """Size of all files of the package."""
    verdict: VerdictCode | None = None
    """Verdict of its validation, in a word; null if it was not validated."""
    report: str | None = None
    """Path of the report's page, from the folder of the ledger."""
    errors: tuple[JobError, ...] = ()
    """Why it failed."""
    seconds: Annotated[float, Field(ge=0.0)] = 0.0
    """Time that the last attempt took."""
    peak_memory_bytes: Annotated[int, Field(ge=0)] = 0
    """Largest memory of its process during the last attempt, without mapped files."""
    retries: Annotated[int, Field(ge=0)] = 0
    """Attempts before the last one: their processes were killed."""
    ended: str
    """When it ended: date and time, UTC."""

    @property
    def key(self) -> tuple[str, str]:
        """Return the key of a record in the ledger."""
        return self.name, self.profile

    @property
    def status(self) -> ExitStatus:
        """Exit status of this job."""
        if self.errors:
            return max(error.status for error in self.errors)
        return ExitStatus.OK if self.verdict in {None, "within"} else ExitStatus.TOLERANCE


def job_error(error: VolprepError, name: str) -> JobError:
    """Return an error without text from outside, which may be a path or a header that names a patient."""
    fields = {key: _harmless(key, value, name) for key, value in error.fields.items()}
    plain = VolprepError(error.code, **fields)
    return JobError(code=plain.code, summary=plain.summary, remedy=plain.remedy)


def unexpected(error: Exception, name: str) -> JobError:
    """Return the ledger entry of an unexpected exception: its kind, and the system's message."""
    if isinstance(error, OSError) and error.errno is not None:
        code = "VP4020" if error.errno in _NO_ROOM else "VP7003"
        return job_error(VolprepError(code, path=name, error=os.strerror(error.errno)), name)
    found = VolprepError("VP9001", error=type(error).__name__)
    return JobError(code=found.code, summary=found.summary, remedy=found.remedy)


def _harmless(key: str, value: object, name: str) -> object:
    if isinstance(value, Number | SafeText) or str(value) in _SYSTEM_TEXTS:
        return value
    return name if key == "path" else "…"
