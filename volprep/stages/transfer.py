"""Transfer functions become lookup tables, one texture of one row each, over the window of the stored values."""

from volprep.plan import Plan
from volprep.render.gl_formats import KTX2_FORMAT, gl_format
from volprep.stages import Changes, Stage, with_textures
from volprep.transfer.lookup import lookup_texels
from volprep_formats.package.draft import Draft
from volprep_formats.package.manifest import Texture
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures import ktx2


def _settings(plan: Plan) -> tuple[Record, ...]:
    return (plan.quantize, *plan.transfer_functions, *plan.lookups)


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    progress.start("transfer", len(plan.lookups))
    textures = []
    for function, lookup in zip(plan.transfer_functions, plan.lookups, strict=True):
        table = lookup_texels(function, plan.quantize.window, lookup.entries, lookup.format)
        shape_zyx = (1, 1, lookup.entries)
        image = ktx2.Ktx2Image(KTX2_FORMAT[lookup.format], shape_zyx, table.texels, 2)
        draft.write(lookup.file, "texture", ktx2.encode(image))
        textures.append(
            Texture(
                name=lookup.name,
                role="transfer",
                file=lookup.file,
                shape_zyx=shape_zyx,
                gl=gl_format(lookup.format, "TEXTURE_2D", plan.profile.api),
                transfer=function.name,
                max_extinction_per_mm=table.max_extinction_per_mm,
            )
        )
        progress.advance()
    return {
        "transfer_functions": plan.transfer_functions,
        "textures": with_textures(draft.manifest, tuple(textures)),
    }


STAGE = Stage(name="transfer", reads=(), settings=_settings, run=_run)
