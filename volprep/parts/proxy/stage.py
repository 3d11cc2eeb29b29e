"""Proxy geometry: a closed mesh around what each transfer function shows of each level, checked before it is written.

Which blocks are empty is told as for skip tables: from the texels of the package and the table that the shader reads.
"""

import math

from volprep.parts.proxy.decision import DEPTH
from volprep.parts.proxy.files import mesh_file
from volprep.parts.proxy.mesh import block_planes, proxy_mesh
from volprep.parts.proxy.sound import problems_of
from volprep.parts.skip.occupancy import occupied_blocks, threshold_per_mm
from volprep.parts.skip.on_gpu import ranges_on_gpu
from volprep.parts.skip.visible import visible_extinction
from volprep.parts.stage import Stage, Work, present, required
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
    return (*present(plan.proxy), plan.grid, *plan.levels, *plan.tables)


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    proxy = required(plan.proxy)
    progress.start("proxy", len(proxy.meshes))
    ranges: dict[int, BlockRanges] = {}
    meshes = []
    for wanted in proxy.meshes:
        level = plan.level(wanted.level)
        if wanted.level not in ranges:
            ranges[wanted.level] = ranges_on_gpu(draft, plan, level, proxy.block)
        meshes.append(_mesh(draft, plan, proxy, wanted, ranges[wanted.level]))
        progress.advance()
    return Contribution(proxy=Proxy(epsilon=proxy.epsilon, meshes=tuple(meshes), depth=DEPTH))


def _mesh(
    draft: Draft, plan: ChannelPlan, proxy: ProxyPlan, wanted: ProxyMeshPlan, ranges: BlockRanges
) -> ProxyMeshFile:
    level = plan.level(wanted.level)
    threshold = threshold_per_mm(proxy.epsilon, math.hypot(*plan.grid.extent_mm_zyx))
    occupied = occupied_blocks(ranges, visible_extinction(draft, plan, wanted.transfer, wanted.level), threshold)
    planes = block_planes(level.shape_zyx, proxy.block)
    mesh = proxy_mesh(occupied, planes, proxy.form)
    for problem in problems_of(mesh, occupied, planes, proxy.form):
        raise VolprepError("VP9001", error=f"proxy geometry of {wanted.transfer}, level {level.index}: {problem}")
    z, y, x = (spacing / UNITS for spacing in plan.grid.coarser(level.factors_zyx).spacing_mm_zyx)
    draco = False
    if len(mesh.triangles):
        data, draco = mesh_file(mesh, (x, y, z), may_compress=proxy.draco == "auto")
        draft.write(wanted.file, "mesh", data)
    return ProxyMeshFile(
        transfer=wanted.transfer,
        level=level.index,
        form=proxy.form,
        block=proxy.block,
        file=wanted.file if len(mesh.triangles) else None,
        vertices=len(mesh.positions_xyz),
        triangles=len(mesh.triangles),
        draco=draco,
        box_from_mesh_mm_xyz=(x, y, z),
        occupied_share=float(occupied.mean()),
    )


STAGE = Stage(name="proxy", reads=("quantize", "pyramid", "transfer", "mosaic"), channel=Work(_settings, _run))
