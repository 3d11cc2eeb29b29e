"""Proxy geometry: for which transfer functions rays begin at a mesh, from the blocks that import measured.

Beginning later saves the samples in front of the first visible voxel, whether or not the ray ends in it, and all
samples of rays that meet none. Ending earlier saves those behind the last one, of rays that come so far. Hollows
between both are left to skip tables, which can be combined with it.
"""

import math
from collections.abc import Collection, Iterator

import numpy as np

from volprep.parts.programs.decision import shader_files
from volprep.parts.skip.decision import SkipInputs, measured_occupied
from volprep.parts.skip.occupancy import Occupied
from volprep.plan.products import ProxyMeshPlan, ProxyPlan
from volprep.scan.statistics import MEASURED_BLOCK
from volprep.scene.scene import ProxySettings
from volprep_formats.installation import require_extra
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.proxy.record import ProxyForm
from volprep_formats.package.program import ProgramDesign
from volprep_formats.package.transfer_function import TransferFunction

LEAST_SHARE = 0.1
"""Part of the samples that it must save. The two passes over a mesh of thousands of triangles cost a GPU little, but
the software driver as much as half of the samples of a small picture (bench_proxy.py: 48 % saved, 2.2 times slower with
9878 triangles; 75 % saved, 1.2 times faster with 1478)."""
KIND = "proxy"
"""Kind of its items of the plan."""
VERTEX = "shaders/proxy.vert"
"""Vertex shader of the programs; their passes have one of their own."""


def plan_proxy(
    wanted: ProxySettings,
    functions: tuple[TransferFunction, ...],
    programs: tuple[ProgramDesign, ...],
    found: SkipInputs,
) -> ProxyPlan:
    """Decide which transfer functions get meshes on which levels.

    Raises VP7005 for convex meshes without the extra `convex`.
    """
    if wanted.form == "convex":
        require_extra("convex")
    shares = tuple(
        saved_share(measured_occupied(function, wanted.epsilon, found), wanted.form) for function in functions
    )
    shown = [function.name for function, share in zip(functions, shares, strict=True) if share >= LEAST_SHARE]
    meshes = tuple(
        ProxyMeshPlan(transfer=transfer, level=level.index, file=f"meshes/proxy-{transfer}-{level.index}.glb")
        for transfer in shown
        for level in found.levels
    )
    return ProxyPlan(
        form=wanted.form,
        block=wanted.block,
        epsilon=wanted.epsilon,
        draco=wanted.draco,
        shares=shares,
        meshes=meshes,
        programs=tuple(proxy_program(program) for program in programs if program.transfer in shown),
    )


def saved_share(occupied: Occupied, form: ProxyForm) -> float:
    """Part of the samples in front of what a mesh of this form encloses, over rays along the six directions of axes."""
    enclosed = occupied
    if form in {"convex", "box"} and occupied.any():
        # The space between occupied blocks along an axis lies in their convex hull.
        for axis in (0, 1, 2):
            forth, back = (np.logical_or.accumulate(value, axis) for value in (enclosed, np.flip(enclosed, axis)))
            enclosed = forth & np.flip(back, axis)
    if form == "box" and occupied.any():
        ends = [np.nonzero(occupied.any(axis=tuple({0, 1, 2} - {axis})))[0] for axis in range(3)]
        enclosed = np.zeros_like(occupied)
        enclosed[tuple(slice(end[0], end[-1] + 1) for end in ends)] = True
    shares = []
    for axis in range(3):
        for forth in (enclosed, np.flip(enclosed, axis)):
            first = np.where(forth.any(axis=axis), forth.argmax(axis=axis), forth.shape[axis])
            shares.append(float(first.mean()) / forth.shape[axis])
    return math.fsum(shares) / len(shares)


def describe_proxy(
    plan: ProxyPlan | None, functions: tuple[TransferFunction, ...], found: SkipInputs, listed: Collection[str]
) -> Iterator[PlanItem]:
    """Return an item for each transfer function. Seal adds the meshes; some of them may be empty.

    Files of other items are `listed` there.
    """
    if plan is None:
        return
    known = set(listed)
    for function, share in zip(functions, plan.shares, strict=True):
        own = [path for program in plan.programs if program.transfer == function.name for path in shader_files(program)]
        files = tuple(path for path in dict.fromkeys(own) if path not in known)
        known.update(files)
        kept = share >= LEAST_SHARE
        reason = f"{share:.1%} of the samples lie in front of the mesh, in blocks of {MEASURED_BLOCK}³ voxels; "
        if share == 1.0:
            reason = "the transfer function shows nothing, so meshes and pictures are empty"
        elif kept:
            reason += f"form {plan.form}, blocks of {plan.block}³ cells"
        else:
            reason += f"below {LEAST_SHARE:.0%} a mesh may cost more time than it saves"
        yield PlanItem(
            name=f"proxy geometry {function.name}",
            kind=KIND,
            transfer=function.name,
            kept=kept,
            reason=reason,
            files=files,
            size_bytes=_likely_bytes(measured_occupied(function, plan.epsilon, found), plan.block),
        )


def _likely_bytes(occupied: Occupied, block: int) -> int:
    """Size of a mesh of blocks: 2 triangles of 12 bytes and about a vertex of 12 for each outer face."""
    solid = np.pad(occupied, 1)
    faces = sum(int(np.diff(solid.view(np.int8), axis=axis).astype(np.bool_).sum()) for axis in range(3))
    return math.ceil(faces * (MEASURED_BLOCK / block) ** 2 * 24)


def proxy_program(program: ProgramDesign) -> ProgramDesign:
    """Return the plan of the program that begins at meshes."""
    name = f"proxy-{program.name}"
    changes = {"name": name, "rays": "mesh", "vertex": VERTEX, "fragment": f"shaders/{name}.frag"}
    return program.model_copy(update=changes)
