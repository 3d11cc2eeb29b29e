"""Proxy geometry: the mesh of a 512³ volume, and what meshes of every form save on real scans, in samples and time."""

import dataclasses
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from skimage.measure import marching_cubes

from volprep.parts.proxy.decision import proxy_program
from volprep.parts.proxy.mesh import ProxyMesh, block_planes, proxy_mesh
from volprep.parts.skip.occupancy import Occupied, occupied_blocks
from volprep.plan.products import ProxyMeshPlan, ProxyPlan
from volprep.render.proxy_renderer import ProxyRenderer
from volprep.scan.block_ranges import BlockRanges
from volprep_formats.meshes import primitives_of, read_glb, write_glb
from volprep_formats.package.parts.proxy.record import ProxyForm

from .contest import Contest
from .real_scans import Drawn, PlannedDraft, Points, drawn, planned_draft

MESHES: tuple[tuple[ProxyForm, int], ...] = (
    ("blocks", 8),
    ("merged", 4),
    ("merged", 8),
    ("merged", 16),
    ("convex", 8),
    ("box", 8),
)
"""Form and cells of a block."""
_TRANSFER = "t"
_SCENES: dict[str, tuple[str, Points]] = {
    "MR head, skin": ("MR head", ((12, 0), (30, 0.05), (80, 0.8))),
    "MR head, vessels": ("MR head", ((110, 0), (140, 2.0))),
    "shell": ("shell", ((60, 0), (90, 0.5), (255, 3.0))),
    "engine": ("engine", ((60, 0), (90, 0.02), (230, 0.5))),
}
"""Scan and transfer function."""


@dataclass(frozen=True)
class ProxyRow:
    """One mesh on one scan."""

    scan: str
    """Scan and transfer function."""
    mesh: str
    """Form and cells of a block; "none" without a mesh, "distance" for a skip table without one."""
    triangles: int
    """Triangles."""
    plain_kb: float
    """Size of the file without compression."""
    draco_kb: float
    """Size of the file with Draco."""
    encode_ms: float
    """Time of compressing."""
    decode_ms: float
    """Time of reading the compressed file."""
    build_ms: float
    """Time of making and checking the mesh, after the ranges of blocks."""
    samples_saved: float
    """Part of the samples that rays do not take, over three views."""
    cpu_ms: float
    """Processor time of a picture of 160² pixels."""
    times_faster: float
    """Processor time without a mesh over that."""
    largest_difference: float
    """Largest difference of a channel of a pixel from the picture without a mesh."""


def contests() -> Iterator[Contest]:
    """Compare the mesh of a volume of 512³ voxels, from the ranges of its blocks of 8³ cells on, with others."""
    z, y, x = np.ogrid[-1:1:64j, -1:1:64j, -1:1:64j]
    radius = np.sqrt(z * z + y * y + x * x)
    specks = np.random.default_rng(3).random(radius.shape) < 0.03
    high = np.where((np.abs(radius - 0.7) < 0.04) | specks, 200, 20).astype(np.uint8)
    ranges = BlockRanges(np.zeros_like(high), high, 8)
    table = np.zeros(256)
    table[120:] = 1.0
    planes = block_planes((512, 512, 512), 8)
    occupied = occupied_blocks(ranges, table)

    def ours() -> ProxyMesh:
        return proxy_mesh(occupied_blocks(ranges, table), planes, "merged")

    yield Contest(
        work="proxy mesh, 64³ blocks",
        source=high,
        bytes_written=0,
        ours=ours,
        # Neither is closed where blocks touch at an edge, and neither merges.
        peers={
            "scikit-image marching cubes": lambda: marching_cubes(np.pad(occupied, 1).astype(np.uint8), 0.5),
            "numpy faces": lambda: _numpy_faces(occupied),
        },
    )


