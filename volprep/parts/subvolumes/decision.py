"""Level 0 in sub-volumes, for scans that a device cannot hold whole at full resolution."""

import math
from collections.abc import Iterator

from volprep.parts.levels.decision import by
from volprep.parts.programs.decision import VERTEX
from volprep.parts.subvolumes.cuts import cuts_along
from volprep.plan.products import SubvolumesPlan
from volprep.plan.records import LevelPlan, VolumePlan
from volprep.plan.room import one_channel
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ProgramDesign
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures.gl_formats import BYTES_PER_TEXEL

GRID = "subvolumes/grid.json"
"""File that says where level 0 is cut."""
ITEM = "sub-volumes"
"""Name of the item; seal adds the files of the pieces, since only the stage knows which are empty."""
_HELD = 8
"""Pieces that a device draws at a time: those around a point."""


def plan_subvolumes(  # noqa: PLR0917 - what the decision rests on
    scene: Scene,
    profile: DeviceProfile,
    grid: Grid,
    bits: int,
    volumes: tuple[VolumePlan, ...],
    functions: tuple[TransferFunction, ...],
) -> SubvolumesPlan | None:
    """Decide how level 0 is cut. Raises VP3030 where the profile cannot hold eight pieces of this size."""
    wanted = scene.grid
    if wanted is None:
        return None
    texel = one_channel(bits, profile)
    largest = math.prod(min(n, wanted.size) for n in grid.shape_zyx)
    if texel is None or wanted.size > profile.max_3d_texture_size:
        reason = f"3D textures hold at most {profile.max_3d_texture_size} along an axis"
        raise VolprepError("VP3030", profile=profile.name, size=wanted.size, reason=reason)
    size = _HELD * largest * BYTES_PER_TEXEL[texel]
    if size > profile.max_texture_bytes:
        reason = f"eight of them take {size} bytes, more than the {profile.max_texture_bytes} for textures"
        raise VolprepError("VP3030", profile=profile.name, size=wanted.size, reason=reason)
    # A level 0 that the package has anyway as one 3D texture is the file to seek in.
    finest = volumes[0].files[0] if _is_whole(volumes[0]) else "subvolumes/whole.ktx2"
    return SubvolumesPlan(
        size=wanted.size,
        format=texel,
        pieces=wanted.layout != "single",
        whole=None if wanted.layout == "files" else finest,
        keep_empty=scene.crop == "none",
        programs=tuple(_program(function, scene) for function in functions if wanted.layout != "single"),
    )


def _is_whole(finest: VolumePlan) -> bool:
    return finest.level == 0 and finest.mosaic is None and finest.bricks is None


def _program(function: TransferFunction, scene: Scene) -> ProgramDesign:
    name = f"subvolumes-{function.name}"
    return ProgramDesign(
        name=name,
        technique="raycast_subvolumes",
        compositing=scene.render.compositing,
        classification=scene.render.classification,
        lighting="none",
        vertex=VERTEX,
        fragment=f"shaders/{name}.frag",
        levels=(0,),
        transfer=function.name,
    )


def describe_subvolumes(
    plan: SubvolumesPlan | None, grid: Grid, levels: tuple[LevelPlan, ...], volumes: tuple[VolumePlan, ...]
) -> Iterator[PlanItem]:
    """Return whether there are sub-volumes, and why."""
    whole_fits = levels[0].index == 0
    if plan is None:
        if whole_fits:
            yield PlanItem(name=ITEM, kept=False, reason="the whole volume fits into one texture")
        else:
            yield PlanItem(name=ITEM, kept=False, reason="the scene has no table [grid]")
        return
    counts = [len(cuts_along(n, plan.size)) - 1 for n in grid.shape_zyx]
    z, y, x = counts
    fits = ", although the whole volume fits into one texture" if whole_fits else ""
    files = [GRID, *(program.fragment for program in plan.programs)]
    if plan.whole is not None and all(plan.whole not in volume.files for volume in volumes):
        files.append(plan.whole)
    yield PlanItem(
        name=ITEM,
        kept=True,
        reason=f"the scene asks for them{fits}: {by((z, y, x))} pieces of at most {plan.size} voxels along an axis; "
        "neighbours share a layer of voxels",
        files=tuple(files),
        size_bytes=math.prod(n + c - 1 for n, c in zip(grid.shape_zyx, counts, strict=True))
        * BYTES_PER_TEXEL[plan.format],
    )
