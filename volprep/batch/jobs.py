"""A job: one scan, its scene, a class of devices, and a name that says nothing of a person."""

import hashlib
import hmac
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from string import Formatter

from volprep.batch.facts import Facts
from volprep.scene.channels import files_of
from volprep.scene.request import Request, load_request, request_for_source
from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import path_text
from volprep_formats.readers.dicom.naming import series_name
from volprep_formats.shown import without_secrets

_Loader = Callable[[Path, str | None], Request]
_FOLDER = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_SHORT_HASH = 8
_DIGITS = 16
"""Length of a name: two of 10⁶ scans have the same name with a probability of 3·10⁻⁸."""


@dataclass(frozen=True)
class FoundScan:
    """A scan that a folder tree or a line of a table names."""

    where: str
    """For messages: the line of a table, or the path in a tree."""
    source: Path | None
    """File or folder, absolute; None if the scene or `url` names it."""
    files: tuple[Path, ...] = ()
    """Files of a DICOM series; empty if only `source` is read."""
    series: str | None = None
    """DICOM: SeriesInstanceUID, or an ending of it. OME: name of the image."""
    volume: int | None = None
    """Number of the volume, from 1."""
    mask: Path | None = None
    """Mask of the scan; None takes that of the scene, if it has one."""
    scene: Path | None = None
    """Scene file; None takes that of the batch."""
    profiles: tuple[str, ...] = ()
    """Classes of devices; the batch's if empty."""
    name: str | None = None
    """Name that the user gave."""
    identity: str = ""
    """Text that identifies this scan among all others: a name is made from it."""
    facts: Facts | None = None
    """Facts from its headers, if they were requested."""
    rule: str = ""
    """Name of the rule that it matches."""
    url: str | None = None
    """Address of objects in a store, fetched before they are read."""


@dataclass(frozen=True)
class Defaults:
    """Defaults for a scan whose table line does not set them."""

    scene: Path | None = None
    """Scene file; None draws a scan as its values suggest."""
    profiles: tuple[str, ...] = ()
    """Classes of devices; none takes that of the scene."""
    chosen: Callable[[Request], Request] = lambda request: request
    """Applies the command line's choices of sources and transfer functions to a request."""
    names: str | None = None
    """Pattern of names of DICOM series, over the fields of `_named`; None names scans by a hash."""
    needs_mask: bool = False
    """Whether a scan without a mask is refused."""


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
    rule: str = ""
    """Name of the rule that chose the scene."""
    voxels: int | None = None
    """Number of voxels, where the headers have been read."""
    url: str | None = None
    """Address of the scan in a store, if it is in one."""

    @property
    def shown_source(self) -> str:
        """Location of the scan, for the screen only: a path may name a patient."""
        if self.url is not None:
            return without_secrets(self.url)
        spec = self.request.scene.source
        return spec.path or ", ".join(path_text(path) for path in self.files)

    @property
    def scene_sha256(self) -> str:
        """Digest of scene and profile, without the place of the source."""
        scene, profile = self.request.scene, self.request.profile
        plain = scene.with_source(scene.source.without_place())
        wishes = {"scene": plain.model_dump(mode="json"), "profile": profile.model_dump(mode="json")}
        return hashlib.sha256(json.dumps(wishes, sort_keys=True).encode()).hexdigest()


def expand(found: Sequence[FoundScan], jobs_path: Path | str, key: bytes, defaults: Defaults) -> list[Job]:
    """Make the jobs of all scans: one for each of its profiles.

    Raises VP8005 for two jobs of one name, VP8007 for a profile that cannot be the name of a folder, and the errors of
    `load_request`.
    """
    loaded = cache(load_request)
    jobs: dict[tuple[str, str], tuple[Job, str]] = {}
    for scan in found:
        for profile in scan.profiles or defaults.profiles or (None,):
            job = _job(scan, profile, loaded, key, defaults)
            if defaults.needs_mask and not _is_masked(job.request):
                raise VolprepError("VP8008", path=jobs_path, where=scan.where)
            if _FOLDER.fullmatch(job.profile) is None:
                raise VolprepError("VP8007", path=jobs_path, profile=job.profile)
            first = jobs.setdefault((job.name, job.profile), (job, scan.where))
            if first[0] is not job:
                fields = {"first": first[1], "second": scan.where, "name": job.name, "profile": job.profile}
                raise VolprepError("VP8005", path=jobs_path, **fields)
    return [job for job, _ in jobs.values()]


def name_of(identity: str, key: bytes) -> str:
    """Return a name made of a secret and the identity of a scan: the same in each run, and not reversible."""
    return f"scan-{hmac.new(key, identity.encode('utf-8', 'surrogateescape'), hashlib.sha256).hexdigest()[:_DIGITS]}"


def _named(scan: FoundScan, pattern: str | None, hashed: str) -> str:
    """Return the name of a scan by a pattern, with a part of its hash, so that it is stable and unique.

    Raises VP8061 for a pattern with unknown fields.
    """
    if pattern is None or scan.series is None:
        return hashed
    told = series_name(scan.files[0])
    fields = {
        "series_number": "x" if told.number is None else str(told.number),
        "kernel": told.kernel or "x",
        "echo": "x" if told.echo_ms is None else f"{told.echo_ms:g}",
        "hash": hashed.removeprefix("scan-"),
    }
    unknown = [field for _, field, _, _ in Formatter().parse(pattern) if field is not None and field not in fields]
    if unknown:
        raise VolprepError("VP8061", pattern=pattern, field=unknown[0], fields=", ".join(fields))
    made = pattern.format(**fields) + ("" if "{hash}" in pattern else f"-{fields['hash'][:_SHORT_HASH]}")
    return re.sub(r"[^a-z0-9_-]+", "-", made.lower()).strip("-_") or hashed


def in_shard(name: str, number: int, count: int) -> bool:
    """Whether a name belongs to part `number`, from 1, of `count` parts; other names change nothing."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8]) % count == number - 1


def _is_masked(request: Request) -> bool:
    spec = request.scene.source
    each = spec.channels if isinstance(spec.channels, tuple) and spec.channels else (spec,)
    return all(channel.mask is not None for channel in each)


def _job(scan: FoundScan, profile: str | None, loaded: _Loader, key: bytes, defaults: Defaults) -> Job:
    scene = scan.scene or defaults.scene
    mask = None if scan.mask is None else path_text(scan.mask)
    told: dict[str, object] = {"series": scan.series, "volume": scan.volume, "mask": mask}
    choices = {name: value for name, value in told.items() if value is not None}
    if scene is not None:
        request = loaded(scene, profile)
        if scan.source is not None:
            choices["path"] = path_text(scan.source)
    else:
        assert scan.source is not None or scan.url is not None  # noqa: S101 - a table is refused where none is given
        request = request_for_source(scan.source or Path("/"), profile)
    if scan.url is not None:
        choices["path"] = scan.url
    request = defaults.chosen(request)
    if choices:
        request = request.with_source(**choices)
    name = scan.name or _named(scan, defaults.names, name_of(scan.identity, key))
    request = replace(request, scene=request.scene.model_copy(update={"name": name}))
    spec = request.scene.source
    place = spec.mask_place(Path())
    files = scan.files if scan.files or scan.url is not None else files_of(spec)
    if place is not None and place not in files:
        files = (*files, place)
    voxels = None if scan.facts is None else scan.facts.voxels
    return Job(name, request.profile.name, request, files, scan.rule, voxels, scan.url)
