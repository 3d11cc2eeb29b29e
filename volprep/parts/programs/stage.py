"""Shaders are composed and specialised: the text that the package ships and the reference renderer runs."""

from collections.abc import Collection, Sequence

from volprep.parts.programs.composed import composed
from volprep.parts.stage import Stage, Work
from volprep.plan.products import ProxyPlan, SkipPlan
from volprep.plan.records import ChannelPlan, Plan
from volprep.shading.overlay import overlay_texts
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.program import ComposedProgram, ProgramDesign, RaySampling
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record, present


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (
        plan.grid,
        plan.rays,
        *plan.levels,
        *plan.volumes,
        *plan.tables,
        *plan.programs,
        *plan.programs_beside_levels,
        *(program for part in (plan.part(ProxyPlan),) if part for program in part.programs),
    )


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    meshes, skip = plan.part(ProxyPlan), plan.part(SkipPlan)
    # A draft may hold programs of what a stage has not made yet.
    made = {"subvolumes": draft.manifest.subvolumes, "on-demand": draft.manifest.on_demand}
    beside = tuple(program for program in plan.programs_beside_levels if made[program.sampling] is not None)
    at_meshes = () if meshes is None or draft.manifest.proxy is None else meshes.programs
    designs = (*plan.programs, *beside, *at_meshes)
    progress.start("shaders", len(designs))
    skipping = set() if skip is None else {table.transfer for table in skip.tables}
    writer = _Writer(draft, plan.rays, skipping, progress)
    return Contribution(programs=writer.programs(designs))


def _settings_together(plan: Plan) -> tuple[Record, ...]:
    parts = [(*plan_of_one.levels, *plan_of_one.volumes, *plan_of_one.tables) for plan_of_one in plan.drawn_together]
    return (*present(plan.joint), plan.shared, *(record for part in parts for record in part))


def _run_together(draft: Draft, plan: Plan, progress: Progress) -> Contribution:
    """Write what puts a small picture between lines, and the programs of the picture of several channels."""
    hybrid = plan.shared.render.hybrid
    for name, pair in () if hybrid is None else hybrid.pairs.items():
        texts = overlay_texts(name, plan.shared.profile.dialect)
        for path, text in zip((pair.vertex, pair.fragment), texts, strict=True):
            draft.write(path, "shader", text.encode("ascii"))
    if plan.joint is None:
        return Contribution()
    progress.start("shaders", len(plan.joint.programs))
    skipping = {plan.joint.name} if plan.joint.skips else set()
    writer = _Writer(draft, plan.shared.rays, skipping, progress)
    return Contribution(programs=writer.programs(plan.joint.programs))


class _Writer:
    """Composes programs and writes their shaders, which programs may share, once each."""

    def __init__(self, draft: Draft, rays: RaySampling, skipping: Collection[str], progress: Progress) -> None:
        self._draft = draft
        self._package = Package(draft.folder, draft.manifest)
        self._rays = rays
        # A draft may still hold tables that are no longer wanted.
        self._skipping = skipping
        self._progress = progress
        self._written: set[str] = set()

    def programs(self, designs: Sequence[ProgramDesign]) -> tuple[ComposedProgram, ...]:
        return tuple(self._program(design) for design in designs)

    def _program(self, design: ProgramDesign) -> ComposedProgram:
        skips = design.transfer in self._skipping
        program, texts = composed(self._package, design, self._rays, skips=skips)
        for path, text in texts.items():
            if path not in self._written:
                self._draft.write(path, "shader", text.encode("ascii"))
                self._written.add(path)
        self._progress.advance()
        return program


STAGE = Stage(
    name="shaders",
    summary="Write the shaders of the package, specialised for it.",
    reads=(
        "quantize",
        "pyramid",
        "transfer",
        "normals",
        "light",
        "mosaic",
        "texture",
        "bricks",
        "segments",
        "skip",
        "proxy",
        "grid",
        "on-demand",
    ),
    channel=Work(_settings, _run),
    package=Work(_settings_together, _run_together),
    is_needed=lambda plan: plan.joint is not None or any(channel.programs for channel in plan.channels),
)
