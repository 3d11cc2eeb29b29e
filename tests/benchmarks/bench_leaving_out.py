"""What leaving out saves on real scans: the package as planned against the package with everything, unlit, `gles3`.

Everything: the border that nobody sees, 16 bits, skip tables and meshes whether they pay or not, ranges of blocks,
normals with the length of the gradient, sub-volumes, early ray termination. Steps, levels and pictures are the same.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from volprep.compositing import COMPOSITINGS
from volprep.lab.ablation.measure import MOST_VOXELS, VariantBench
from volprep.lab.small_scan import write_scan
from volprep.pipeline.build import plan_build
from volprep.scene.request import Request, load_request, request_for_source
from volprep.scene.scene import Scene
from volprep_formats.progress import Silent

from .real_scans import POINT, SCANS, Points, scans_folder

PIXELS = 160
LEAST_BYTES, LEAST_SPEED = 2.0, 1.5
"""What leaving out shall save: bytes of the package, and time of a picture."""

_FIRST_LOOKS = {
    "MR head": "mr_t1_studyforrest/dicoms",
    "MR sagittal": "decubitus_hfp_sag",
    "ch2 head": "nifti_ch2/ch2.nii.gz",
    "FLAIR head": "flair_pair/FLAIR.nrrd",
    "shell": "qim_microct/shell_225x128x128.tif",
    "fly": "qim_microct/fly_150x256x256.tif",
    "engine": "engine_pair/png_stack",
    "smoke": "vdb/smoke.vdb",
}
"""Scans that are drawn with the transfer function that volprep makes of them."""
_OWN_FUNCTIONS: dict[str, dict[str, Points]] = {
    "MR head": {"skin": ((12, 0), (30, 0.05), (80, 0.8)), "vessels": ((110, 0), (140, 2.0))},
    "ch2 head": {"opaque": ((20, 0), (60, 0.5), (120, 1.0))},
    "engine": {"veil": ((45, 0), (90, 0.006), (170, 0.15), (230, 0.5)), "inserts": ((150, 0), (200, 1.0))},
    "CT phantom": {"opaque": ((-500, 0), (0, 0.1), (300, 1.0)), "dense": ((200, 0), (600, 1.0))},
}
"""Scans that are drawn with functions of their own, each a package."""


@dataclass(frozen=True)
class LeftOutRow:
    """One scan with one transfer function."""

    scan: str
    """Scan and transfer function."""
    planned_bytes: int
    """Package as planned."""
    package_ratio: float
    """Bytes of the package with everything, over those of the planned one."""
    upload_ratio: float
    """The same of what an app uploads to draw the finest level."""
    planned_ms: float
    """Time of a picture of the planned package."""
    time_ratio: float
    """Time of a picture of the package with everything, over that of the planned one; median of pairs."""
    time_low: float
    """First quartile of the pairs."""
    time_high: float
    """Third quartile."""
    step_voxels: float
    """Step that the plan has chosen, which both are drawn with, in voxels."""
    usual_step_ratio: float
    """Time of the package with everything, drawn with the step that is usual where none is chosen, half a voxel."""
    planned_rmse: float
    """Worst view of the planned package against the scan."""
    everything_rmse: float
    """Worst view of the package with everything."""
    left_out: tuple[str, ...]
    """What the planned package leaves out."""


def measure_leaving_out(console: Console) -> Iterator[LeftOutRow]:
    """Build and draw both packages of each scan."""
    base = scans_folder()
    with tempfile.TemporaryDirectory() as folder:
        for scan, place in _FIRST_LOOKS.items():
            yield from _row(console, f"{scan}, first look", request_for_source(base / place), Path(folder))
        for scan, functions in _OWN_FUNCTIONS.items():
            for name, points in functions.items():
                request = _request(scan, points, Path(folder) / "scene.toml")
                yield from _row(console, f"{scan}, {name}", request, Path(folder))


def _request(scan: str, points: Points, path: Path) -> Request:
    source = SCANS[scan].format(scans_folder())
    listed = ", ".join(POINT.format(*point) for point in points)
    path.write_text(
        f'name = "s"\n[source]\n{source}\n[[transfer]]\nname = "f"\npoints = [{listed}]\n', encoding="utf-8"
    )
    return load_request(path)


def _row(console: Console, name: str, request: Request, folder: Path) -> list[LeftOutRow]:
    console.print(f"measuring what leaving out saves on {name}", style="dim")
    with tempfile.TemporaryDirectory(dir=folder) as place:
        spec, _ = write_scan(request.scene.source, Path(place) / "scan.nrrd", Silent(), MOST_VOXELS)
        request = replace(request, scene=_looked(request).with_source(spec), first_look=False)
        bench = VariantBench(request, Path(place), PIXELS)
        added = bench.left_out()
        made = bench.everything(added)
        if made is None or made[1].ratio is None:
            return []
        package, everything = made
        voxel_mm = min(package.manifest.levels[0].grid.spacing_mm_zyx)
        usual_mm = COMPOSITINGS[request.scene.render.compositing].step_voxels * voxel_mm
        usual = bench.gauge.timed(package, bench.gauge.transfers, other_step_mm=usual_mm).ratio
    planned = bench.measured_as_planned
    return [
        LeftOutRow(
            name,
            planned.package_bytes,
            everything.package_bytes / planned.package_bytes,
            everything.upload_bytes / planned.upload_bytes,
            planned.milliseconds,
            everything.ratio.median,
            everything.ratio.low,
            everything.ratio.high,
            bench.gauge.subject.step_mm / voxel_mm,
            usual.median,
            planned.rmse,
            everything.rmse,
            tuple(item.name for item in added),
        )
    ]


def _looked(request: Request) -> Scene:
    """Return the scene, with the transfer functions of a first look where it has none."""
    if not request.first_look:
        return request.scene
    plan = plan_build(request, Silent())
    points = [
        {"value": point.value, "colour": list(point.colour), "extinction_per_mm": point.extinction_per_mm}
        for point in plan.channels[0].transfer_functions[0].points
    ]
    table = request.scene.model_dump() | {"transfer": [{"name": "look", "points": points}]}
    return type(request.scene).model_validate(table)


def leaving_out_table(rows: list[LeftOutRow]) -> Table:
    """Lay the rows out for people."""
    heads = (
        *("scan", "planned MB", "package", "upload", "ms", "time", "quartiles", "step", "with 0.5 voxels", "RMSE"),
        *("everything's", "reached"),
    )
    table = Table(*heads)
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        reached = row.package_ratio >= LEAST_BYTES, row.time_ratio >= LEAST_SPEED
        table.add_row(
            row.scan,
            f"{row.planned_bytes / 1e6:.2f}",
            f"{row.package_ratio:.1f} ×",
            f"{row.upload_ratio:.1f} ×",
            f"{row.planned_ms:.1f}",
            f"{row.time_ratio:.2f} ×",
            f"{row.time_low:.2f}–{row.time_high:.2f}",
            f"{row.step_voxels:.2g}",
            f"{row.usual_step_ratio:.2f} ×",
            f"{row.planned_rmse:.4f}",
            f"{row.everything_rmse:.4f}",
            {(True, True): "both", (True, False): "bytes", (False, True): "time", (False, False): "none"}[reached],
        )
    return table
