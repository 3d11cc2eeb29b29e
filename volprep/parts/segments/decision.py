"""Which textures and programs draw a scan with its segments, and what does not go with them.

Labels are one byte for each voxel beside its value, two above 127 labels, sampled nearest: the label, and a flag where
the cell that begins at the voxel has several. One fetch is enough where it has not, eight are needed where it has.
Without 3D textures they are mosaics of one slice in a texel.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from volprep.parts.case import Case
from volprep.parts.programs.decision import ray_casters, shader_files
from volprep.parts.segments.label_texture import LOOK_UNITS, label_texture
from volprep.parts.segments.look_format import look_format
from volprep.parts.segments.looks import segments_of
from volprep.parts.skip.decision import KIND as SKIP_KIND
from volprep.parts.skip.decision import SkipInputs, skip_together
from volprep.plan.item_kinds import SEGMENT_NAMES, SEGMENT_REMARK
from volprep.plan.products import LabelSetsPlan, LabelTexturePlan, SegmentsPlan, SkipTablePlan
from volprep.plan.records import LevelPlan
from volprep.plan.room import Misfit, if_held
from volprep.scan.segments.record import FoundSegments, VoxelBox
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import blocks_along
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.parts.segments.label_sets import sets_shape
from volprep_formats.package.parts.segments.record import COMPOSITED, OF_ONE_VALUE, Segments, table_shape
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.textures.texel_formats import TextureFormat, size_bytes


def style_boxes(scene: Scene, found: FoundSegments | None) -> dict[str, VoxelBox]:
    """Return, for each transfer function that shows labels, the box around their voxels; empty without segments.

    Raises VP3222 for a style of an unknown segment, VP3223 for an unknown transfer function.
    """
    if found is None or scene.segments is None:
        return {}
    record, order = segments_of(found, scene.segments, [transfer.name for transfer in scene.transfer], scene.name)
    of_style: dict[str, list[VoxelBox]] = {name: [] for name in record.transfers}
    for label, box in enumerate(found.boxes):
        if box is not None:
            of_style[record.labels[order[label]].transfer].append(box)
    return {name: _around(boxes) for name, boxes in of_style.items()}


def _around(boxes: Sequence[VoxelBox]) -> VoxelBox:
    z0, y0, x0 = (min((box.start_zyx[axis] for box in boxes), default=0) for axis in range(3))
    z1, y1, x1 = (max((box.stop_zyx[axis] for box in boxes), default=0) for axis in range(3))
    return VoxelBox(start_zyx=(z0, y0, x0), stop_zyx=(z1, y1, x1))


def style_blocks(
    record: Segments, found: FoundSegments | None, shape_zyx: tuple[int, int, int]
) -> dict[str, NDArray[np.bool_]]:
    """Return, for each transfer function that shows segments only, the measured blocks of the source that have any."""
    if found is None:
        return {}
    outside = {label.transfer for label in record.labels if not label.segments}
    bits = np.unpackbits(np.frombuffer(bytes.fromhex(found.blocks), np.uint8), count=math.prod(shape_zyx))
    blocks = bits.astype(np.bool_).reshape(shape_zyx)
    return {name: blocks for name in record.transfers if name not in outside}


KIND = "segments"
"""Kind of the item of the plan."""
LABEL_FORMATS: dict[bool, TextureFormat] = {False: "r8unorm", True: "rg8unorm"}
"""Format of labels, by whether they have two bytes."""
_CLASSIFICATIONS = frozenset(("lookup", "palette", "control-points"))


def with_segments(scene: Scene, _profile: DeviceProfile, channels: int) -> Scene:
    """Return the scene as segments need it: coarser levels are means, and shaders find the normals.

    Normals of borders change with what an app shows.

    Raises VP3220 for a scan of several channels.
    """
    if scene.segments is None:
        return scene
    if channels > 1:
        raise VolprepError("VP3220", path=scene.name, what="several channels", instead="name a source of one")
    update: dict[str, object] = {}
    if scene.pyramid.filter == "auto":
        update["pyramid"] = scene.pyramid.model_copy(update={"filter": "box"})
    if scene.lighting.normals == "volume":
        update["lighting"] = scene.lighting.model_copy(update={"normals": "central"})
    if scene.render.compositing == "maximum":
        # The greatest value wins even if its style hides it, so that no style can leave a part of the scan out.
        update |= {"crop": "none", "skip": scene.skip.model_copy(update={"kind": "none"})}
    return scene.model_copy(update=update)


def require_possible(scene: Scene, profile: DeviceProfile) -> None:
    """Raise VP3220 for what segments do not go with."""
    if scene.segments is None:
        return
    for what, wanted, instead in _obstacles(scene, profile):
        if wanted:
            raise VolprepError("VP3220", path=scene.name, what=what, instead=instead)


def _obstacles(scene: Scene, profile: DeviceProfile) -> Iterator[tuple[str, bool, str]]:
    """Return what segments do not go with, whether the scene wants it, and what it can have instead."""
    render = scene.render
    has_format = all(texel in profile.texture_formats for texel in LABEL_FORMATS.values())
    formats = "choose a profile with r8unorm and rg8unorm, as gles3 and gles2-4096"
    yield f"profile {profile.name}, whose textures have no one or two bytes", not has_format, formats
    yield f"profile {profile.name}, which has no shaders", not profile.has_shaders, formats
    rays = 'set render.technique = "ray-casting"'
    yield f"technique {render.technique}", TECHNIQUES[render.technique].order is not None, rays
    composited = f"set render.compositing to one of {', '.join(sorted(COMPOSITED))}"
    yield f"compositing {render.compositing}", render.compositing not in COMPOSITED, composited
    classified = 'set render.classification = "lookup"'
    yield f"classification {render.classification}", render.classification not in _CLASSIFICATIONS, classified
    if render.compositing in OF_ONE_VALUE:
        for name in ("isovalue", "reference_mm"):
            several = len({getattr(transfer, name) for transfer in scene.transfer}) > 1
            yield f"transfer functions of several {name}", several, f"give all of them the same {name}"
    yield f"lighting.baked {scene.lighting.baked}", scene.lighting.baked != "none", 'set lighting.baked = "none"'
    compression = scene.textures.compression
    yield f"textures.compression {compression}", compression != "none", 'set textures.compression = "none"'
    yield "textures.mipmaps", scene.textures.mipmaps, "set textures.mipmaps = false"
    if scene.grid is not None:
        # The file of the whole level has no labels.
        yield f"grid.layout {scene.grid.layout}", scene.grid.layout != "files", 'set grid.layout = "files"'
    for name in ("proxy", "normals", "together"):
        yield f"[{name}]", getattr(scene, name) is not None, "leave this table out"
    yield "editable", scene.editable, "set editable = false"
    yield "fidelity", scene.fidelity, "set fidelity = false"
    yield "a source of labels", bool(scene.source.labels), "name a scan as the source"


def within_styles(case: Case) -> Case:
    """Return the channel with the transfer functions that a picture of segments shows, and where each is shown.

    Raises VP3222 for a style of an unknown segment, VP3223 for an unknown transfer function.
    """
    if case.segments is None:
        return case
    boxes = style_boxes(case.scene, case.segments)
    functions = tuple(function for function in case.functions if function.name in boxes)
    return replace(case, functions=functions, boxes=boxes, drawn_alone=False)


def plan_segments(case: Case, empty_space: SkipInputs) -> SegmentsPlan | None:
    """Decide the picture of a scan with its segments.

    Raises VP3222 for a style of an unknown segment, VP3223 for an unknown transfer function, VP3224 where the profile
    has too few texture units.
    """
    scene, found, layout = case.scene, case.segments, case.layout
    if found is None or scene.segments is None:
        return None
    record, order = segments_of(found, scene.segments, [transfer.name for transfer in scene.transfer], scene.name)
    tables, _ = skip_tables(case, record, empty_space)
    sets, _ = label_sets(tables, layout.levels, case.profile)
    functions = len(record.transfers) if scene.render.classification == "lookup" else 0
    others = LOOK_UNITS + bool(tables) + functions
    format_ = if_held(LABEL_FORMATS[record.wide], case.profile)
    assert format_ is not None  # noqa: S101 - require_possible has found it
    return SegmentsPlan(
        **{name: getattr(record, name) for name in Segments.model_fields},
        order=order,
        format=format_,
        textures=tuple(_textures(case, record, others)),
        looks="textures/looks-segments.ktx2",
        look_format=look_format(record, case).format,
        programs=tuple(ray_casters(record.name, layout.volumes, scene)),
        skip_tables=tables,
        label_sets=sets,
    )


def _textures(case: Case, record: Segments, others: int) -> Iterator[LabelTexturePlan]:
    """Return the labels of each level; so many `others` need a texture unit.

    Raises VP3224 where the profile has too few.
    """
    layout = case.layout
    limit = case.profile.texture_units
    for level, volume in zip(layout.levels, layout.volumes, strict=True):
        taken = len(volume.files) + others
        texture = label_texture(level, case.profile, limit - taken, wide=record.wide)
        if isinstance(texture, Misfit) or taken + len(texture.files) > limit:
            count = taken + 1 if isinstance(texture, Misfit) else taken + len(texture.files)
            styles = len(record.transfers)
            raise VolprepError("VP3224", path=case.scene.name, count=count, styles=styles, limit=limit)
        yield texture


def skip_tables(case: Case, record: Segments, found: SkipInputs) -> tuple[tuple[SkipTablePlan, ...], PlanItem]:
    """Decide whether rays skip what no style shows, whatever the labels are."""
    functions = {function.name: function for function in case.functions}
    blocks = style_blocks(record, case.segments, found.measured.blocks.shape_zyx)
    media = [(functions[name], replace(found, among=blocks.get(name))) for name in record.transfers]
    tables, reason, size = skip_together(case.scene.skip, record.name, media, found.levels, hiding=True)
    files = tuple(table.file for table in tables)
    item = PlanItem(
        name=f"skip table {record.name}",
        kind=SKIP_KIND,
        transfer=record.name,
        kept=bool(tables),
        reason=reason,
        files=files,
        size_bytes=size,
    )
    return tables, item


def label_sets(
    tables: Sequence[SkipTablePlan], levels: Sequence[LevelPlan], profile: DeviceProfile
) -> tuple[tuple[LabelSetsPlan, ...], PlanItem]:
    """Decide whether an app can find the blocks that are empty while segments are hidden."""
    texel = if_held(LABEL_FORMATS[True], profile)
    assert texel is not None  # noqa: S101 - require_possible has found it
    found = []
    for table in tables:
        shape = next(level.shape_zyx for level in levels if level.index == table.level)
        blocks = math.prod(blocks_along(voxels, table.block) for voxels in shape)
        name = f"label-sets-{table.level}"
        found.append(
            LabelSetsPlan(
                level=table.level,
                name=name,
                file=f"textures/{name}.ktx2",
                block=table.block,
                format=texel,
                shape_zyx=(1, *sets_shape(blocks)),
            )
        )
    fits = all(max(texture.shape_zyx) <= profile.max_texture_size for texture in found)
    reason = "an app that hides segments makes skip tables from them, so that rays skip hidden segments"
    if not found:
        reason = "there are no skip tables"
    elif not fits:
        reason = f"they do not fit into a texture of profile {profile.name}, so rays sample hidden segments"
    kept = tuple(found) if fits else ()
    size = sum(size_bytes(texture.format, texture.shape_zyx) for texture in found)
    files = tuple(texture.file for texture in kept)
    item = PlanItem(
        name="labels of blocks", kind="label-sets", kept=bool(kept), reason=reason, files=files, size_bytes=size
    )
    return kept, item


def segment_items(plan: SegmentsPlan, found: FoundSegments, scene: Scene) -> Iterator[PlanItem]:
    """List the decisions about segments."""
    overlaps = sum(len(label.segments) > 1 for label in plan.labels)
    volume_bytes = sum(size_bytes(plan.format, texture.shape_zyx) * len(texture.files) for texture in plan.textures)
    unnamed = sum(segment.title is None for segment in plan.segments)
    yield PlanItem(
        name=plan.name,
        kind=KIND,
        transfer=plan.name,
        kept=True,
        reason=f"{len(plan.segments)} segments in {len(plan.labels)} labels, {overlaps} of them overlaps; borders "
        f"{plan.border}; styles {', '.join(plan.transfers)}; {1 + plan.wide} byte(s) more for each voxel",
        files=(
            *(file for texture in plan.textures for file in texture.files),
            *dict.fromkeys(path for program in plan.programs for path in shader_files(program)),
        ),
        size_bytes=volume_bytes,
    )
    yield PlanItem(
        name="looks of segments",
        kind="looks-of-segments",
        kept=True,
        reason="tint and opacity of each label, which an app changes to switch, tint and fade segments",
        files=(plan.looks,),
        size_bytes=size_bytes(plan.look_format, (1, *table_shape(len(plan.labels)))),
    )
    yield PlanItem(
        name="names of segments",
        kind=SEGMENT_NAMES,
        kept=not unnamed,
        reason=_names_reason(
            unnamed, len(plan.segments), free=scene.segments is not None and scene.segments.names == "free"
        ),
    )
    for transfer in scene.transfer:
        if transfer.name not in plan.transfers:
            reason = "no label has it as its style"
            yield PlanItem(name=f"transfer function {transfer.name}", kind="style", kept=False, reason=reason)
    for number, remark in enumerate(found.remarks, 1):
        yield PlanItem(name=f"source of segments {number}", kind=SEGMENT_REMARK, kept=True, reason=remark)


def _names_reason(unnamed: int, count: int, *, free: bool) -> str:
    if not unnamed:
        return "every segment has a name that may be written"
    if free:
        return f"{unnamed} of {count} segments have no name and are called by their numbers; a table gives them names"
    return (
        f"{unnamed} of {count} segments have no coded name and are called by their numbers; "
        'segments.names = "free" in a scene, or --segment-names free, writes typed names'
    )
