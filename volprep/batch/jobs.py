"""A job: one scan, its scene, a class of devices, and a name that says nothing of a person."""

import hashlib
import hmac
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from volprep.scene.request import Request, load_request, request_for_source
from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import path_text

_Loader = Callable[[Path, str | None], Request]
_FOLDER = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_DIGITS = 16
"""Of a name: two of 10⁶ scans have the same one with a chance of 3·10⁻⁸."""


@dataclass(frozen=True)
class FoundScan:
    """A scan that a folder tree or a line of a table names."""

    where: str
    """For messages: the line of a table, or the path in a tree."""
    source: Path | None
    """File or folder, absolute; None if the scene names it."""
    files: tuple[Path, ...] = ()
    """Files of a DICOM series; empty where `source` is all that is read."""
    series: str | None = None
    """DICOM: SeriesInstanceUID, or an ending of it. OME: name of the image."""
    volume: int | None = None
    """Number of the volume, from 1."""
    scene: Path | None = None
    """Scene file; None takes that of the batch."""
    profiles: tuple[str, ...] = ()
    """Classes of devices; none takes those of the batch."""
    name: str | None = None
    """Name that the user gave."""
    identity: str = ""
    """What makes this scan another one than all others: a name is made from it."""


@dataclass(frozen=True)
class Job:
    """One package to make."""

    name: str
    """Name of the package; also its file's."""
    profile: str
    """Name of the class of devices."""
    request: Request
    """Scene and profile; the scene has the name of the job."""
    files: tuple[Path, ...]
    """Files and folders that are read."""

    @property
    def shown_source(self) -> str:
        """Where the scan is, for the screen only: a path may name a patient."""
        spec = self.request.scene.source
        return spec.path or ", ".join(path_text(path) for path in self.files)

    @property
    def scene_sha256(self) -> str:
        """Digest of scene and profile, without the place of the source."""
        scene, profile = self.request.scene, self.request.profile
        plain = scene.with_source(scene.source.without_place())
        wishes = {"scene": plain.model_dump(mode="json"), "profile": profile.model_dump(mode="json")}
        return hashlib.sha256(json.dumps(wishes, sort_keys=True).encode()).hexdigest()


def expand(
    found: Sequence[FoundScan], jobs_path: Path, key: bytes, scene: Path | None, profiles: Sequence[str]
) -> list[Job]:
    """Make the jobs of all scans: one for each of its profiles.

    `scene` and `profiles` count where a scan has none of its own. Raises VP8005 for two jobs of one name, VP8007 for a
    profile that cannot have a folder of its name, and what `load_request` raises.
    """
    loaded = cache(load_request)
    jobs: dict[tuple[str, str], tuple[Job, str]] = {}
    for scan in found:
        for profile in scan.profiles or tuple(profiles) or (None,):
            job = _job(scan, scan.scene or scene, profile, loaded, key)
            if _FOLDER.fullmatch(job.profile) is None:
                raise VolprepError("VP8007", path=jobs_path, profile=job.profile)
            first = jobs.setdefault((job.name, job.profile), (job, scan.where))
            if first[0] is not job:
                fields = {"first": first[1], "second": scan.where, "name": job.name, "profile": job.profile}
                raise VolprepError("VP8005", path=jobs_path, **fields)
    return [job for job, _ in jobs.values()]


def name_of(identity: str, key: bytes) -> str:
    """Return a name made of a secret and of what makes a scan another one: the same in each run, and no way back."""
    return f"scan-{hmac.new(key, identity.encode('utf-8', 'surrogateescape'), hashlib.sha256).hexdigest()[:_DIGITS]}"


def in_shard(name: str, number: int, count: int) -> bool:
    """Whether a name belongs to part `number`, from 1, of `count` parts; other names change nothing."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8]) % count == number - 1


def _job(scan: FoundScan, scene: Path | None, profile: str | None, loaded: _Loader, key: bytes) -> Job:
    told: dict[str, object] = {"series": scan.series, "volume": scan.volume}
    choices = {name: value for name, value in told.items() if value is not None}
    if scene is not None:
        request = loaded(scene, profile)
        if scan.source is not None:
            choices["path"] = path_text(scan.source)
    else:
        assert scan.source is not None  # noqa: S101 - a table is refused where neither is given
        request = request_for_source(scan.source, profile)
    if choices:
        request = request.with_source(**choices)
    name = scan.name or name_of(scan.identity, key)
    request = replace(request, scene=request.scene.model_copy(update={"name": name}))
    spec = request.scene.source
    several = spec.channels if isinstance(spec.channels, tuple) and spec.channels else (spec,)
    files = scan.files or tuple(each.place(Path()) for each in several)
    return Job(name, request.profile.name, request, files)
