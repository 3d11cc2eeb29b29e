"""Level 0 in sub-volumes, for scans that a device cannot hold whole at full resolution."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from volprep.parts.programs.decision import VERTEX, light_of
from volprep.parts.subvolumes.cuts import cuts_along
from volprep.plan.products import SubvolumesPlan
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep.plan.room import Misfit, one_channel
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile, TextureFormat
from volprep_formats.package.program import NormalsFrom, ProgramDesign
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures.gl_formats import BYTES_PER_TEXEL

GRID = "subvolumes/grid.json"
"""File that says where level 0 is cut."""
KIND = "sub-volumes"
"""Kind of its item of the plan."""
_LEAST_SIZE = 16
"""Voxels of a piece along an axis: smaller ones are not proposed, a sixth of them would be layers that are shared."""
_HELD = 8
"""Pieces that a device draws at a time: those around a point."""


@dataclass(frozen=True)
class Proposal:
    """How level 0 could be cut for a device class that cannot hold it whole."""

    size: int
    """Largest number of voxels along an axis of a piece."""
    pieces_zyx: tuple[int, int, int]
    """Number of pieces along each axis."""
    file_bytes: int
    """Size of all pieces."""
    device_bytes: int
    """Size of the textures of the pieces that a device draws at a time."""


def propose(scene: Scene, profile: DeviceProfile, grid: Grid, bits: int) -> Proposal | Misfit:
    """Propose the fewest pieces, nearly of one size, such that a device holds eight in half of its memory.

    The other half is for a coarser level and all other textures.
    """
    if scene.render.classification == "preclassified":
        return Misfit("pieces hold values, and the voxels of this scene are classified")
    texel = one_channel(bits, profile)
    if texel is None or not profile.max_3d_texture_size:
        return Misfit(f"profile {profile.name} has no 3D textures that could hold pieces")
    most = profile.max_texture_bytes // (2 * _HELD * BYTES_PER_TEXEL[texel])
    # The roots of cubes of whole numbers are not always rounded to these.
    edge = min(int(most ** (1 / 3) + 1e-6), profile.max_3d_texture_size)
    if edge < _LEAST_SIZE:
        return Misfit(f"pieces of {_LEAST_SIZE} voxels along an axis are more than profile {profile.name} can hold")
    between = max(grid.shape_zyx) - 1
    size = -(-between // -(-between // (edge - 1))) + 1
    pieces_zyx, file_bytes = _pieces(grid, size, texel)
    return Proposal(size, pieces_zyx, file_bytes, _held_bytes(grid, size, texel))


def plan_subvolumes(  # noqa: PLR0917 - what the decision rests on
    scene: Scene,
    profile: DeviceProfile,
    grid: Grid,
    bits: int,
    volumes: tuple[VolumePlan, ...],
    functions: tuple[TransferFunction, ...],
) -> SubvolumesPlan | None:
    """Decide how level 0 is cut. Raises VP3030 where the profile cannot hold eight pieces of the size in the scene."""
    wanted = scene.grid
    if wanted is None:
        return None
    size: int | Literal["auto"] = wanted.size
    if size == "auto":
        proposed = propose(scene, profile, grid, bits)
        if volumes[0].level == 0 or isinstance(proposed, Misfit):
            return None
        size = proposed.size
    texel = one_channel(bits, profile)
    if texel is None or size > profile.max_3d_texture_size:
        reason = f"3D textures hold at most {profile.max_3d_texture_size} along an axis"
        raise VolprepError("VP3030", profile=profile.name, size=size, reason=reason)
    held = _held_bytes(grid, size, texel)
    if held > profile.max_texture_bytes:
        reason = f"eight of them take {held} bytes, more than the {profile.max_texture_bytes} for textures"
        raise VolprepError("VP3030", profile=profile.name, size=size, reason=reason)
    # A level 0 that the package has anyway as one 3D texture is the file to seek in.
    finest = volumes[0].files[0] if _is_whole(volumes[0]) else "subvolumes/whole.ktx2"
    return SubvolumesPlan(
        size=size,
        format=texel,
        pieces=wanted.layout != "single",
        whole=None if wanted.layout == "files" else finest,
        keep_empty=scene.crop == "none",
        programs=tuple(_program(function, scene) for function in functions if wanted.layout != "single"),
    )


def _held_bytes(grid: Grid, size: int, texel: TextureFormat) -> int:
    """Return the bytes of the pieces that a device draws at a time."""
    return _HELD * math.prod(min(n, size) for n in grid.shape_zyx) * BYTES_PER_TEXEL[texel]


def _pieces(grid: Grid, size: int, texel: TextureFormat) -> tuple[tuple[int, int, int], int]:
    """Return how many pieces there are along each axis, and the bytes of all of them."""
    z, y, x = (len(cuts_along(n, size)) - 1 for n in grid.shape_zyx)
    voxels = math.prod(n + count - 1 for n, count in zip(grid.shape_zyx, (z, y, x), strict=True))
    return (z, y, x), voxels * BYTES_PER_TEXEL[texel]


def _is_whole(finest: VolumePlan) -> bool:
    return finest.level == 0 and finest.mosaic is None and finest.bricks is None


def _program(function: TransferFunction, scene: Scene) -> ProgramDesign:
    name = f"subvolumes-{function.name}"
    lit = _is_lit(scene)
    return ProgramDesign(
        name=name,
        sampling="subvolumes",
        compositing=scene.render.compositing,
        classification=scene.render.classification,
        lighting=scene.render.lighting if lit else "none",
        normals_from=_slopes(scene) if lit else "volume",
        light=light_of(scene) if lit else None,
        baked=scene.lighting.baked != "none",
        vertex=VERTEX,
        fragment=f"shaders/{name}.frag",
        levels=(0,),
        transfer=function.name,
    )


def describe_subvolumes(plan: ChannelPlan, scene: Scene) -> Iterator[PlanItem]:
    """Return whether there are sub-volumes, and why; where the scene could have some, also their layout and cost."""
    subvolumes = plan.part(SubvolumesPlan)
    whole_fits = plan.levels[0].index == 0
    if subvolumes is None:
        if whole_fits:
            yield PlanItem(name="sub-volumes", kind=KIND, kept=False, reason="the whole volume fits into one texture")
        else:
            yield _left_out(scene, plan)
        return
    pieces_zyx, size_bytes = _pieces(plan.grid, subvolumes.size, subvolumes.format)
    fits = ", although the whole volume fits into one texture" if whole_fits else ""
    asked = "the scene asks for them" if scene.must_be_cut else "the whole volume does not fit into one texture"
    files = [GRID, *(program.fragment for program in subvolumes.programs)]
    if subvolumes.whole is not None and all(subvolumes.whole not in volume.files for volume in plan.volumes):
        files.append(subvolumes.whole)
    yield PlanItem(
        name="sub-volumes",
        kind=KIND,
        kept=True,
        reason=f"{asked}{fits}: {shape_text(pieces_zyx)} pieces of at most {subvolumes.size} voxels along an axis; "
        f"neighbours share a layer of voxels{_light_text(scene)}",
        files=tuple(files),
        size_bytes=size_bytes,
    )


def _is_lit(scene: Scene) -> bool:
    """Return whether pieces are lit: those whose pictures an app lays over each other, and validation judges so."""
    return scene.render.lighting != "none" and scene.render.compositing in {"emission-absorption", "back-to-front"}


def _slopes(scene: Scene) -> NormalsFrom:
    """Return the source of normals for lit pieces: textures of normals would exceed 16 units."""
    return "forward" if scene.lighting.normals == "forward" else "central"


def _light_text(scene: Scene) -> str:
    if scene.render.lighting == "none":
        return ""
    if not _is_lit(scene):
        return f"; they are drawn without light, since pictures of {scene.render.compositing} are not put together"
    return f"; they are lit by {_slopes(scene)} differences of their values"


def _left_out(scene: Scene, plan: ChannelPlan) -> PlanItem:
    proposed = propose(scene, plan.profile, plan.grid, plan.quantize.bits)
    if isinstance(proposed, Misfit):
        return PlanItem(name="sub-volumes", kind=KIND, kept=False, reason=proposed.reason)
    return PlanItem(
        name="sub-volumes",
        kind=KIND,
        kept=False,
        reason=f"the scene has no table [grid]. With size = {proposed.size} level 0 is "
        f"{shape_text(proposed.pieces_zyx)} pieces, of which a device draws eight at a time in {proposed.device_bytes} "
        f'bytes of textures; --grid auto, or a table [grid] with size = "auto", takes that',
        size_bytes=proposed.file_bytes,
    )
