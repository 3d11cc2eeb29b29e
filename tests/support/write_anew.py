"""Writing one file again and again, each time with other damage."""

from pathlib import Path


def write_anew(file: Path, data: bytes) -> None:
    """Write a file that may be there already, as a new one: writing over it waits for the disk, 2 ms each time."""
    file.unlink(missing_ok=True)
    file.write_bytes(data)
