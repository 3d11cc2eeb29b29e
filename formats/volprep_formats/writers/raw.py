"""Raw voxels (.raw), with a sidecar NAME.raw.toml whose table [source.raw] can be pasted into a scene."""

from pathlib import Path

from volprep_formats.output import new_file, write_file
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource
from volprep_formats.writers.values import PhysicalValues
from volprep_formats.writers.voxels import write_voxels


def sidecar_path(path: Path) -> Path:
    """Return the path of the sidecar of `path`."""
    return path.with_name(f"{path.name}.toml")


def write(source: VolumeSource, path: Path, progress: Progress) -> None:
    """Write the physical values of `source`, and the facts that the file itself lacks. Raises VP4020."""
    values = PhysicalValues(source)
    with new_file(path) as file:
        write_voxels(values, file, progress)
    write_file(sidecar_path(path), _sidecar(values.info).encode())


def _sidecar(info: SourceInfo) -> str:
    shape = ", ".join(map(str, info.grid.shape_zyx))
    spacing = ", ".join(repr(h) for h in info.grid.spacing_mm_zyx)
    lines = [
        "[source.raw]",
        f"shape_zyx = [{shape}]",
        f'dtype = "{info.stored_type}"',
        f"spacing_mm_zyx = [{spacing}]",
        'byte_order = "little"',
        "# A scene cannot say more about a raw file. The volume also has:",
        f"# origin_mm_xyz = {list(info.grid.origin_mm_xyz)}",
        f"# direction = {[list(row) for row in info.grid.direction]}",
        f"# slope = {info.slope!r}, intercept = {info.intercept!r}",
    ]
    return "\n".join(lines) + "\n"
