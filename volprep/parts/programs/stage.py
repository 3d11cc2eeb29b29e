"""Shaders are composed and specialised: the text that the package ships and the reference renderer runs."""

from collections.abc import Sequence

from volprep.parts.programs.decision import VERTEX, pass_file, tile_files
from volprep.parts.stage import Stage, Work, present
from volprep.plan.products import SkipTablePlan
from volprep.plan.records import ChannelPlan, Plan
from volprep.shading.program import compose_program
from volprep.shading.rays import depth_shader
from volprep.shading.slices import OVER, TOWARDS
from volprep.shading.tiles import GROUPS, TILE, TileTexts
from volprep.shading.walk import PassText
from volprep_formats.package.manifest import Contribution, RenderSettings, SubvolumeFiles
from volprep_formats.package.parts.proxy.record import Proxy
from volprep_formats.package.program import LightPass, Pass, Program, ProgramDesign, Tiles
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (
        plan.grid,
        plan.render,
        *plan.levels,
        *plan.volumes,
        *plan.tables,
        *plan.programs,
        *(() if plan.subvolumes is None else plan.subvolumes.programs),
        *(() if plan.proxy is None else plan.proxy.programs),
    )


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    subvolumes, proxy = draft.manifest.subvolumes, draft.manifest.proxy
    around_points = () if plan.subvolumes is None or subvolumes is None else plan.subvolumes.programs
    at_meshes = () if plan.proxy is None or proxy is None else plan.proxy.programs
    progress.start("shaders", len(plan.programs) + len(around_points) + len(at_meshes))
    writer = _Writer(draft, plan.render, () if plan.skip is None else plan.skip.tables, progress)
    programs = writer.programs(plan.programs)
    if subvolumes is not None:
        subvolumes = SubvolumeFiles(grid=subvolumes.grid, programs=writer.programs(around_points))
    if proxy is not None:
        draft.write(proxy.depth, "shader", depth_shader("es100" if plan.profile.api == "es2.0" else "es300").encode())
        proxy = Proxy(depth=proxy.depth, programs=writer.programs(at_meshes))
    return Contribution(programs=programs, subvolumes=subvolumes, proxy=proxy)


def _settings_together(plan: Plan) -> tuple[Record, ...]:
    parts = [(*each.levels, *each.volumes, *each.tables) for each in plan.drawn_together]
    return (*present(plan.together), plan.shared, *(record for part in parts for record in part))


def _run_together(draft: Draft, plan: Plan, progress: Progress) -> Contribution:
    """Write the programs of the picture of several channels."""
    if plan.together is None:
        return Contribution()
    progress.start("shaders", len(plan.together.programs))
    writer = _Writer(draft, plan.shared.render, plan.together.skip_tables, progress)
    return Contribution(programs=writer.programs(plan.together.programs))


class _Writer:
    """Composes programs and writes their shaders, which programs may share, once each."""

    def __init__(
        self, draft: Draft, render: RenderSettings, tables: Sequence[SkipTablePlan], progress: Progress
    ) -> None:
        self._draft = draft
        self._package = Package(draft.folder, draft.manifest)
        self._render = render
        # A draft may still hold tables that are no longer wanted.
        self._skipping = {table.transfer for table in tables}
        self._progress = progress
        self._written: set[str] = set()

    def programs(self, designs: Sequence[ProgramDesign]) -> tuple[Program, ...]:
        return tuple(self._program(design) for design in designs)

    def _program(self, design: ProgramDesign) -> Program:
        skips = design.transfer in self._skipping
        shaders = compose_program(self._package, design, self._render, skips=skips)
        before = tuple(_pass(design, each, number) for number, each in enumerate(shaders.before))
        passes = [(each.fragment, made.fragment) for each, made in zip(before, shaders.before, strict=True)]
        light_pass = None
        if shaders.light_pass is not None:
            made = _pass(design, shaders.light_pass, len(before))
            light_pass = LightPass(**dict(made), blend=TOWARDS, behind=OVER)
            passes.append((made.fragment, shaders.light_pass.fragment))
        tiles, sorting = _tiles(design, shaders.tiles)
        for path, text in ((design.vertex, shaders.vertex), (design.fragment, shaders.fragment), *passes, *sorting):
            if path not in self._written:
                self._draft.write(path, "shader", text.encode("ascii"))
                self._written.add(path)
        self._progress.advance()
        return Program(
            **dict(design),
            uniforms=shaders.uniforms,
            samplers=shaders.samplers,
            geometry=shaders.geometry,
            before=before,
            light_pass=light_pass,
            tiles=tiles,
            blend=shaders.blend,
            slab_samples=shaders.slab_samples,
            step_mm_min=shaders.step_mm_min,
        )


def _pass(design: ProgramDesign, text: PassText, number: int) -> Pass:
    """Return the record of a pass."""
    return Pass(
        vertex=design.vertex if text.vertex is None else VERTEX,
        fragment=pass_file(design, number),
        geometry=text.geometry,
        sampler=text.sampler,
        target=text.target,
        uniforms=text.uniforms,
        reads=text.reads,
        size=text.size,
    )


def _tiles(design: ProgramDesign, made: TileTexts | None) -> tuple[Tiles | None, list[tuple[str, str]]]:
    """Return the record of tiles, and the files of what sorts them."""
    if made is None:
        return None, []
    cost, offsets, place = tile_files(design)
    record = Tiles(
        size=TILE, groups=GROUPS, cost=cost, offsets=offsets, place=place, uniforms=made.uniforms, reads=made.reads
    )
    return record, [*zip((cost, offsets, place), made.texts, strict=True)]


STAGE = Stage(
    name="shaders",
    reads=("transfer", "normals", "bricks", "skip", "proxy", "grid"),
    channel=Work(_settings, _run),
    package=Work(_settings_together, _run_together),
)
