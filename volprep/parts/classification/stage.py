"""Turn transfer functions into the tables of shaders: lookup tables, pre-integrated tables, or palettes.

All are made over the window of the stored values. A level whose pictures gain by it has a table of its own: a lookup
table that was fitted when the level was made, or the integral of such a table (both together: Díaz-García et al. 2018,
section 3). If users may edit transfer functions, it also has the joint histogram, the source of its tables.
"""

from collections.abc import Iterator

import numpy as np

from volprep.parts.level_choices import file_of_level, own_tables, table_of_level
from volprep.parts.levels.joint_histogram import joint_shares
from volprep.parts.stage import Shapes, Stage, Work
from volprep.parts.work import codes_of_level, codes_of_source
from volprep.plan.products import EditingPlan
from volprep.plan.records import ChannelPlan, LookupPlan, PreintegratedPlan
from volprep.transfer.integral import ends_of_entries, in_unit, integrate
from volprep.transfer.lookup import lookup_table, lookup_texels
from volprep.transfer.palette import even_palette
from volprep.transfer.texel_forms import MediumTexels, opaque_per_mm
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import ChannelPart
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.palette import Palette, PaletteEntry
from volprep_formats.package.parts.editing.record import Editing, encode_histogram
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.progress import Progress
from volprep_formats.record import Record, present
from volprep_formats.textures import ktx2


class _Step(Record):
    """Limit of tables that follows from drawing: none is more opaque than one step can be."""

    step_mm: float


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    common = (plan.quantize, *plan.levels, *plan.transfer_functions, *plan.tables)
    step = _Step(step_mm=plan.rays.step_mm) if plan.lookups or plan.preintegrated else None
    return (*common, *present(step, plan.part(EditingPlan)), *plan.programs_beside_levels)


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    progress.start("transfer", len(plan.transfer_functions))
    functions = {function.name: function for function in plan.transfer_functions}
    editing = plan.part(EditingPlan)
    return Contribution(
        channel=ChannelPart(name=plan.channel, transfer_functions=plan.transfer_functions),
        textures=tuple(_textures(draft, plan, functions, progress)),
        palettes=tuple(_palettes(plan, functions, progress)),
        editing=None if editing is None else _editing(draft, plan, editing),
    )


def _textures(
    draft: Draft, plan: ChannelPlan, functions: dict[str, TransferFunction], progress: Progress
) -> Iterator[Texture]:
    for lookup in plan.lookups:
        yield from _lookups(draft, plan, lookup, functions[lookup.transfer])
        progress.advance()
    for planned in plan.preintegrated:
        yield from _preintegrated(draft, plan, planned, functions[planned.transfer])
        progress.advance()


def _drawn_levels(plan: ChannelPlan) -> set[int]:
    """Return the levels that programs draw: level 0 may be drawn where it is too large for a texture."""
    beside = {level for program in plan.programs_beside_levels for level in program.levels}
    return beside | {level.index for level in plan.levels}


def _lookups(draft: Draft, plan: ChannelPlan, lookup: LookupPlan, function: TransferFunction) -> Iterator[Texture]:
    """Return the tables of levels that have one of their own, and the common one where a level has none."""
    own = own_tables(draft, plan, lookup.transfer)
    tables: dict[int | None, Float64Array] = dict(own.items())
    if _drawn_levels(plan) - own.keys():
        tables[None] = lookup_table(function, plan.quantize.window, lookup.entries)
    # One shader reads all of them, and holds one scale.
    editing = plan.part(EditingPlan)
    headroom_per_mm = editing.headroom_per_mm if editing else 0.0
    largest_per_mm = max(headroom_per_mm, *(float(table[:, 3].max()) for table in tables.values()))
    largest_per_mm = min(largest_per_mm, opaque_per_mm(plan.rays.step_mm, plan.grid.extent_mm_zyx))
    for level, table in tables.items():
        texels = lookup_texels(table, lookup.format, largest_per_mm)
        named = lookup if level is None else table_of_level(lookup, level)
        yield _texture(draft, named, texels, level)


