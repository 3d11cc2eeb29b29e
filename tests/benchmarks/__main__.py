"""`make bench`: prints what every room's benchmarks found, and writes it to bench.json; ARGS=import measures one.

Each room has a file bench_*.py here. Kernels give contests (contest.py) and appear in the table of rows below. What is
measured in another unit, such as the memory of a build, is a section of its own, below and in bench.json.
"""

import json
import sys
from collections.abc import Callable, Iterable
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console, RenderableType
from rich.table import Table

from volprep.kernels import _native

from .bench_channels import channels_table, measure_channels
from .bench_classified import classified_table, measure_classified
from .bench_compressed import compressed_table, measure_compressed
from .bench_decode import decode_table, measure_decode
from .bench_import import import_table, measure_import
from .bench_kernels import contests
from .bench_leaving_out import leaving_out_table, measure_leaving_out
from .bench_levels import levels_table, measure_levels
from .bench_memory import measure_memory, memory_table
from .bench_mosaics import contests as mosaic_contests
from .bench_mosaics import fetch_table, measure_fetch
from .bench_normals import measure_normals, normals_tables
from .bench_page import measure_page, page_table
from .bench_proxy import contests as proxy_contests
from .bench_proxy import measure_proxy, proxy_rows_table
from .bench_pyramid import measure_pyramid, pyramid_table
from .bench_segments import hiding_table, measure_hiding, measure_segments, segments_table
from .bench_skip import contests as skip_contests
from .bench_skip import measure_skip, skip_rows_table
from .bench_slices import measure_slices, slices_table
from .bench_transfer import contests as transfer_contests
from .bench_transport import measure_transport, transport_table
from .bench_vtk import measure_vtk, vtk_table
from .contest import Row, hold
from .real_scans import NoData

RESULT = Path("bench.json")
TABLE_WIDTH = 160
"""Columns of the table: a narrower terminal wraps its lines, which is better than half of their words."""

KERNELS = "kernels"

SECTIONS: dict[str, tuple[Callable[[Console], Iterable[Any]], Callable[[Any], RenderableType]]] = {
    "import": (measure_import, import_table),
    "decode": (measure_decode, decode_table),
    "mosaics": (measure_fetch, fetch_table),
    "channels": (measure_channels, channels_table),
    "compressed": (measure_compressed, compressed_table),
    "pyramid": (measure_pyramid, pyramid_table),
    "levels": (measure_levels, levels_table),
    "classified": (measure_classified, classified_table),
    "normals": (measure_normals, normals_tables),
    "skipping": (measure_skip, skip_rows_table),
    "leaving out": (measure_leaving_out, leaving_out_table),
    "proxy": (measure_proxy, proxy_rows_table),
    "slices": (measure_slices, slices_table),
    "segments": (measure_segments, segments_table),
    "hiding segments": (measure_hiding, hiding_table),
    "vtk": (measure_vtk, vtk_table),
    "transport": (measure_transport, transport_table),
    "page": (measure_page, page_table),
    "memory": (measure_memory, memory_table),
}
"""What measures each section of bench.json, and its table for people."""


def main(wanted: list[str]) -> None:
    """Measure all, or what has one of these words in its name: print each row, then each table; write the file."""
    console = Console()
    console.width = max(console.width, TABLE_WIDTH)
    chosen = [name for name in (KERNELS, *SECTIONS) if not wanted or any(word in name for word in wanted)]
    if not chosen:
        sys.exit(f"no benchmark has such a name; there are {KERNELS}, {', '.join(SECTIONS)}")
    found: dict[str, Any] = {}
    for name in chosen:
        try:
            found |= measure_kernels(console) if name == KERNELS else {name: measure_section(console, name)}
        except (NoData, pytest.skip.Exception) as missing:
            console.print(f"{name}: not measured: {missing}", markup=False)
            continue
        RESULT.write_text(json.dumps(found, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    console.print(f"Written to {RESULT.resolve()}." if found else "Nothing was measured.")


def measure_kernels(console: Console) -> dict[str, Any]:
    """Hold all contests; return their rows, and the bandwidth of the machine."""
    outcomes = []
    for contest in chain(contests(), mosaic_contests(), skip_contests(), proxy_contests(), transfer_contests()):
        outcomes.append(hold(contest))
        for row in outcomes[-1].rows:
            console.print(
                f"{row.work}, {row.source}: {row.ours_ms:.1f} ms, {row.peer} {row.peer_ms:.1f} ms", style="dim"
            )
    machine = {
        "threads": _native.max_threads(),
        "read_gb_per_s": max(outcome.read_gb_per_s for outcome in outcomes),
        "copy_gb_per_s": max(outcome.copy_gb_per_s for outcome in outcomes),
    }
    rows = [row for outcome in outcomes for row in outcome.rows]
    console.print(_table(rows))
    console.print(
        "Memory on {threads} threads: read {read_gb_per_s:.1f}, copy {copy_gb_per_s:.1f} GB/s.".format(**machine)
    )
    return {"machine": machine, KERNELS: [asdict(row) for row in rows]}


def measure_section(console: Console, name: str) -> list[dict[str, Any]]:
    """Measure one of SECTIONS and return its rows."""
    measure, table = SECTIONS[name]
    rows = []
    for row in measure(console):
        rows.append(row)
        facts = asdict(row).items()
        told = (f"{fact} {value:.4g}" if isinstance(value, float) else f"{fact} {value}" for fact, value in facts)
        console.print(f"{name}: {', '.join(told)}", style="dim", markup=False)
    console.print(table(rows))
    return [asdict(row) for row in rows]


def _table(rows: list[Row]) -> Table:
    table = Table("work", "voxels", "ours ms", "GB/s", "peer", "peer ms", "ratio", "bandwidth")
    for column in table.columns:
        column.no_wrap = True
    for column in (2, 3, 5, 6, 7):
        table.columns[column].justify = "right"
    for row in rows:
        table.add_row(
            row.work,
            row.source.split()[0],
            f"{row.ours_ms:.1f}",
            f"{row.input_gb_per_s:.1f}",
            row.peer,
            f"{row.peer_ms:.1f}",
            f"{row.ratio:.1f} ×",
            f"{row.share_of_bandwidth:.0%}",
        )
    return table


main(sys.argv[1:])
