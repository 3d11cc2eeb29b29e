"""Level 0 in sub-volumes, for scans that a device cannot hold whole at full resolution."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from volprep.parts.mosaic.decision import mosaic_text
from volprep.parts.programs.decision import VERTEX, light_of
from volprep.parts.subvolumes.cuts import cuts_along
from volprep.parts.subvolumes.piece import HELD, Form, PieceVoxels, classification_of, file_bytes, form_of
from volprep.plan.products import SegmentsPlan, SubvolumesPlan
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep.plan.room import Misfit
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import LAID_OVER, ClassificationName, CompositingName, NormalsFrom, ProgramDesign
from volprep_formats.package.texture import SampleFilter

GRID = "subvolumes/grid.json"
"""File that says where level 0 is cut."""
KIND = "sub-volumes"
"""Kind of its item of the plan."""
PUT_TOGETHER: frozenset[CompositingName] = LAID_OVER | {"first-hit"}
"""Compositings whose pictures of blocks behind each other make that of the whole: laid over each other; of first hits
that of the first block that has one."""
_LEAST_SIZE = 16
"""Voxels of a piece along an axis: smaller ones are not proposed, a sixth of them would be layers that are shared."""


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


def propose(scene: Scene, profile: DeviceProfile, grid: Grid, voxels: PieceVoxels) -> Proposal | Misfit:
    """Propose the fewest pieces, nearly of one size, such that a device holds eight in half of its memory.

    The other half is for a coarser level and all other textures.
    """
    if scene.render.classification == "preclassified":
        return Misfit("pieces hold values, and the voxels of this scene are classified")
    classified = classification_of(scene, profile, voxels)
    if isinstance(classified, Misfit):
        return classified
    cells = max(grid.shape_zyx) - 1
    for pieces in range(1, max(-(-cells // (_LEAST_SIZE - 1)), 1) + 1):
        size = -(-cells // pieces) + 1 + 2 * voxels.ghost
        # A cube counts, so that a flat volume is cut as a deep one of its length.
        form = form_of(scene, profile, Grid.of((size,) * 3, (1.0,) * 3), size, voxels)
        if isinstance(form, Form) and form.held_bytes <= profile.max_texture_bytes // 2:
            own = form_of(scene, profile, grid, size, voxels)
            assert isinstance(own, Form)  # noqa: S101 - it takes no more than the cube
            return Proposal(
                size, _counts(grid, size, voxels.ghost), file_bytes(own, grid, size, voxels.ghost), own.held_bytes
            )
    return Misfit(f"pieces of {_LEAST_SIZE} voxels along an axis are more than profile {profile.name} can hold")


def plan_subvolumes(  # noqa: PLR0917 - what the decision rests on
    scene: Scene,
    profile: DeviceProfile,
    grid: Grid,
    voxels: PieceVoxels,
    volumes: tuple[VolumePlan, ...],
    pictures: tuple[str, ...],
) -> SubvolumesPlan | None:
    """Decide how level 0 is cut, and that `pictures` are drawn from the pieces.

    Raises VP3030 where the profile cannot hold eight pieces of the size in the scene.
    """
    wanted = scene.grid
    if wanted is None:
        return None
    size: int | Literal["auto"] = wanted.size
    if size == "auto":
        proposed = propose(scene, profile, grid, voxels)
        if not volumes[0].level or isinstance(proposed, Misfit):
            return None
        size = proposed.size
    form, classified = form_of(scene, profile, grid, size, voxels), classification_of(scene, profile, voxels)
    for outcome in (form, classified):
        if isinstance(outcome, Misfit):
            raise VolprepError("VP3030", profile=profile.name, size=size, reason=outcome.reason)
    assert isinstance(form, Form)  # noqa: S101 - the alternative is a Misfit
    assert not isinstance(classified, Misfit)  # noqa: S101 - the same
    if form.held_bytes > profile.max_texture_bytes:
        most = profile.max_texture_bytes
        reason = f"{HELD} of them take {form.held_bytes} bytes, more than the {most} for textures"
        raise VolprepError("VP3030", profile=profile.name, size=size, reason=reason)
    # A level 0 that the package has anyway as one 3D texture is the file to seek in.
    finest = volumes[0].files[0] if _is_whole(volumes[0]) else "subvolumes/whole.ktx2"
    return SubvolumesPlan(
        size=size,
        format=form.format,
        mosaic=form.mosaic,
        label_bytes=voxels.label_bytes,
        ghost=voxels.ghost,
        pieces=wanted.layout != "single",
        whole=None if wanted.layout == "files" else finest,
        keep_empty=scene.crop == "none",
        programs=tuple(_program(picture, scene, classified) for picture in pictures if wanted.layout != "single"),
    )


def _counts(grid: Grid, size: int, ghost: int) -> tuple[int, int, int]:
    """Return how many pieces there are along each axis."""
    z, y, x = (len(cuts_along(n, size, ghost=ghost)) - 1 for n in grid.shape_zyx)
    return z, y, x


def _is_whole(finest: VolumePlan) -> bool:
    return not (finest.level or finest.mosaic or finest.bricks)


def _program(picture: str, scene: Scene, classified: ClassificationName) -> ProgramDesign:
    name = f"subvolumes-{picture}"
    lit = _is_lit(scene)
    return ProgramDesign(
        name=name,
        sampling="subvolumes",
        compositing=scene.render.compositing,
        classification=classified,
        lighting=scene.render.lighting if lit else "none",
        normals_from=_slopes(scene) if lit else "volume",
        light=light_of(scene) if lit else None,
        baked=scene.lighting.baked != "none",
        vertex=VERTEX,
        fragment=f"shaders/{name}.frag",
        levels=(0,),
        transfer=picture,
    )


def voxels_of(scene: Scene, bits: int, between: SampleFilter, segments: SegmentsPlan | None) -> PieceVoxels:
    """Return what pieces hold of each voxel, and of those around them."""
    # Samples are lit by the voxels around them, also in the outermost layers of a block. The whole level needs no more.
    ghost = int((scene.grid is None or scene.grid.layout != "single") and _is_lit(scene))
    if segments:
        return PieceVoxels(bits, between, 1 + segments.wide, len(segments.transfers), ghost)
    return PieceVoxels(bits, between, ghost=ghost)


def _voxels(plan: ChannelPlan, scene: Scene) -> PieceVoxels:
    return voxels_of(scene, plan.quantize.bits, plan.quantize.filter, plan.part(SegmentsPlan))


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
    form = form_of(scene, plan.profile, plan.grid, subvolumes.size, _voxels(plan, scene))
    assert isinstance(form, Form)  # noqa: S101 - as it was decided
    fits = ", although the whole volume fits into one texture" if whole_fits else ""
    asked = "the scene asks for them" if scene.must_be_cut else "the whole volume does not fit into one texture"
    counts = shape_text(_counts(plan.grid, subvolumes.size, subvolumes.ghost))
    files = [GRID, *(program.fragment for program in subvolumes.programs)]
    if subvolumes.whole is not None and all(subvolumes.whole not in volume.files for volume in plan.volumes):
        files.append(subvolumes.whole)
    yield PlanItem(
        name="sub-volumes",
        kind=KIND,
        kept=True,
        reason=f"{asked}{fits}: {counts} pieces of at most {subvolumes.size} voxels along an axis; neighbours share "
        f"{_shared_text(subvolumes)}"
        f"{_texture_text(subvolumes, plan, scene)}{_light_text(scene)}",
        files=tuple(files),
        size_bytes=file_bytes(form, plan.grid, subvolumes.size, subvolumes.ghost),
    )


def _is_lit(scene: Scene) -> bool:
    """Return whether pieces are lit: those whose pictures an app puts together, and validation judges so."""
    return scene.render.lighting != "none" and _why_unlit(scene) is None


def _why_unlit(scene: Scene) -> str | None:
    """Return why pieces are never lit; None if they may be."""
    compositing = scene.render.compositing
    if scene.source.labels:
        return "pieces hold no normals, and differences would depend on how labels are numbered"
    if compositing not in PUT_TOGETHER:
        return f"pictures of {compositing} are not put together"
    if compositing == "first-hit" and scene.segments is not None:
        # Six visible values, each of eight labels in one of eight pieces: Mesa compiled for 62 seconds.
        return "a driver may compile the labels around a hit for a minute"
    return None


def _slopes(scene: Scene) -> NormalsFrom:
    """Return the source of normals for lit pieces: textures of normals would exceed 16 units."""
    return "forward" if scene.lighting.normals == "forward" else "central"


def _shared_text(subvolumes: SubvolumesPlan) -> str:
    return "three layers of voxels, for light at their faces" if subvolumes.ghost else "a layer of voxels"


def _texture_text(subvolumes: SubvolumesPlan, plan: ChannelPlan, scene: Scene) -> str:
    text = "" if subvolumes.mosaic is None else f"; each piece is a {mosaic_text(subvolumes.mosaic)}"
    if subvolumes.label_bytes:
        text += "; a texel holds the value of a voxel and its label"
    if {program.classification for program in subvolumes.programs} - {scene.render.classification}:
        units = plan.profile.texture_units
        text += f", and samples are classified by the control points, since tables beside {HELD} pieces take more than "
        text += f"the {units} units"
    return text


def _light_text(scene: Scene) -> str:
    if scene.render.lighting == "none":
        return ""
    why = _why_unlit(scene)
    if why is not None:
        return f"; they are drawn without light, since {why}"
    return f"; they are lit by {_slopes(scene)} differences of their values"


def _left_out(scene: Scene, plan: ChannelPlan) -> PlanItem:
    proposed = propose(scene, plan.profile, plan.grid, _voxels(plan, scene))
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