def _preintegrated(
    draft: Draft, plan: ChannelPlan, planned: PreintegratedPlan, function: TransferFunction
) -> Iterator[Texture]:
    """Return the tables of levels that have one of their own, and the common one where a level has none."""
    window, exact = plan.quantize.window, Table.exact(function)
    functions: dict[int | None, Table] = {
        level: exact.with_entries(np.linspace(*window, len(entries)), entries)
        for level, entries in own_tables(draft, plan, planned.transfer).items()
    }
    if _drawn_levels(plan) - functions.keys():
        functions[None] = exact
    ends = ends_of_entries(list(functions.values()), window, planned.entries)
    tables = {
        level: integrate(table, ends, planned.entries, opaque_per_mm(plan.rays.step_mm))
        for level, table in functions.items()
    }
    # As lookup tables: one shader reads all of them, and holds one scale.
    mean_per_mm = max(table.mean_per_mm for table in tables.values())
    for level, table in tables.items():
        named = planned if level is None else table_of_level(planned, level)
        texture = _texture(draft, named, MediumTexels(in_unit(table, mean_per_mm).texels, mean_per_mm), level)
        low, high = ((end - window[0]) / (window[1] - window[0]) for end in ends)
        yield texture.model_copy(update={"stored_range": (max(low, 0.0), min(high, 1.0))})


def _editing(draft: Draft, plan: ChannelPlan, wanted: EditingPlan) -> Editing:
    codes = codes_of_source(draft, plan)
    for histogram in wanted.histograms:
        level = plan.level(histogram.level)
        shares = joint_shares(codes, codes_of_level(draft, plan, level.index), level.factors_zyx)
        draft.write(histogram.file, "histogram", encode_histogram(shares))
    return Editing(histograms=wanted.histograms)


def _texture(
    draft: Draft, planned: LookupPlan | PreintegratedPlan, table: MediumTexels, level: int | None = None
) -> Texture:
    is_integral = isinstance(planned, PreintegratedPlan)
    depth, height, width, _ = table.texels.shape
    shape_zyx = (depth, height, width)
    image = ktx2.Ktx2Image(planned.format, shape_zyx, table.texels, 2)
    draft.write(planned.file, "texture", ktx2.encode(image))
    return Texture(
        name=planned.name,
        role="preintegrated" if is_integral else "transfer",
        file=planned.file,
        shape_zyx=shape_zyx,
        format=planned.format,
        dimension="2d",
        level=level,
        transfer=planned.transfer,
        filter="nearest" if is_integral else "linear",
        max_extinction_per_mm=table.max_extinction_per_mm,
    )


def _palettes(plan: ChannelPlan, functions: dict[str, TransferFunction], progress: Progress) -> Iterator[Palette]:
    for planned in plan.palettes:
        colours, extinctions = even_palette(functions[planned.transfer], plan.quantize.window, planned.entries)
        entries = zip(colours.tolist(), extinctions.tolist(), strict=True)
        yield Palette(
            transfer=planned.transfer,
            entries=tuple(
                PaletteEntry(colour=(red, green, blue), extinction_per_mm=extinction)
                for (red, green, blue), extinction in entries
            ),
        )
        progress.advance()


def _shapes(draft: Draft, plan: ChannelPlan) -> Shapes:
    shapes: Shapes = {}
    tables: tuple[LookupPlan | PreintegratedPlan, ...] = (*plan.lookups, *plan.preintegrated)
    for table in tables:
        shape = (1, 1, table.entries) if isinstance(table, LookupPlan) else table.shape_zyx
        own = own_tables(draft, plan, table.transfer)
        if _drawn_levels(plan) - own.keys():
            shapes[table.file] = shape
        shapes |= {file_of_level(table.name, level): shape for level in own}
    return shapes


STAGE = Stage(
    name="transfer",
    summary="Write the tables that turn values into colours, for each transfer function.",
    options=("render", ("classification", "palette_entries")),
    reads=("quantize", "pyramid"),
    channel=Work(_settings, _run, _shapes),
)
