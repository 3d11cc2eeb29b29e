"""Empty-space skipping: its kernels against the best public ones, and what every kind of table saves on real scans.

Drawing is timed in processor time on the software driver, so that a busy machine does not make a table look bad.
"""

import dataclasses
import math
import os
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import edt
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import ndimage

from volprep import _native
from volprep.drafts import import_draft
from volprep.pipeline import STAGES, plan_draft, run_stage
from volprep.plan import Plan, SkipPlan
from volprep.plan.skip import skip_table_plan
from volprep.render.camera import standard_views
from volprep.render.renderer import Renderer
from volprep.request import Request, load_request
from volprep.skip.occupancy import occupied_blocks
from volprep.skip.ranges import BlockRanges, block_ranges
from volprep.validation.counted import samples_per_pixel
from volprep_formats.package.draft import Draft
from volprep_formats.package.reader import Package
from volprep_formats.package.skip import SkipKind
from volprep_formats.progress import Silent

from .contest import Contest

VIEWS = ("anterior", "superior", "anterior-left")
SIZE = 160
TABLES: tuple[tuple[SkipKind, int], ...] = (
    ("blocks", 8),
    ("table16", 0),
    ("pyramid", 8),
    ("distance", 4),
    ("distance", 8),
    ("distance", 16),
    ("octants", 8),
    ("distance", 1),
    ("euclidean", 1),
)
"""Kind and cells of a block; blocks of one cell are full resolution."""

_POINT = '{{ value = {}, colour = "#c0a080", extinction_per_mm = {} }}'
_SCENES: dict[str, tuple[str, dict[str, tuple[tuple[float, float], ...]]]] = {
    "MR head": (
        'path = "{}/mr_t1_studyforrest/dicoms"',
        {"skin": ((12, 0), (30, 0.05), (80, 0.8)), "vessels": ((110, 0), (140, 2.0))},
    ),
    "ch2 head": (
        'path = "{}/nifti_ch2/ch2.nii.gz"',
        {"opaque": ((20, 0), (60, 0.5), (120, 1.0)), "white matter": ((95, 0), (110, 0.6))},
    ),
    "shell": ('path = "{}/qim_microct/shell_225x128x128.tif"', {"opaque": ((60, 0), (120, 2.0))}),
    "fly": ('path = "{}/qim_microct/fly_150x256x256.tif"', {"opaque": ((60, 0), (120, 2.0))}),
    "engine": (
        'path = "{}/engine_pair/png_stack"',
        {"veil": ((45, 0), (90, 0.006), (170, 0.15), (230, 0.5)), "inserts": ((150, 0), (200, 1.0))},
    ),
    "CT phantom": (
        'path = "{}/ct_phantom_tilt-18.5/S2010"\nrepair = ["tilt"]',
        {"opaque": ((-500, 0), (0, 0.1), (300, 1.0)), "dense": ((200, 0), (600, 1.0))},
    ),
}
_FOG = ((-32768.0, 0.002), (32767.0, 0.002))
"""A fog in every voxel: nothing is empty, and a table is no more than a burden."""


@dataclass(frozen=True)
class SkipRow:
    """One table on one scan with one transfer function."""

    scan: str
    """Scan and transfer function."""
    table: str
    """Kind and cells of a block; "none" without skipping."""
    empty_share: float
    """Part of the blocks that are empty."""
    samples_saved: float
    """Part of the samples that rays do not take, of those that they take without a table, over three views."""
    looks_per_sample: float
    """Entries of the table that are read, over the samples without a table."""
    cpu_ms: float
    """Processor time of a picture of 160² pixels."""
    times_faster: float
    """Processor time without a table over that."""
    kilobytes: float
    """Size of the finest level's table."""
    build_ms: float
    """Wall time of the stage, all levels."""
    largest_difference: float
    """Largest difference of a channel of a pixel from the picture without a table."""


