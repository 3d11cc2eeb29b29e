"""A draft becomes a package: draw the preview, fill in the cost of each item, drop the working data.

The contents of the package must match the plan, file for file and texel for texel.
"""

from volprep.parts.registry import PARTS
from volprep.parts.stage import Stage, Work
from volprep.pipeline.frames import STAGE as FRAMES
from volprep.plan.records import PREVIEW, Plan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Contribution, PlanItem
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: Plan) -> tuple[Record, ...]:
    return (plan,)


def _run(draft: Draft, _plan: Plan, progress: Progress) -> Contribution:
    from volprep.pipeline.preview import preview_png  # noqa: PLC0415 - loads OpenGL, which no other stage needs

    progress.start("seal", 1)
    package = Package.open(draft.folder, allow_draft=True)
    draft.write(PREVIEW, "preview", preview_png(package))
    progress.advance()
    return Contribution(preview=PREVIEW)


def settled(draft: Draft, plan: Plan) -> tuple[PlanItem, ...]:
    """Return the decisions, with the results that depend on the data, and with the real cost of each item.

    Raises VP4042 if the package does not match the plan.
    """
    sizes = {record.path: record.size_bytes for record in draft.files if record.role != "work"}
    items = plan.items
    for part in PARTS:
        items = part.settle(items, draft, plan)
    _check_plan(items, sizes)
    return tuple(_priced(item, sizes) for item in items)


def _check_plan(items: tuple[PlanItem, ...], sizes: dict[str, int]) -> None:
    """Raise VP4042 if a file is missing, or named by no plan item."""
    planned = [path for item in items for path in item.files]
    if sorted(planned) != sorted(sizes):
        odd = sorted(set(planned) ^ set(sizes)) or "one file of two items"
        raise VolprepError("VP4042", finding=f"the plan and the files differ in {odd}")


def _priced(item: PlanItem, sizes: dict[str, int]) -> PlanItem:
    """Replace the estimated size of each item that is kept by the size of its files."""
    if not item.files:
        return item
    return item.model_copy(update={"size_bytes": sum(sizes[path] for path in item.files)})


STAGE = Stage(
    name="seal",
    summary="Turn a draft into a package: draw the preview, write the checksums.",
    reads=(*(stage.name for part in PARTS for stage in part.stages), FRAMES.name),
    package=Work(_settings, _run),
    each_frame=False,
)
