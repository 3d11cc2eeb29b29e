"""Proxy geometry: a closed mesh around what each transfer function shows of each level, checked before it is written.

Empty blocks are found as for skip tables: from the texels of the package and the table that the shader reads.
"""

import math
from collections.abc import Sequence

from volprep.parts.proxy.files import MeshFile, chosen_files, mesh_file
from volprep.parts.proxy.mesh import block_planes, proxy_mesh
from volprep.parts.proxy.sound import problems_of
from volprep.parts.skip.occupancy import occupied_blocks, threshold_per_mm
from volprep.parts.skip.on_gpu import ranges_on_gpu
from volprep.parts.skip.visible import visible_extinction
from volprep.parts.stage import Stage, Work, any_channel, present, required
from volprep.plan.products import ProxyMeshPlan, ProxyPlan
from volprep.plan.records import ChannelPlan
from volprep.scan.block_ranges import BlockRanges
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.proxy.record import UNITS, Proxy, ProxyMeshFile
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (*present(plan.part(ProxyPlan)), plan.grid, *plan.levels, *plan.tables)


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    proxy = required(plan.part(ProxyPlan))
    progress.start("proxy", len(proxy.meshes))
    ranges: dict[int, BlockRanges] = {}
    meshes: list[ProxyMeshFile] = []
    files: list[MeshFile] = []
    for wanted in proxy.meshes:
        level = plan.level(wanted.level)
        if wanted.level not in ranges:
            ranges[wanted.level] = ranges_on_gpu(draft, plan, level, proxy.block)
        mesh, file = _mesh(draft, plan, proxy, wanted, ranges[wanted.level])
        meshes.append(mesh)
        files += [] if file is None else [file]
        progress.advance()
    return Contribution(proxy=Proxy(epsilon=proxy.epsilon, meshes=_written(draft, proxy, meshes, files)))


def _written(
    draft: Draft, proxy: ProxyPlan, meshes: Sequence[ProxyMeshFile], files: Sequence[MeshFile]
) -> tuple[ProxyMeshFile, ...]:
    """Write the files of the meshes that have triangles, and return all records, with these files filled in."""
    chosen = iter(chosen_files(files, proxy.draco))
    found = []
    for mesh in meshes:
        draco = False
        if mesh.file is not None:
            data, draco = next(chosen)
            draft.write(mesh.file, "mesh", data)
        found.append(mesh.model_copy(update={"draco": draco}))
    return tuple(found)


def _mesh(
    draft: Draft, plan: ChannelPlan, proxy: ProxyPlan, wanted: ProxyMeshPlan, ranges: BlockRanges
) -> tuple[ProxyMeshFile, MeshFile | None]:
    """Return the record of a mesh, and its file if it has triangles."""
    level = plan.level(wanted.level)
    threshold = threshold_per_mm(proxy.epsilon, math.hypot(*plan.grid.extent_mm_zyx))
    occupied = occupied_blocks(ranges, visible_extinction(draft, plan, wanted.transfer, wanted.level), threshold)
    planes = block_planes(level.shape_zyx, proxy.block)
    mesh = proxy_mesh(occupied, planes, proxy.form)
    for problem in problems_of(mesh, occupied, planes, proxy.form):
        raise VolprepError("VP9001", error=f"proxy geometry of {wanted.transfer}, level {level.index}: {problem}")
    z, y, x = (spacing / UNITS for spacing in plan.grid.coarser(level.factors_zyx).spacing_mm_zyx)
    file = mesh_file(mesh, (x, y, z)) if len(mesh.triangles) else None
    record = ProxyMeshFile(
        transfer=wanted.transfer,
        level=level.index,
        form=proxy.form,
        block=proxy.block,
        file=wanted.file if len(mesh.triangles) else None,
        vertices=len(mesh.positions_xyz),
        triangles=len(mesh.triangles),
        box_from_mesh_mm_xyz=(x, y, z),
        occupied_share=float(occupied.mean()),
    )
    return record, file


def _has_meshes(plan: ChannelPlan) -> bool:
    proxy = plan.part(ProxyPlan)
    return proxy is not None and bool(proxy.meshes)


STAGE = Stage(
    name="proxy",
    reads=("quantize", "pyramid", "transfer", "mosaic"),
    channel=Work(_settings, _run),
    is_needed=any_channel(_has_meshes),
)
