"""`make bench`: prints what every room's benchmarks found, and writes it to bench.json.

Each room has a file bench_*.py here. Kernels give contests (contest.py) and appear in the table of rows below. What is
measured in another unit, such as the memory of a build, is a section of its own, below and in bench.json.
"""

import json
from collections.abc import Callable
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import Any

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

RESULT = Path("bench.json")
TABLE_WIDTH = 160
"""Columns of the table: a narrower terminal wraps its lines, which is better than half of their words."""

SECTIONS: dict[str, tuple[Callable[[Console], Any], Callable[[Any], RenderableType]]] = {
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


def main() -> None:
    """Hold all contests, measure all sections, print the tables, write the file."""
    console = Console()
    console.width = max(console.width, TABLE_WIDTH)
    outcomes = []
    for contest in chain(contests(), mosaic_contests(), skip_contests(), proxy_contests(), transfer_contests()):
        console.print(f"measuring {contest.work}, {contest.source.dtype}", style="dim")
        outcomes.append(hold(contest))
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
    found = {"machine": machine, "rows": [asdict(row) for row in rows]}
    for name, (measure, table) in SECTIONS.items():
        measured = measure(console)
        console.print(table(measured))
        found[name] = [asdict(row) for row in measured] if isinstance(measured, list) else asdict(measured)
    RESULT.write_text(json.dumps(found, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    console.print(f"Written to {RESULT.resolve()}.")


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


main()
