"""Transfer functions become what shaders classify with: lookup tables, pre-integrated tables, or palettes.

All are made over the window of the stored values.
"""

from collections.abc import Iterator

from volprep.plan import LookupPlan, Plan, PreintegratedPlan
from volprep.render.gl_formats import KTX2_FORMAT, gl_format
from volprep.stages import Changes, Stage, with_textures
from volprep.transfer.lookup import lookup_texels
from volprep.transfer.palette import even_palette
from volprep.transfer.preintegrated import preintegrated_texels
from volprep.transfer.texel_forms import MediumTexels
from volprep_formats.package.draft import Draft
from volprep_formats.package.manifest import Texture
from volprep_formats.package.palette import Palette, PaletteEntry
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2


def _settings(plan: Plan) -> tuple[Record, ...]:
    return (plan.quantize, *plan.transfer_functions, *plan.lookups, *plan.preintegrated, *plan.palettes)


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    progress.start("transfer", len(plan.transfer_functions))
    functions = {function.name: function for function in plan.transfer_functions}
    textures = tuple(_textures(draft, plan, functions, progress))
    return {
        "transfer_functions": plan.transfer_functions,
        "textures": with_textures(draft.manifest, textures),
        "palettes": tuple(_palettes(plan, functions, progress)),
    }


def _textures(
    draft: Draft, plan: Plan, functions: dict[str, TransferFunction], progress: Progress
) -> Iterator[Texture]:
    window = plan.quantize.window
    for lookup in plan.lookups:
        table = lookup_texels(functions[lookup.transfer], window, lookup.entries, lookup.format)
        texture = _texture(draft, plan, lookup, table)
        yield texture
        progress.advance()
    for planned in plan.preintegrated:
        function = functions[planned.transfer]
        table = preintegrated_texels(function, window, planned.entries, planned.segment_mm, planned.format)
        texture = _texture(draft, plan, planned, table)
        yield texture.model_copy(update={"role": "preintegrated", "segment_mm": planned.segment_mm})
        progress.advance()


def _texture(draft: Draft, plan: Plan, planned: LookupPlan | PreintegratedPlan, table: MediumTexels) -> Texture:
    depth, height, width, _ = table.texels.shape
    shape_zyx = (depth, height, width)
    image = ktx2.Ktx2Image(KTX2_FORMAT[planned.format], shape_zyx, table.texels, 2)
    draft.write(planned.file, "texture", ktx2.encode(image))
    return Texture(
        name=planned.name,
        role="transfer",
        file=planned.file,
        shape_zyx=shape_zyx,
        gl=gl_format(planned.format, "TEXTURE_2D", plan.profile.api),
        transfer=planned.transfer,
        max_extinction_per_mm=table.max_extinction_per_mm,
    )


def _palettes(plan: Plan, functions: dict[str, TransferFunction], progress: Progress) -> Iterator[Palette]:
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


STAGE = Stage(name="transfer", reads=(), settings=_settings, run=_run)
