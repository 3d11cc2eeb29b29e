"""Empty-space skipping: its kernels against the best public ones, and what every kind of table saves on real scans."""

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import ndimage

from volprep.kernels import _native
from volprep.parts.skip.decision import skip_table_plan
from volprep.parts.skip.occupancy import occupied_blocks
from volprep.plan.products import SkipPlan
from volprep.scan.block_ranges import BlockRanges, block_ranges
from volprep_formats.package.parts.skip.record import SkipKind

from .contest import Contest
from .real_scans import Drawn, PlannedDraft, Points, drawn, planned_draft

TABLES: tuple[tuple[SkipKind, int], ...] = (
    ("blocks", 8),
    ("table16", 0),
    ("distance", 4),
    ("distance", 8),
    ("distance", 16),
    ("distance", 1),
)
"""Kind and cells of a block; blocks of one cell are full resolution."""

_SCENES: dict[str, dict[str, Points]] = {
    "MR head": {"skin": ((12, 0), (30, 0.05), (80, 0.8)), "vessels": ((110, 0), (140, 2.0))},
    "ch2 head": {"opaque": ((20, 0), (60, 0.5), (120, 1.0)), "white matter": ((95, 0), (110, 0.6))},
    "shell": {"opaque": ((60, 0), (120, 2.0))},
    "fly": {"opaque": ((60, 0), (120, 2.0))},
    "engine": {"veil": ((45, 0), (90, 0.006), (170, 0.15), (230, 0.5)), "inserts": ((150, 0), (200, 1.0))},
    "CT phantom": {"opaque": ((-500, 0), (0, 0.1), (300, 1.0)), "dense": ((200, 0), (600, 1.0))},
}
"""Scan, and its transfer functions."""
_FOG = ((-32768.0, 0.002), (32767.0, 0.002))
"""A fog in every voxel: nothing is empty or cropped, and a table is no more than a burden."""


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
    distance = np.empty(occupied.shape, np.uint8)
    empty = occupied == 0
    yield Contest(
        work="Chebyshev distance",
        source=occupied,
        bytes_written=distance.nbytes,
        ours=lambda: _native.chebyshev_distance(occupied, distance),
        peers={"scipy chessboard": lambda: ndimage.distance_transform_cdt(empty, "chessboard")},
    )
    blocks = np.ascontiguousarray(occupied[: 128 * 3 : 3, ::4, ::4])
    block_distance = np.empty(blocks.shape, np.uint8)
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


def measure_skip(console: Console) -> Iterator[SkipRow]:
    """Draw the scans with each kind of table and without."""
    for scan, functions in _SCENES.items():
        console.print(f"measuring empty-space skipping on {scan}", style="dim")
        with planned_draft(scan, {**functions, "fog": _FOG}) as made:
            package = made.package()
            plain = {function.name: drawn(package, function.name) for function in made.channel.transfer_functions}
            found = [
                SkipRow(transfer, "none", 0.0, 0.0, 0.0, without.cpu_ms, 1.0, 0.0, 0.0, 0.0)
                for transfer, without in plain.items()
            ]
            for kind, block in TABLES:
                found += _measure_table(made, plain, kind=kind, block=block)
        named = [dataclasses.replace(row, scan=f"{scan}, {row.scan}") for row in found]
        yield from sorted(named, key=lambda row: row.scan)


def _measure_table(made: PlannedDraft, plain: dict[str, Drawn], *, kind: SkipKind, block: int) -> list[SkipRow]:
    plan = made.channel
    cells = block or max(1, math.ceil((max(plan.levels[0].shape_zyx) - 1) / 16))
    # Tables for all, whether the plan would keep them or not.
    tables = tuple(skip_table_plan(transfer, plan.levels[0], kind, cells, plan.profile) for transfer in plain)
    skip = SkipPlan(epsilon=0.0, shares=(0.0,) * len(plain), tables=tables, ranges=())
    programs = tuple(program.model_copy(update={"levels": program.levels[:1]}) for program in plan.programs)
    build_ms = made.made_anew("skip", skip=skip, programs=programs)
    package = made.package()
    shares = {table.transfer: table.empty_share for table in package.manifest.skipping.tables}
    sizes = {table.transfer: math.prod(table.shape_zyx) / 1000 for table in tables}
    rows = []
    for transfer, without in plain.items():
        with_it = drawn(package, transfer)
        rows.append(
            SkipRow(
                scan=transfer,
                table=f"{kind} {cells}³",
                empty_share=shares[transfer],
                samples_saved=1.0 - with_it.taken / without.taken,
                looks_per_sample=with_it.looked / without.taken,
                cpu_ms=with_it.cpu_ms,
                times_faster=without.cpu_ms / with_it.cpu_ms,
                kilobytes=sizes[transfer],
                build_ms=build_ms / len(plain),
                largest_difference=float(np.abs(with_it.pictures - without.pictures).max()),
            )
        )
    return rows


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