def contests() -> Iterator[Contest]:
    """Compare the kernels with others, on a shell and some planes in a volume of 117 MB, and on 128³ blocks."""
    z, y, x = np.ogrid[-1:1:447j, -1:1:512j, -1:1:512j]
    radius = np.sqrt(z * z + y * y + x * x)
    occupied = ((np.abs(radius - 0.7) < 0.01) | ((np.abs(x) < 0.01) & (radius < 0.3))).astype(np.uint8)
    del radius
    distance, square = np.empty(occupied.shape, np.uint8), np.empty(occupied.shape, np.uint16)
    empty = occupied == 0
    yield Contest(
        work="Chebyshev distance",
        source=occupied,
        bytes_written=distance.nbytes,
        ours=lambda: _native.chebyshev_distance(occupied, distance),
        peers={"scipy chessboard": lambda: ndimage.distance_transform_cdt(empty, "chessboard")},
    )
    yield Contest(
        work="Euclidean distance² ≤ 254²",
        source=occupied,
        bytes_written=square.nbytes,
        ours=lambda: _native.euclidean_distance(occupied, square),
        # Without a bound, in float32.
        peers={"edt, two threads": lambda: edt.edt(empty, parallel=2)},
    )
    blocks = np.ascontiguousarray(occupied[: 128 * 3 : 3, ::4, ::4])
    block_distance = np.empty(blocks.shape, np.uint8)
    yield Contest(
        work="the same on one thread",
        source=occupied,
        bytes_written=square.nbytes,
        ours=lambda: _native.euclidean_distance(occupied, square, threads=1),
        peers={"edt, one thread": lambda: edt.edt(empty, parallel=1)},
    )
    yield Contest(
        work="Chebyshev, 128³ blocks",
        source=blocks,
        bytes_written=block_distance.nbytes,
        ours=lambda: _native.chebyshev_distance(blocks, block_distance),
        peers={"scipy chessboard": lambda: ndimage.distance_transform_cdt(blocks == 0, "chessboard")},
    )
    scan = (occupied[:224] * 200).astype(np.uint8)
    table = np.zeros(256)
    table[120:] = 1.0
    yield Contest(
        work="16³ ranges and occupancy",
        source=scan,
        bytes_written=0,
        ours=lambda: occupied_blocks(block_ranges(lambda z0, z1: scan[z0:z1], scan.shape, 16), table),
        peers={"numpy": lambda: _numpy_occupancy(scan, table)},
    )


