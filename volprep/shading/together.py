"""Several channels in one picture: how each is read and classified, and how what they give adds up.

Channels that share texels take one fetch; else each takes one of its own, from a 3D texture of its own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from volprep.shading import raycast_mosaic, raycast_texture3d
from volprep.shading.classification import Classification, classification
from volprep.shading.components import component_letter
from volprep.shading.compose import Instance
from volprep.shading.raycast import Sampling
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import ClassificationName, Sampler
from volprep_formats.package.texture import Texture


@dataclass(frozen=True)
class _Channel:
    """One of several channels."""

    transfer: str
    """Name of its transfer function."""
    component: str | None
    """Letter of the component that holds it, where channels share texels."""
    classification: Classification
    """How a sample becomes a colour."""


def drawn_together(
    manifest: Manifest,
    channel_of: Mapping[str, str],
    level: int,
    spacing_mm_zyx: tuple[float, float, float],
    classified: ClassificationName,
) -> tuple[Sampling, Classification]:
    """Return how transfer functions are drawn together: their channels are read at `level`, classified, and added.

    `channel_of` gives the channel of each transfer function. In 3D textures all levels are read as this one is.
    """
    volumes = {transfer: _volume(manifest, name, level) for transfer, name in channel_of.items()}
    first = next(iter(volumes.values()))
    packed = len(first.channels) > 1
    channels = [
        _Channel(
            transfer,
            component_letter(first.gl.format, first.channels.index(channel_of[transfer])) if packed else None,
            classification(classified, transfer, manifest.textures, manifest.palettes),
        )
        for transfer in channel_of
    ]
    if not packed:
        return _sampling_apart(channels, mipmaps=first.mipmap is not None), _added(channels)
    if first.mosaic is None:
        sampling = raycast_texture3d.sampling(None, mipmaps=first.mipmap is not None)
    else:
        sampling = raycast_mosaic.sampling(first.mosaic, spacing_mm_zyx, None)
    samplers = tuple(each.model_copy(update={"transfer": channels[0].transfer}) for each in sampling.samplers)
    return replace(sampling, samplers=samplers), _added(channels)


def _volume(manifest: Manifest, channel: str, level: int) -> Texture:
    return next(
        texture
        for texture in manifest.textures
        if (texture.role, texture.level) == ("volume", level) and channel in texture.channels
    )


def _sampling_apart(channels: Sequence[_Channel], *, mipmaps: bool) -> Sampling:
    """How channels are read that have a 3D texture each."""
    words = [{"OF": f"_{index}", "COMPONENT": "r"} for index in range(len(channels))]
    return Sampling(
        dialect="es300",
        parts={
            "sampling": (Instance("place_texture3d", {}), *(Instance("sample_texture3d", each) for each in words)),
            "place": None,
            "mipmap": "mipmap" if mipmaps else None,
        },
        constants=raycast_texture3d.lod(mipmaps=mipmaps),
        uniforms=raycast_texture3d.place_uniforms(mipmaps=mipmaps),
        samplers=tuple(
            Sampler(name=f"u_volume_{index}", role="volume", transfer=channel.transfer)
            for index, channel in enumerate(channels)
        ),
    )


def _added(channels: Sequence[_Channel]) -> Classification:
    """Classify a sample of each channel, and add what they give."""
    classify, add, samplers = [], [], []
    for index, channel in enumerate(channels):
        own, suffix = channel.classification, f"_{index}"
        part = own.parts["classification"]
        if not isinstance(part, str) or own.parts["first"] is not None:
            msg = f"{channel.transfer} is not classified sample by sample"
            raise ValueError(msg)
        classify.append(Instance(part, {**own.constants, "OF": suffix}))
        value = f"stored_value{suffix}(at)" if channel.component is None else f"voxel.{channel.component}"
        add.append(Instance("medium_channel", {"OF": suffix, "VALUE": value}))
        samplers += [
            each.model_copy(update={"name": f"{each.name}{suffix}", "transfer": channel.transfer})
            for each in own.samplers
        ]
    return Classification(
        parts={
            "classification": tuple(classify),
            "first": None,
            "medium": "medium_together",
            "voxel": None if channels[0].component is None else "medium_voxel",
            "channels": tuple(add),
        },
        constants={},
        samplers=tuple(samplers),
    )
