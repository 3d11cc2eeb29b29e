"""Light is computed once for each transfer function, and stored in a small texture.

A texel holds the light where the share is 0, and the light where it is 1 (volprep/parts/light/codes.py); light that an
app turns has half of the slices for each of these. A volume that planes cut may have a second light.

Light that an app turns is that of four environments, as bright as 1 + w · t in the direction w, with t the corners of a
tetrahedron: they span all that change like a cosine (volprep_formats/package/parts/light/environment.py). No light is
negative, so all four are fitted and coded as any other light, with the same places and random numbers.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from volprep.parts.light.codes import LightCodes, coded_alike
from volprep.parts.light.kept import KeptSamples
from volprep.parts.light.lit import lit_volume
from volprep.parts.light.solve import LightField, solve_field
from volprep.parts.mosaic.packing import pack_mosaic
from volprep.parts.stage import Shapes, Stage, Work, any_channel, required
from volprep.parts.work import source_info, source_volume
from volprep.plan.products import LightPlan, LightTexturePlan
from volprep.plan.records import ChannelPlan
from volprep.scan.slabs import bytes_of
from volprep.truth.path_traced import LitVolume
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.light.environment import CORNERS
from volprep_formats.package.parts.light.planes import plane_numbers
from volprep_formats.package.parts.light.record import StoredLight
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture, dimension_of
from volprep_formats.progress import Progress
from volprep_formats.record import Record, present
from volprep_formats.textures import ktx2

_AT_ONCE = 3
"""Environments that one set of paths estimates: one for each of red, green and blue."""


def solve_turnable(
    lit: LitVolume,
    factor: int,
    count: int,
    progress: Progress,
    kept: KeptSamples | None = None,
    *,
    curve: Float64Array | None = None,
) -> LightField:
    """Fit a field of four channels, one for each environment. Arguments as `solve_field`."""
    fields = [
        solve_field(_under(lit, CORNERS[first : first + _AT_ONCE]), factor, count, progress, kept, curve=curve)
        for first in range(0, len(CORNERS), _AT_ONCE)
    ]
    texels = np.concatenate([field.texels for field in fields], axis=4)
    return replace(fields[0], texels=texels, residual=max(field.residual for field in fields))


def _under(lit: LitVolume, corners: Float64Array) -> LitVolume:
    """Return a volume with an environment for each channel."""
    environment = np.zeros((4, _AT_ONCE))
    environment[0, : len(corners)] = 1.0
    environment[1:, : len(corners)] = corners.T
    channels = "rgb" if len(corners) > 1 else "luminance"
    # A luminance is the same in all channels.
    if channels == "luminance":
        environment = np.repeat(environment[:, :1], 3, axis=1)
    return replace(lit, model=lit.model.model_copy(update={"channels": channels}), environment=environment)


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (plan.grid, plan.crop, plan.quantize, *plan.transfer_functions, *present(plan.part(LightPlan)))


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    light = required(plan.part(LightPlan))
    transfers = dict.fromkeys(texture.transfer for texture in light.textures)
    return Contribution(
        textures=tuple(
            texture for transfer in transfers for texture in _textures(draft, plan, light, transfer, progress)
        )
    )


def _textures(
    draft: Draft, plan: ChannelPlan, light: LightPlan, transfer: str, progress: Progress
) -> Iterator[Texture]:
    lit = _lit(draft, plan, light, transfer)
    kept = KeptSamples(draft.kept(STAGE.name), lit.volume)
    solve = solve_turnable if light.model.turnable else solve_field
    fields = [solve(lit, light.factor, light.samples, progress, kept)]
    if light.planes:
        cut = replace(lit, planes=plane_numbers(light.planes))
        # One shader reads both, so that they share its constants.
        fields.append(solve(cut, light.factor, light.samples, progress, kept, curve=fields[0].curve))
    for is_of_a_cut, (field, codes) in enumerate(
        zip(fields, coded_alike(fields, holds_one=light.editable), strict=True)
    ):
        is_wanted = (transfer, bool(is_of_a_cut))
        wanted = next(texture for texture in light.textures if (texture.transfer, texture.is_of_a_cut) == is_wanted)
        stored = _stored(plan, light, field, codes).model_copy(update={"planes": light.planes if is_of_a_cut else ()})
        yield _written(draft, light, wanted, codes, stored)


def _stored(plan: ChannelPlan, light: LightPlan, field: LightField, codes: LightCodes) -> StoredLight:
    low, high = plan.quantize.window
    first, last = ((float(value) - low) / (high - low) for value in field.curve[0])
    x, y, z = (per / n for per, n in zip(field.nodes_per_mm_xyz, light.slices_zyx[::-1], strict=True))
    return StoredLight(
        model=light.model,
        texture_from_box_per_mm_xyz=(x, y, z),
        largest=codes.largest,
        subtracted=codes.subtracted,
        first_colour=codes.first_colour,
        stored_values=(first, last),
        samples=field.samples,
        residual=min(field.residual, 1.0),
    )


def _written(
    draft: Draft, light: LightPlan, wanted: LightTexturePlan, codes: LightCodes, stored: StoredLight
) -> Texture:
    draft.write(wanted.file, "texture", _file(codes.slices, light))
    return Texture(
        name=wanted.name,
        role="light",
        file=wanted.file,
        shape_zyx=light.texels_zyx,
        format=light.format,
        dimension=dimension_of(light.mosaic),
        mosaic=light.mosaic,
        transfer=wanted.transfer,
        light=stored,
    )


def _file(texels: UInt8Array, light: LightPlan) -> Iterator[bytes | memoryview]:
    yield ktx2.header(light.format, light.texels_zyx, 3 if light.mosaic is None else 2)
    if light.mosaic is None:
        yield bytes_of(np.ascontiguousarray(texels))
        return
    for strip in pack_mosaic(lambda z0, z1: texels[z0:z1], light.mosaic):
        yield bytes_of(strip)


def _lit(draft: Draft, plan: ChannelPlan, light: LightPlan, transfer: str) -> LitVolume:
    info, source = source_info(draft.manifest, plan.channel), source_volume(draft, plan.channel)
    function = plan.function(transfer)
    return lit_volume(source, info, plan.crop, plan.grid, function, light.model)


def _shapes(_draft: Draft, plan: ChannelPlan) -> Shapes:
    light = required(plan.part(LightPlan))
    return {texture.file: light.texels_zyx for texture in light.textures}


STAGE = Stage(
    name="light",
    summary="Write light that is computed once, if the scene has lighting.baked.",
    reads=("quantize",),
    channel=Work(_settings, _run, _shapes),
    is_needed=any_channel(lambda plan: plan.part(LightPlan)),
)