def _numpy_faces(occupied: Occupied) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners of the outer faces, each with a number once."""
    n = occupied.shape[0] + 1
    solid = np.pad(occupied, 1).astype(np.int8)
    steps = (n * n, n, 1)
    faces = []
    for axis in range(3):
        u, v = (steps[k] for k in range(3) if k != axis)
        at = np.argwhere(np.diff(solid, axis=axis))
        at[:, [k for k in range(3) if k != axis]] -= 1
        first = at @ np.array(steps)
        faces.append(np.stack([first, first + u, first + u + v, first + v], axis=1))
    corners, numbered = np.unique(np.concatenate(faces), return_inverse=True)
    return corners, numbered


def measure_proxy(console: Console) -> Iterator[ProxyRow]:
    """Draw the scans with each mesh and without."""
    for name, (scan, points) in _SCENES.items():
        console.print(f"measuring proxy geometry on {name}", style="dim")
        with planned_draft(scan, {_TRANSFER: points}) as made:
            plain = drawn(made.package(), _TRANSFER)
            yield ProxyRow(name, "none", 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, plain.cpu_ms, 1.0, 0.0)
            yield from [_measure_mesh(made, name, plain, form=form, block=block) for form, block in MESHES]


def _measure_mesh(made: PlannedDraft, name: str, plain: Drawn, *, form: ProxyForm, block: int) -> ProxyRow:
    plan = made.channel
    level = plan.levels[0].index
    proxy = ProxyPlan(
        form=form,
        block=block,
        epsilon=0.0,
        draco="none",
        shares=(0.0,),
        meshes=(ProxyMeshPlan(transfer=_TRANSFER, level=level, file="meshes/proxy.glb"),),
        programs=tuple(proxy_program(program).model_copy(update={"levels": (level,)}) for program in plan.programs),
    )
    build_ms = made.made_anew("proxy", proxy=proxy)
    package = made.package()
    with_it = drawn(package, _TRANSFER, ProxyRenderer)
    data = package.read_bytes("meshes/proxy.glb")
    parts = read_glb(data, "mesh").primitives
    positions = np.concatenate([part.positions_xyz for part in parts]).astype(np.int32)
    starts = np.cumsum([0, *(len(part.positions_xyz) for part in parts)])
    triangles = np.concatenate([part.triangles.astype(np.int32) + k for part, k in zip(parts, starts, strict=False)])
    small = primitives_of(positions, triangles, 2**14 - 1)
    times = [time.perf_counter()]
    packed = write_glb(small, (1.0, 1.0, 1.0), {}, draco=True)
    times.append(time.perf_counter())
    read_glb(packed, "mesh")
    times.append(time.perf_counter())
    encode_ms, decode_ms = (1000 * step for step in np.diff(times))
    return ProxyRow(
        scan=name,
        mesh=f"{form} {block}³",
        triangles=len(triangles),
        plain_kb=len(data) / 1000,
        draco_kb=len(packed) / 1000,
        encode_ms=encode_ms,
        decode_ms=decode_ms,
        build_ms=build_ms,
        samples_saved=1.0 - with_it.taken / plain.taken,
        cpu_ms=with_it.cpu_ms,
        times_faster=plain.cpu_ms / with_it.cpu_ms,
        largest_difference=float(np.abs(with_it.pictures - plain.pictures).max()),
    )


def proxy_rows_table(rows: list[ProxyRow]) -> Table:
    """Lay the rows out for people."""
    heads = ("scan", "mesh", "triangles", "kB", "Draco kB", "encode ms", "decode ms", "build ms", "saved", "CPU ms")
    table = Table(*heads, "faster", "difference")
    for column in table.columns[2:]:
        column.justify = "right"
    for row in rows:
        cells = dataclasses.astuple(row)
        numbers = (f"{number:.1f}" for number in cells[3:8])
        saved, cpu_ms, faster, difference = cells[8:]
        last = (f"{saved:.0%}", f"{cpu_ms:.0f}", f"{faster:.2f} ×", f"{difference:.1g}")
        table.add_row(*cells[:2], str(row.triangles), *numbers, *last)
    return table
