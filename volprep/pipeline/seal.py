"""A draft becomes a package: draw the preview, fill in the cost of each item, drop the working data.

What is in the package must be what the plan says, file for file and texel for texel.
"""

from volprep.parts.levels.chosen import settled_items
from volprep.parts.proxy.decision import item_name
from volprep.parts.proxy.files import DRACO_RULE
from volprep.parts.stage import Stage, Work
from volprep.parts.subvolumes.decision import ITEM as SUBVOLUMES
from volprep.plan.records import PREVIEW, Plan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.manifest import Contribution, PlanItem
from volprep_formats.package.parts.costs.count import draw_costs
from volprep_formats.package.parts.fidelity.record import Fidelity
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: Plan) -> tuple[Record, ...]:
    return (plan,)


def _run(draft: Draft, plan: Plan, progress: Progress) -> Contribution:
    from volprep.pipeline.preview import preview_png  # noqa: PLC0415 - loads OpenGL, which no other stage needs

    progress.start("seal", 1)
    package = Package.open(draft.folder, allow_draft=True)
    draft.write(PREVIEW, "preview", preview_png(package))
    fidelity = _fidelity(draft, package) if plan.fidelity else ()
    progress.advance()
    return Contribution(preview=PREVIEW, fidelity=fidelity, costs=draw_costs(package.manifest))


def _fidelity(draft: Draft, package: Package) -> tuple[Fidelity, ...]:
    """Measure each level with each transfer function. Raises what drawing raises."""
    from volprep.parts.fidelity import measure as of  # noqa: PLC0415 - as above
    from volprep.parts.source_field import source_field  # noqa: PLC0415 - as above

    found: list[Fidelity] = []
    for part in channel_packages(package).values():
        manifest = part.manifest
        projection = manifest.render.projection if manifest.render else "orthographic"
        cameras = of.cameras_from(manifest.levels[0].grid, of.spiral(of.VIEWS), projection)
        found += [of.stated(each) for each in of.measure(part, source_field(draft, manifest), cameras)]
    return tuple(found)


def settled(draft: Draft, plan: Plan) -> tuple[PlanItem, ...]:
    """Return what was decided, with what only the data could decide, and with what each item really costs.

    Raises VP4042 if the package is not what the plan says.
    """
    sizes = {record.path: record.size_bytes for record in draft.files if record.role != "work"}
    items = tuple(_with_pieces(item, draft) for item in settled_items(plan.items, draft, plan))
    _check_plan(items, sizes)
    return tuple(_priced(item, sizes) for item in items)


def _with_pieces(item: PlanItem, draft: Draft) -> PlanItem:
    """Add pieces of level 0 and meshes to the item that they belong to: which are empty was not known before."""
    meshes = draft.manifest.proxy.meshes if draft.manifest.proxy else ()
    own = {mesh.file: mesh.draco for mesh in meshes if mesh.file and item.name == item_name(mesh.transfer)}
    if own:
        reason = f"{item.reason}; {sum(own.values())} of {len(own)} files compressed with Draco, {DRACO_RULE}"
        return item.model_copy(update={"files": (*item.files, *own), "reason": reason})
    found = draft.manifest.subvolumes
    if item.name != SUBVOLUMES or found is None:
        return item
    return item.model_copy(update={"files": (*item.files, *found.pieces)})


def _check_plan(items: tuple[PlanItem, ...], sizes: dict[str, int]) -> None:
    """Raise VP4042 if a file is missing or nobody's."""
    planned = [path for item in items for path in item.files]
    if sorted(planned) != sorted(sizes):
        odd = sorted(set(planned) ^ set(sizes)) or "one file of two items"
        raise VolprepError("VP4042", finding=f"the plan and the files differ in {odd}")


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
    package=Work(_settings, _run),
)
