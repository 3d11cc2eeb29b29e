"""Files that devices sent back: read as foreign files are, and held against what they are used for."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import ValidationError

from volprep.plan.device_records import DeviceRecord
from volprep_formats.diagnostics import VolprepError
from volprep_formats.record import problems
from volprep_formats.regular_files import read_regular

MOST_BYTES = 2**18
"""Largest file of a device: 64 transfer functions with nine views and 30 points each take 0.2 MB."""
ENDING = ".device.json"
"""How names of such files end."""


def device_record(data: bytes, name: object) -> DeviceRecord:
    """Return what a device sent. Raises VP7036 for anything else, which `name` names."""
    try:
        return DeviceRecord.model_validate_json(data)
    except ValidationError as error:
        raise VolprepError("VP7036", path=name, problem=problems(error)) from error


def read_device(path: Path) -> DeviceRecord:
    """Read the file of a device. Raises VP7036 for a file that cannot be read, or is none."""
    try:
        data = read_regular(path, MOST_BYTES)
    except OSError as error:
        raise VolprepError("VP7036", path=path, problem=error.strerror or error) from error
    return device_record(data, path)


def read_devices(folder: Path, manifest_sha256: str) -> tuple[DeviceRecord, ...]:
    """Read all files of devices in `folder`, in order of name.

    Raises VP7036 for a folder that cannot be read and for a file that is none, VP7037 for one of another package.
    """
    try:
        paths = sorted(path for path in folder.iterdir() if path.name.endswith(ENDING))
    except OSError as error:
        raise VolprepError("VP7036", path=folder, problem=error.strerror or error) from error
    records = [(path, read_device(path)) for path in paths]
    for path, record in records:
        if record.package.manifest_sha256 != manifest_sha256:
            raise VolprepError(
                "VP7037",
                path=path,
                name=record.package.name,
                found=f"manifest {record.package.manifest_sha256[:12]}",
                expected=f"manifest {manifest_sha256[:12]}",
            )
    return tuple(record for _, record in records)


def require_same_scan(path: Path, record: DeviceRecord, profile: str, sources: Mapping[str, str]) -> None:
    """Raise VP7037 unless a package of the scans `sources`, digests by channel, for `profile` was measured."""
    found = _told(record.package.profile, {each.channel: each.sha256 for each in record.package.sources})
    expected = _told(profile, sources)
    if found != expected:
        raise VolprepError("VP7037", path=path, name=record.package.name, found=found, expected=expected)


def _told(profile: str, sources: Mapping[str, str]) -> str:
    scans = ", ".join(f"{channel} {sha256[:12]}" for channel, sha256 in sorted(sources.items()))
    return f"profile {profile}, scan {scans}"
