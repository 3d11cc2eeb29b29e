"""A draft becomes a package: draw the preview, fill in the cost of each item, drop the working data.

What is in the package must be what the plan says, file for file and texel for texel.
"""

import math

from volprep.parts.levels.chosen import lookup_of_level, own_tables, settled_items
from volprep.parts.proxy.decision import item_of_proxy
from volprep.parts.proxy.files import DRACO_RULE
from volprep.parts.stage import Changes, Stage
from volprep.parts.subvolumes.decision import ITEM as SUBVOLUMES
from volprep.plan.records import PREVIEW, Plan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: Plan) -> tuple[Record, ...]:
    return (plan,)


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    from volprep.pipeline.preview import preview_png  # noqa: PLC0415 - loads OpenGL, which no other stage needs

    progress.start("seal", 1)
    picture = preview_png(Package.open(draft.folder, allow_draft=True))
    draft.write(PREVIEW, "preview", picture)
    sizes = {record.path: record.size_bytes for record in draft.manifest.files if record.role != "work"}
    sizes[PREVIEW] = len(picture)
    items = tuple(_with_pieces(item, draft) for item in settled_items(plan.items, draft, plan))
    _check_plan(draft, plan, items, sizes)
    progress.advance()
    return {"preview": PREVIEW, "plan": tuple(_priced(item, sizes) for item in items), "state": "sealed"}


def _with_pieces(item: PlanItem, draft: Draft) -> PlanItem:
    """Add pieces of level 0 and meshes to the item that they belong to: which are empty was not known before."""
    meshes = draft.manifest.proxy.meshes if draft.manifest.proxy else ()
    own = {mesh.file: mesh.draco for mesh in meshes if mesh.file and item_of_proxy(mesh.transfer, item.name)}
    if own:
        reason = f"{item.reason}; {sum(own.values())} of {len(own)} files compressed with Draco, {DRACO_RULE}"
        return item.model_copy(update={"files": (*item.files, *own), "reason": reason})
    found = draft.manifest.subvolumes
    if item.name != SUBVOLUMES or found is None:
        return item
    return item.model_copy(update={"files": (*item.files, *found.pieces)})


def _check_plan(draft: Draft, plan: Plan, items: tuple[PlanItem, ...], sizes: dict[str, int]) -> None:
    """Raise VP4042 if a file is missing or belongs to nothing, or if a texture has another size than was planned."""
    planned = [path for item in items for path in item.files]
    if sorted(planned) != sorted(sizes):
        odd = sorted(set(planned) ^ set(sizes)) or "one file of two items"
        raise VolprepError("VP4042", finding=f"the plan and the files differ in {odd}")
    shapes = {path: shape for each in plan.every for path, shape in _shapes(each, draft).items()}
    found = {texture.file: texture.shape_zyx for texture in draft.manifest.textures}
    if found != shapes:
        raise VolprepError("VP4042", finding=f"textures are {found}, planned {shapes}")


def _shapes(plan: Plan, draft: Draft) -> dict[str, tuple[int, int, int]]:
    """Shapes of the textures of one channel by their files, in texels."""
    shapes = {path: volume.shape_zyx for volume in plan.volumes for path in volume.files}
    shapes |= _shapes_of_bricks(plan, draft)
    for lookup in plan.lookups:
        own = own_tables(draft, plan, lookup.transfer)
        if own.keys() != {level.index for level in plan.levels}:
            shapes[lookup.file] = (1, 1, lookup.entries)
        shapes |= {lookup_of_level(lookup, level).file: (1, 1, lookup.entries) for level in own}
    shapes |= {table.file: (1, table.entries, table.entries) for table in plan.preintegrated}
    if plan.skip is not None:
        shapes |= {table.file: table.shape_zyx for table in plan.skip.tables}
        shapes |= {ranges.file: ranges.shape_zyx for ranges in plan.skip.ranges}
    if plan.together is not None:
        shapes |= {table.file: table.shape_zyx for table in plan.together.skip_tables}
    if plan.slices is not None:
        shapes |= {each.file: (1, *each.shape_yx) for stack in plan.slices.stacks for each in stack.textures}
    if plan.normals is not None:
        shapes |= {path: texture.shape_zyx for texture in plan.normals.textures for path in texture.files}
    return shapes


def _shapes_of_bricks(plan: Plan, draft: Draft) -> dict[str, tuple[int, int, int]]:
    """Shapes that follow from what is stored, if that takes no more than the plan has found room for."""
    found = {texture.file: texture for texture in draft.manifest.textures}
    shapes: dict[str, tuple[int, int, int]] = {}
    for volume in plan.volumes:
        layout = found[volume.files[0]].bricks if volume.files[0] in found else None
        if volume.bricks is not None and layout is not None:
            shapes[volume.bricks.file] = layout.bricks_zyx
            if math.prod(layout.texture_zyx) <= math.prod(volume.shape_zyx):
                shapes[volume.files[0]] = layout.texture_zyx
    return shapes


def _priced(item: PlanItem, sizes: dict[str, int]) -> PlanItem:
    """Replace the size of what is kept by that of its files."""
    if not item.files:
        return item
    return item.model_copy(update={"size_bytes": sum(sizes[path] for path in item.files)})


STAGE = Stage(
    name="seal",
    reads=(
        "quantize",
        "pyramid",
        "transfer",
        "normals",
        "mosaic",
        "texture",
        "bricks",
        "skip",
        "proxy",
        "grid",
        "slices",
        "shaders",
    ),
    settings=_settings,
    run=_run,
    whole=True,
)
