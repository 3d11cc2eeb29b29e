"""`make bench`: prints what every room's benchmarks found, and writes it to bench.json.

Each room has a file bench_*.py here. Kernels give contests (contest.py) and appear in the table of rows below. What is
measured in another unit, such as the memory of a build, gets a section of its own in bench.json.
"""

import json
from dataclasses import asdict
from itertools import chain
from pathlib import Path

from rich.console import Console
from rich.table import Table

from volprep.kernels import _native

from .bench_channels import channels_table, measure_channels
from .bench_classified import classified_table, measure_classified
from .bench_compressed import compressed_table, measure_compressed
from .bench_decode import DecodeRow, measure_decode
from .bench_import import ImportRow, measure_import
from .bench_kernels import contests
from .bench_leaving_out import leaving_out_table, measure_leaving_out
from .bench_levels import levels_table, measure_levels
from .bench_memory import MemoryRow, measure_memory
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


def main() -> None:
    """Hold all contests, print the table, write the file."""
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
    imports = measure_import(console)
    console.print(_import_table(imports))
    decodes = measure_decode(console)
    console.print(_decode_table(decodes))
    fetches = measure_fetch(console)
    console.print(fetch_table(fetches))
    channels = measure_channels(console)
    console.print(channels_table(channels))
    compressed = measure_compressed(console)
    console.print(compressed_table(compressed))
    pyramid = measure_pyramid(console)
    console.print(pyramid_table(pyramid))
    levels = measure_levels(console)
    console.print(levels_table(levels))
    classified = measure_classified(console)
    console.print(classified_table(classified))
    normals = measure_normals(console)
    for table in normals_tables(normals):
        console.print(table)
    skipping = measure_skip(console)
    console.print(skip_rows_table(skipping))
    leaving_out = measure_leaving_out(console)
    console.print(leaving_out_table(leaving_out))
    meshes = measure_proxy(console)
    console.print(proxy_rows_table(meshes))
    slices = measure_slices(console)
    console.print(slices_table(slices))
    segments, hiding = measure_segments(console), measure_hiding(console)
    console.print(segments_table(segments), hiding_table(hiding))
    others = measure_vtk(console)
    console.print(vtk_table(others))
    transports = measure_transport(console)
    console.print(transport_table(transports))
    pages = measure_page(console)
    console.print(page_table(pages))
    memory = measure_memory(console)
    console.print(_memory_table(memory))
    found = {
        "machine": machine,
        "rows": [asdict(row) for row in rows],
        "import": [asdict(row) for row in imports],
        "decode": [asdict(row) for row in decodes],
        "skipping": [asdict(row) for row in skipping],
        "leaving out": [asdict(row) for row in leaving_out],
        "proxy": [asdict(row) for row in meshes],
        "slices": [asdict(row) for row in slices],
        "memory": [asdict(row) for row in memory],
        "mosaics": [asdict(row) for row in fetches],
        "channels": [asdict(row) for row in channels],
        "compressed": [asdict(row) for row in compressed],
        "pyramid": [asdict(row) for row in pyramid],
        "levels": [asdict(row) for row in levels],
        "classified": [asdict(row) for row in classified],
        "normals": asdict(normals),
        "segments": [asdict(row) for row in segments],
        "hiding segments": [asdict(row) for row in hiding],
        "vtk": [asdict(row) for row in others],
        "transport": [asdict(row) for row in transports],
        "page": [asdict(row) for row in pages],
    }
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


def _decode_table(rows: list[DecodeRow]) -> Table:
    table = Table("60 slices of 512×512", "one by one s", "in workers s", "with their start s", "times faster")
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        times = (row.serial_s, row.workers_s, row.first_s)
        table.add_row(row.syntax, *(f"{seconds:.2f}" for seconds in times), f"{row.ratio:.2f} ×")
    return table


def _memory_table(rows: list[MemoryRow]) -> Table:
    table = Table("work", "s", "largest memory MB", "read, digest, write s", "ratio")
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        bare = ("", "")
        if row.bare_seconds is not None:
            bare = (f"{row.bare_seconds:.0f}", f"{row.seconds / row.bare_seconds:.1f}")
        table.add_row(row.work, f"{row.seconds:.0f}", f"{row.peak_mb:.0f}", *bare)
    return table


def _import_table(rows: list[ImportRow]) -> Table:
    table = Table("import of DICOM", "how", "ours s", "peer", "peer s", "ours ÷ peer")
    for row in rows:
        table.add_row(
            row.series,
            row.how,
            f"{row.ours_s:.2f}",
            row.peer,
            f"{row.peer_s:.2f}",
            f"{row.ratio:.2f}",
        )
    return table


main()
