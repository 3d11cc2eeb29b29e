"""Proxy geometry: a closed mesh around what each transfer function shows of each level, checked before it is written.

Empty blocks are found as for skip tables: from the texels of the package and the table that the shader reads. Whether
files are compressed is decided for all channels together: an app loads a decoder once for a package.
"""

import math
from collections.abc import Iterator, Sequence

from volprep.parts.proxy.files import MeshFile, chosen_files, mesh_file
from volprep.parts.proxy.mesh import block_planes, proxy_mesh
from volprep.parts.proxy.sound import problems_of
from volprep.parts.skip.occupancy import occupied_blocks, threshold_per_mm
from volprep.parts.skip.on_gpu import ranges_on_gpu
from volprep.parts.skip.visible import visible_extinction
from volprep.parts.stage import Stage, Work, any_channel, present
from volprep.plan.products import ProxyMeshPlan, ProxyPlan
from volprep.plan.records import ChannelPlan, Plan
from volprep.scan.block_ranges import BlockRanges
from volprep.scene.scene import DracoWish
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.proxy.record import UNITS, Proxy, ProxyMeshFile
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record

_Made = tuple[ProxyMeshFile, MeshFile | None]
"""Record of a mesh, and its file if it has triangles."""


def _settings(plan: Plan) -> tuple[Record, ...]:
    return tuple(
        record
        for channel in plan.channels
        for record in (*present(channel.part(ProxyPlan)), channel.grid, *channel.levels, *channel.tables)
    )


def _run(draft: Draft, plan: Plan, progress: Progress) -> Contribution:
    channels = [(channel, proxy) for channel in plan.channels if (proxy := channel.part(ProxyPlan)) is not None]
    progress.start("proxy", sum(len(proxy.meshes) for _, proxy in channels))
    made = [each for channel, proxy in channels for each in _meshes(draft, channel, proxy, progress)]
    # One scene, so that all channels have the same wishes.
    wishes = channels[0][1]
    return Contribution(proxy=Proxy(epsilon=wishes.epsilon, meshes=_written(draft, wishes.draco, made)))


def _meshes(draft: Draft, plan: ChannelPlan, proxy: ProxyPlan, progress: Progress) -> Iterator[_Made]:
    """Return the meshes of a channel."""
    ranges: dict[int, BlockRanges] = {}
    for wanted in proxy.meshes:
        if wanted.level not in ranges:
            ranges[wanted.level] = ranges_on_gpu(draft, plan, plan.level(wanted.level), proxy.block)
        yield _mesh(draft, plan, proxy, wanted, ranges[wanted.level])
        progress.advance()


def _written(draft: Draft, draco: DracoWish, made: Sequence[_Made]) -> tuple[ProxyMeshFile, ...]:
    """Write the files of the meshes that have triangles, and return all records, with these files filled in."""
    chosen = iter(chosen_files([file for _, file in made if file is not None], draco))
    found = []
    for mesh, _ in made:
        packed = False
        if mesh.file is not None:
            data, packed = next(chosen)
            draft.write(mesh.file, "mesh", data)
        found.append(mesh.model_copy(update={"draco": packed}))
    return tuple(found)


def _mesh(draft: Draft, plan: ChannelPlan, proxy: ProxyPlan, wanted: ProxyMeshPlan, ranges: BlockRanges) -> _Made:
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
        name=f"{wanted.transfer}-{level.index}",
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
    summary="Write a closed mesh around the visible voxels of each level and transfer function, for rays to start at.",
    options=("proxy", ("form", "block")),
    reads=("quantize", "pyramid", "transfer", "mosaic"),
    package=Work(_settings, _run),
    is_needed=any_channel(_has_meshes),
)
