"""Several channels in one picture: how each is read and classified, and how their samples add up.

Channels that share texels take one fetch; else each takes one of its own, from a 3D texture of its own.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from volprep.shading import raycast_mosaic, raycast_texture3d
from volprep.shading.classification import sample_classification
from volprep.shading.components import component_letter
from volprep.shading.compose import Instance, literal
from volprep.shading.feature import Feature
from volprep.shading.skipping import skipping_on_grids
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.picture import Picture
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
        return _on_grids(manifest, program, channel_of, skips=skips)
    first = _volume(manifest, channel_of[transfers[0]], level)
    held = first.channels
    mipmaps = first.mipmap is not None
    if len(held) == 1:
        values = {transfer: f"stored_value_{index}(at)" for index, transfer in enumerate(transfers)}
        sampling = raycast_texture3d.sampling_apart(transfers, mipmaps=mipmaps)
        return sampling, _added(manifest, program, values, packed=False)
    if first.mosaic is None:
        sampling = raycast_texture3d.sampling(None, mipmaps=mipmaps)
    else:
        spacing_mm_zyx = next(held.grid.spacing_mm_zyx for held in manifest.levels if held.index == level)
        sampling = raycast_mosaic.sampling(first.mosaic, spacing_mm_zyx, None)
    samplers = _of_transfer(sampling.samplers, transfers[0])
    letters = {
        name: component_letter(first.format, held.index(channel_of[name]), manifest.profile.dialect)
        for name in transfers
    }
    values = {name: f"voxel.{letter}" for name, letter in letters.items()}
    return replace(sampling, samplers=samplers), _added(manifest, program, values, packed=True)


def _on_grids(
    manifest: Manifest, program: ProgramDesign, channel_of: Mapping[str, str], *, skips: bool
) -> tuple[Feature, ...]:
    grids = [manifest.grid_of(channel) for channel in channel_of.values()]
    extents = [grid.extent_mm_zyx for grid in grids if grid is not None]
    sampling = raycast_texture3d.sampling_on_grids([*channel_of], extents)
    added = _added(manifest, program, dict.fromkeys(channel_of, ""), packed=False, on_grids=True)
    skipping = skipping_on_grids(manifest, program, [*channel_of], skips=skips)
    return sampling, replace(added, slots={**added.slots, **sampling.slots}), skipping


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
    manifest: Manifest, program: ProgramDesign, values: Mapping[str, str], *, packed: bool, on_grids: bool = False
) -> Feature:
    """Classify the value of each transfer function, and add the results.

    Channels that lie `on_grids` of their own have no values at a common place.
    """
    if program.classification == "colour":
        return _coloured(manifest, [*values])
    classify: list[Instance] = []
    add: list[Instance] = []
    samplers: list[Sampler] = []
    for index, (transfer, value) in enumerate(values.items()):
        suffix = f"_{index}"
        dialect = manifest.profile.dialect
        own = sample_classification(manifest, program.classification, transfer, suffix, dialect)
        part = own.slots["classification"]
        assert isinstance(part, tuple)  # noqa: S101 - the function of one channel is an instance
        classify += part
        if on_grids:
            classify.append(Instance("classification/together:alone", {"OF": suffix}))
        classified = f"classify_alone{suffix}(i)" if on_grids else f"classify{suffix}({value})"
        add.append(Instance("classification/together:channel", {"OF": suffix, "CLASSIFY": classified}))
        samplers += _of_transfer(own.samplers, transfer)
    return Feature(
        slots={
            "classification": "classification/together",
            "classification_start": None,
            "channels": tuple(classify),
            "voxel": "classification/together:voxel" if packed else None,
            "sum": tuple(add),
        },
        words={"AT": "float i" if on_grids else "vec3 at"},
        offers={"MEDIUM": f"classify_together({'i' if on_grids else 'start + stride * i'})"},
        samplers=tuple(samplers),
    )


def _coloured(manifest: Manifest, transfers: Sequence[str]) -> Feature:
    """Take light and extinction as the texels of four channels hold them."""
    function = next(function for function in manifest.transfer_functions if function.name == transfers[-1])
    return Feature(
        slots={"classification": "classification/together:colour", "classification_start": None},
        words={"LARGEST_PER_MM": literal(function.points[-1].extinction_per_mm)},
        offers={"MEDIUM": "classify(voxel_texel(start + stride * i))"},
    )
