"""Measurements that pages send back, each stored as one file of a folder."""

import hashlib
import re
from pathlib import Path

from volprep.plan.device_files import ENDING, device_record
from volprep.plan.device_records import DeviceRecord
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors, write_file

_MOST_FILES = 1000
"""Largest number of files in the folder: anyone with the address could otherwise fill the disk."""


def store_device(folder: Path, data: bytes, manifest_sha256: str) -> tuple[Path, DeviceRecord]:
    """Check a device's measurement, and store it under a name that follows from it: the same one twice is one file.

    Raises VP7036 if it is not a measurement, VP7037 for one of another package, VP7040 for a folder that is full,
    VP4020 if it cannot be written.
    """
    record = device_record(data, "what the page sent")
    if record.package.manifest_sha256 != manifest_sha256:
        found, expected = record.package.manifest_sha256[:12], manifest_sha256[:12]
        fields = {"name": record.package.name, "found": f"manifest {found}", "expected": f"manifest {expected}"}
        raise VolprepError("VP7037", path="what the page sent", **fields)
    # The checked record is stored, not the received bytes.
    text = (record.model_dump_json(indent=2) + "\n").encode()
    gpu = re.sub(r"[^a-z0-9]+", "-", record.device.gpu.lower()).strip("-")[:40] or "device"
    path = folder / f"{gpu}-{hashlib.sha256(text).hexdigest()[:10]}{ENDING}"
    with output_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        count = sum(1 for path in folder.iterdir() if path.name.endswith(ENDING))
    if count >= _MOST_FILES:
        raise VolprepError("VP7040", path=folder, count=count)
    write_file(path, text)
    return path, record
