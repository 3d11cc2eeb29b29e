"""Files that devices sent back: parsed as untrusted input and checked against the package."""

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
    """Return the measurement of a device. Raises VP7036 for anything else, which `name` names."""
    try:
        return DeviceRecord.model_validate_json(data)
    except ValidationError as error:
        raise VolprepError("VP7036", path=name, problem=problems(error)) from error


def read_device(path: Path) -> DeviceRecord:
    """Read the file of a device. Raises VP7036 for a file that cannot be read, or is not a measurement."""
    try:
        data = read_regular(path, MOST_BYTES)
    except OSError as error:
        raise VolprepError("VP7036", path=path, problem=error.strerror or error) from error
    return device_record(data, path)


def read_devices(folder: Path, manifest_sha256: str) -> tuple[DeviceRecord, ...]:
    """Read all files of devices in `folder`, in order of name.

    Raises VP7036 for a folder that cannot be read and for a file that is not a measurement, VP7037 for one of another
    package.
    """
    records = _all_in(folder)
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


def read_devices_of_scan(folder: Path, sources: Mapping[str, str]) -> tuple[tuple[DeviceRecord, ...], int]:
    """Read the measurements in `folder` of packages of the scans `sources`, digests by channel, for any profile.

    Also return the number of measurements of other scans. Raises VP7036 as `read_devices` does, VP7045 if none is of
    the scan.
    """
    records = [record for _, record in _all_in(folder)]
    of_scan = tuple(record for record in records if _digests(record) == dict(sources))
    if not of_scan:
        scans = ", ".join(f"{channel} {sha256[:12]}" for channel, sha256 in sorted(sources.items()))
        raise VolprepError("VP7045", path=folder, count=len(records), scans=scans)
    return of_scan, len(records) - len(of_scan)


def _all_in(folder: Path) -> list[tuple[Path, DeviceRecord]]:
    try:
        paths = sorted(path for path in folder.iterdir() if path.name.endswith(ENDING))
    except OSError as error:
        raise VolprepError("VP7036", path=folder, problem=error.strerror or error) from error
    return [(path, read_device(path)) for path in paths]


def _digests(record: DeviceRecord) -> dict[str, str]:
    return {source.channel: source.sha256 for source in record.package.sources}


def require_same_scan(path: Path, record: DeviceRecord, profile: str, sources: Mapping[str, str]) -> None:
    """Raise VP7037 unless a package of the scans `sources`, digests by channel, for `profile` was measured."""
    found = _told(record.package.profile, _digests(record))
    expected = _told(profile, sources)
    if found != expected:
        raise VolprepError("VP7037", path=path, name=record.package.name, found=found, expected=expected)


def _told(profile: str, sources: Mapping[str, str]) -> str:
    scans = ", ".join(f"{channel} {sha256[:12]}" for channel, sha256 in sorted(sources.items()))
    return f"profile {profile}, scan {scans}"