def _numpy_occupancy(scan: NDArray[np.uint8], table: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Do the easier task: whole blocks only, no shared voxels."""
    z, y, x = (n // 16 for n in scan.shape)
    blocks = scan[: z * 16].reshape(z, 16, y, 16, x, 16)
    return occupied_blocks(BlockRanges(blocks.min(axis=(1, 3, 5)), blocks.max(axis=(1, 3, 5)), 16), table)


def measure_skip(console: Console) -> list[SkipRow]:
    """Draw the scans with each kind of table and without. Empty where VOLPREP_TEST_DATA does not say where they are."""
    scans = os.environ.get("VOLPREP_TEST_DATA", "")
    rows: list[SkipRow] = []
    for name, (source, functions) in _SCENES.items() if scans else ():
        console.print(f"measuring empty-space skipping on {name}", style="dim")
        with tempfile.TemporaryDirectory() as folder:
            rows += _measure_scan(Path(folder), name, source.format(scans), {**functions, "fog": _FOG})
    return rows


def _measure_scan(
    folder: Path, name: str, source: str, functions: dict[str, tuple[tuple[float, float], ...]]
) -> list[SkipRow]:
    request = _request(folder, source, functions)
    draft = import_draft(request, folder / "draft", Silent()).draft
    plan = plan_draft(draft, request.scene, request.profile)
    for stage in STAGES:
        if stage.name in plan.stages and stage.name != "seal":
            run_stage(draft, stage, plan, request.scene, Silent())
    package = Package.open(draft.folder, allow_draft=True)
    transfers = [function.name for function in plan.transfer_functions]
    plain = {transfer: _draw(package, transfer) for transfer in transfers}
    rows = [
        SkipRow(transfer, "none", 0.0, 0.0, 0.0, plain[transfer].cpu_ms, 1.0, 0.0, 0.0, 0.0) for transfer in transfers
    ]
    for kind, block in TABLES:
        rows += _measure_table(draft, plan, request, plain, kind=kind, block=block)
    named = [dataclasses.replace(row, scan=f"{name}, {row.scan}") for row in rows]
    return sorted(named, key=lambda row: row.scan)


def _request(folder: Path, source: str, functions: dict[str, tuple[tuple[float, float], ...]]) -> Request:
    tables = [
        f'[[transfer]]\nname = "{name.replace(" ", "-")}"\npoints = [{", ".join(_POINT.format(*p) for p in points)}]\n'
        for name, points in functions.items()
    ]
    scene = folder / "scene.toml"
    # The fog shows every voxel: nothing is cropped, and the empty border is left to the tables.
    scene.write_text(f'name = "s"\n[source]\n{source}\n' + "\n".join(tables), encoding="utf-8")
    return load_request(scene)


def _measure_table(
    draft: Draft, plan: Plan, request: Request, plain: dict[str, "_Drawn"], *, kind: SkipKind, block: int
) -> list[SkipRow]:
    cells = block or max(1, math.ceil((max(plan.levels[0].shape_zyx) - 1) / 16))
    transfers = [function.name for function in plan.transfer_functions]
    # Tables for all, whether the plan would keep them or not.
    tables = tuple(skip_table_plan(transfer, plan.levels[0], kind, cells, plan.profile) for transfer in transfers)
    skip = SkipPlan(epsilon=0.0, shares=(0.0,) * len(transfers), tables=tables, ranges=())
    programs = tuple(program.model_copy(update={"levels": program.levels[:1]}) for program in plan.programs)
    with_skip = plan.model_copy(update={"skip": skip, "programs": programs, "stages": tuple({*plan.stages, "skip"})})
    stages = {stage.name: stage for stage in STAGES}
    start = time.perf_counter()
    run_stage(draft, stages["skip"], with_skip, request.scene, Silent())
    build_ms = (time.perf_counter() - start) * 1000
    run_stage(draft, stages["shaders"], with_skip, request.scene, Silent())
    package = Package.open(draft.folder, allow_draft=True)
    shares = {table.transfer: table.empty_share for table in package.manifest.skipping.tables}
    sizes = {table.transfer: math.prod(table.shape_zyx) / 1000 for table in tables}
    rows = []
    for transfer in transfers:
        drawn, without = _draw(package, transfer), plain[transfer]
        rows.append(
            SkipRow(
                scan=transfer,
                table=f"{kind} {cells}³",
                empty_share=shares[transfer],
                samples_saved=1.0 - drawn.taken / without.taken,
                looks_per_sample=drawn.looked / without.taken,
                cpu_ms=drawn.cpu_ms,
                times_faster=without.cpu_ms / drawn.cpu_ms,
                kilobytes=sizes[transfer],
                build_ms=build_ms / len(transfers),
                largest_difference=float(np.abs(drawn.pictures - without.pictures).max()),
            )
        )
    return rows


@dataclass(frozen=True)
class _Drawn:
    pictures: NDArray[np.float32]
    taken: float
    looked: float
    cpu_ms: float


def _draw(package: Package, transfer: str) -> _Drawn:
    grid = package.manifest.levels[0].grid
    cameras = [standard_views(grid)[view].box_from_clip(grid, 1.0) for view in VIEWS]
    program = next(each for each in package.manifest.programs if each.transfer == transfer)
    counts = [samples_per_pixel(package, program, grid_level(package), camera, (SIZE, SIZE)) for camera in cameras]
    with Renderer(package, level=grid_level(package), transfer=transfer, target="rgba32f") as renderer:
        pictures = np.stack([renderer.render(camera, (SIZE, SIZE)) for camera in cameras])
        times = []
        for _ in range(3):
            start = time.process_time()
            for camera in cameras:
                renderer.render(camera, (SIZE, SIZE))
            times.append((time.process_time() - start) * 1000 / len(cameras))
    return _Drawn(
        pictures, sum(taken.sum() for taken, _ in counts), sum(looked.sum() for _, looked in counts), min(times)
    )


def grid_level(package: Package) -> int:
    """Give the finest level of a package."""
    return package.manifest.levels[0].index


def skip_rows_table(rows: list[SkipRow]) -> Table:
    """Lay the rows out for people."""
    heads = ("scan, transfer", "table", "empty", "saved", "looks", "CPU ms", "faster", "kB", "build ms", "difference")
    table = Table(*heads)
    for column in table.columns[2:]:
        column.justify = "right"
    for row in rows:
        cells = dataclasses.astuple(row)
        empty, saved, looks, cpu_ms, faster, size, build_ms, difference = cells[2:]
        table.add_row(
            *cells[:2],
            f"{empty:.0%}",
            f"{saved:.0%}",
            f"{looks:.1%}",
            f"{cpu_ms:.0f}",
            f"{faster:.2f} ×",
            f"{size:.1f}",
            f"{build_ms:.0f}",
            f"{difference:.1g}",
        )
    return table
