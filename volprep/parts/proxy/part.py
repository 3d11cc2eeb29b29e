"""The part *proxy*: meshes around visible voxels; rays begin and end on them. They are checked before they are written.

Whether files are compressed is decided for all channels together: an app loads a decoder once for a package.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Literal

from volprep.parts.ablation import AblationItem, always
from volprep.parts.case import Case
from volprep.parts.part import Part
from volprep.parts.programs.decision import shader_files
from volprep.parts.proxy.decision import KIND, describe_proxy, plan_proxy
from volprep.parts.proxy.files import DRACO_RULE, MeshFile, chosen_files, mesh_file
from volprep.parts.proxy.mesh import block_planes, proxy_mesh
from volprep.parts.proxy.sound import problems_of
from volprep.parts.skip.occupancy import occupied_blocks, threshold_per_mm
from volprep.parts.skip.on_gpu import ranges_on_gpu
from volprep.parts.skip.part import found_of
from volprep.parts.skip.visible import visible_extinction
from volprep.parts.stage import Stage, Work, any_channel
from volprep.plan.products import ProxyMeshPlan, ProxyPlan
from volprep.plan.records import ChannelPlan, Plan
from volprep.scan.block_ranges import BlockRanges
from volprep.scene.scene import DracoWish, Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Contribution, PlanItem
from volprep_formats.package.parts.proxy.record import UNITS, Proxy, ProxyMeshFile
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record, present

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
    made = [mesh for channel, proxy in channels for mesh in _meshes(draft, channel, proxy, progress)]
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


def _plan(case: Case) -> Case:
    wanted = case.scene.proxy
    return case.plus(plan_proxy(wanted, case.functions, case.layout.programs, found_of(case))) if wanted else case


def _items(plan: ChannelPlan, case: Case) -> Iterator[PlanItem]:
    if case.scene.proxy is not None:
        listed = {path for program in plan.programs for path in shader_files(program)}
        yield from describe_proxy(plan.part(ProxyPlan), plan.transfer_functions, found_of(case), listed)


def _settle(items: tuple[PlanItem, ...], draft: Draft, plan: Plan) -> tuple[PlanItem, ...]:
    """Add the meshes: the stage knows which are empty, and which are compressed."""
    wishes = {proxy.draco for channel in plan.channels if (proxy := channel.part(ProxyPlan)) is not None}
    why = DRACO_RULE if wishes == {"auto"} else "as the scene asks"
    meshes = draft.manifest.proxy.meshes if draft.manifest.proxy else ()
    settled = []
    for item in items:
        own = {mesh.file: mesh.draco for mesh in meshes if mesh.file and mesh.transfer == item.transfer}
        if item.kind != KIND or not own:
            settled.append(item)
            continue
        reason = f"{item.reason}; {sum(own.values())} of {len(own)} files compressed with Draco, {why}"
        settled.append(item.model_copy(update={"files": (*item.files, *own), "reason": reason}))
    return tuple(settled)


def _chooser(scene: Scene) -> Literal["plan", "scene"]:
    return "scene" if scene.proxy is None else "plan"


PART = Part(
    name="proxy",
    plan=_plan,
    items=_items,
    stages=(STAGE,),
    settle=_settle,
    ablations=(
        AblationItem(
            "proxy mesh",
            KIND,
            always("time"),
            without={"proxy": None},
            added=lambda scene: None if scene.editable else {"proxy": {"form": "merged"}},
            chosen_by=_chooser,
            for_each_transfer=True,
            with_everything=True,
        ),
    ),
)
