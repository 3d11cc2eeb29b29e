"""The part *fidelity*: a statement of how near pictures of each level are to the scan, if a scene asks for it."""

from volprep.parts.part import Part
from volprep.parts.source_field import source_field
from volprep.parts.stage import Stage, Work
from volprep.plan.records import Plan
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.fidelity.record import LevelFidelity
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: Plan) -> tuple[Record, ...]:
    return (plan,)


def _run(draft: Draft, _plan: Plan, progress: Progress) -> Contribution:
    """Measure each level with each transfer function. Raises the errors of drawing."""
    from volprep.parts.fidelity.measured import errors_of_views  # noqa: PLC0415 - loads OpenGL, as few stages do

    packages = channel_packages(Package.open(draft.folder, allow_draft=True)).values()
    progress.start("fidelity", len(packages))
    found: list[LevelFidelity] = []
    for package in packages:
        found += errors_of_views(package, source_field(draft, package.manifest))
        progress.advance()
    return Contribution(fidelity=tuple(found))


STAGE = Stage(
    name="fidelity",
    summary="Measure how near pictures of each level are to the scan.",
    reads=("transfer", "normals", "light", "mosaic", "texture", "bricks", "skip", "proxy", "slices", "shaders"),
    package=Work(_settings, _run),
    is_needed=lambda plan: plan.fidelity,
)


PART = Part(name="fidelity", devices="any", stages=(STAGE,))
