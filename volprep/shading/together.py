"""Several channels in one picture: how each is read and classified, and how their samples add up.

Channels that share texels take one fetch; else each takes one of its own, from a 3D texture of its own.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from volprep.shading import raycast_mosaic, raycast_texture3d
from volprep.shading.classification import sample_classification
from volprep.shading.components import component_letter
from volprep.shading.compose import Instance, literal
from volprep.shading.feature import Feature
from volprep.shading.lighting import light_of_medium
from volprep.shading.skipping import skipping_on_grids
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.picture import Picture, PictureMedium
from volprep_formats.package.program import ProgramDesign, Sampler
from volprep_formats.package.texture import Texture


def drawn_together(manifest: Manifest, picture: Picture, program: ProgramDesign, *, skips: bool) -> tuple[Feature, ...]:
    """Return how a program that draws several channels reads them, and how it classifies and adds them.

    On several grids also how it goes through them, by the tables of their own if it `skips`. In 3D textures all levels
    are read as the finest one is. Raises ValueError for a classification that is not one of samples.
    """
    level = min(program.levels)
    channel_of = {medium.transfer: medium.channel for medium in picture.media}
    transfers = [*channel_of]
    if picture.grid is not None:
        return _on_grids(manifest, program, picture, skips=skips)
    first = _volume(manifest, channel_of[transfers[0]], level)
    held = first.channels
    mipmaps, extent_mm_zyx = first.mipmap is not None, _grid(manifest, picture.media[0]).extent_mm_zyx
    if len(held) == 1:
        values = {transfer: f"stored_value_{index}(at)" for index, transfer in enumerate(transfers)}
        sampling = raycast_texture3d.sampling_apart(transfers, mipmaps=mipmaps, extent_mm_zyx=extent_mm_zyx)
        return sampling, _added(manifest, program, picture, values, voxel=sampling.offers["VOXEL"])
    if first.mosaic is None:
        sampling = raycast_texture3d.sampling(None, mipmaps=mipmaps, extent_mm_zyx=extent_mm_zyx)
    else:
        spacing_mm_zyx = next(held.grid.spacing_mm_zyx for held in manifest.levels if held.index == level)
        sampling = raycast_mosaic.sampling(first.mosaic, spacing_mm_zyx, None)
    samplers = _of_transfer(sampling.samplers, transfers[0])
    letters = {
        name: component_letter(first.format, held.index(channel_of[name]), manifest.profile.dialect)
        for name in transfers
    }
    values = {name: f"voxel.{letter}" for name, letter in letters.items()}
    return replace(sampling, samplers=samplers), _added(manifest, program, picture, values, letters=letters)


def _on_grids(manifest: Manifest, program: ProgramDesign, picture: Picture, *, skips: bool) -> tuple[Feature, ...]:
    transfers = [medium.transfer for medium in picture.media]
    extents = [_grid(manifest, medium).extent_mm_zyx for medium in picture.media]
    sampling = raycast_texture3d.sampling_on_grids(transfers, extents)
    added = _added(manifest, program, picture, {}, voxel=sampling.offers["VOXEL"])
    skipping = skipping_on_grids(manifest, program, transfers, skips=skips)
    return sampling, replace(added, slots={**added.slots, **sampling.slots}), skipping


def _grid(manifest: Manifest, medium: PictureMedium) -> Grid:
    """Return the grid of level 0 of a medium."""
    grid = manifest.grid_of(medium.channel)
    if grid is None:
        msg = "media of a picture have grids"
        raise ValueError(msg)
    return grid


def _volume(manifest: Manifest, channel: str, level: int) -> Texture:
    return next(
        texture
        for texture in manifest.textures
        if (texture.role, texture.level) == ("volume", level) and channel in texture.channels
    )


def _of_transfer(samplers: Iterable[Sampler], transfer: str) -> tuple[Sampler, ...]:
    return tuple(
        Sampler(name=sampler.name, role=sampler.role, transfer=transfer, part=sampler.part) for sampler in samplers
    )


def _added(
    manifest: Manifest,
    program: ProgramDesign,
    picture: Picture,
    values: Mapping[str, str],
    *,
    letters: Mapping[str, str] = MappingProxyType({}),
    voxel: str = "",
) -> Feature:
    """Classify the value of each transfer function, light it, and add the results.

    Channels on grids of their own have no `values` at a common place. Channels that share texels have their `letters`,
    others voxels of their own, as `voxel` is of u_volume.
    """
    if program.classification == "colour":
        return _coloured(manifest, [*values])
    classify: list[Instance] = []
    add: list[Instance] = []
    samplers: list[Sampler] = []
    for index, medium in enumerate(picture.media):
        suffix, transfer = f"_{index}", medium.transfer
        own = sample_classification(manifest, program.classification, transfer, suffix, manifest.profile.dialect)
        part = own.slots["classification"]
        assert isinstance(part, tuple)  # noqa: S101 - the function of one channel is an instance
        light: tuple[Instance, ...] = ()
        if program.lighting != "none" and not medium.unlit:
            light = light_of_medium(program, _grid(manifest, medium), suffix, voxel, on_grid=not values)
        of_texel = letters.get(transfer) if light else None
        words = {"COMPONENT": of_texel or "", "STORED": f"stored_value{suffix}"}
        stored = (Instance("sampling/stored_value", words),) if of_texel else ()
        lit, shown = _shown(suffix, values.get(transfer), light[1:])
        classify += (*part, *stored, *light[:1], *lit)
        add.append(Instance("classification/together:channel", {"OF": suffix, "CLASSIFY": shown}))
        samplers += _of_transfer(own.samplers, transfer)
    is_lit = program.lighting != "none"
    return Feature(
        slots={
            "classification": "classification/together",
            "classification_start": None,
            "channels": (Instance("light/headlight:declared"), *classify) if is_lit else tuple(classify),
            "voxel": "classification/together:voxel" if letters else None,
            "sum": tuple(add),
            "lighting_start": "light/headlight:begin" if is_lit else None,
        },
        words={"AT": "vec3 at" if values else "float i"},
        offers={"MEDIUM": f"classify_together({'start + stride * i' if values else 'i'})"},
        samplers=tuple(samplers),
    )


def _shown(suffix: str, value: str | None, light: tuple[Instance, ...]) -> tuple[tuple[Instance, ...], str]:
    """Return the function that gives colour and extinction of a medium, if it needs one, and its call.

    A medium without a `value` at the common place is on a grid of its own.
    """
    slots = {"light_of_medium": light or None}
    if value is None:
        return (Instance("classification/together:alone", {"OF": suffix}, slots),), f"classify_alone{suffix}(i)"
    if not light:
        return (), f"classify{suffix}({value})"
    return (Instance("classification/together:lit", {"OF": suffix}, slots),), f"classify_lit{suffix}(at, {value})"


def _coloured(manifest: Manifest, transfers: Sequence[str]) -> Feature:
    """Take light and extinction as the texels of four channels hold them."""
    function = next(function for function in manifest.transfer_functions if function.name == transfers[-1])
    return Feature(
        slots={"classification": "classification/together:colour", "classification_start": None},
        words={"LARGEST_PER_MM": literal(function.points[-1].extinction_per_mm)},
        offers={"MEDIUM": "classify(voxel_texel(start + stride * i))"},
    )
