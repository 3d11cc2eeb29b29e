"""A stage of a volume of several channels: it runs for each channel, and what it changes is put together."""

from collections.abc import Iterable, Sequence
from typing import Any

from volprep.parts.stage import Changes, Stage
from volprep.plan.records import Plan
from volprep.scene.channels import drawn_channels
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Channel, Manifest
from volprep_formats.package.palette import Palette
from volprep_formats.package.parts.editing.record import Editing
from volprep_formats.package.parts.proxy.record import Proxy
from volprep_formats.package.parts.skip.record import Skipping
from volprep_formats.package.program import Program
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import TransferFunction

_OF_CHANNELS = ("quantization", "stored_type")
_LISTED = frozenset((*_OF_CHANNELS, "levels"))


def plans_of(stage: Stage, plan: Plan) -> tuple[Plan, ...]:
    """Return the plans of the channels, for each of which a stage runs; the plan itself where it runs once for all."""
    return (plan,) if stage.whole else plan.every


def merged(manifest: Manifest, parts: Sequence[tuple[Plan, Changes]], scene: Scene) -> Changes:
    """Put together what a stage changes for each channel; what belongs to transfer functions is in the scene's order.

    Raises VP1244 for what a package has only once, and the channels have differently.
    """
    if len(parts) == 1:
        return parts[0][1]
    result: dict[str, object] = {}
    for key, first in parts[0][1].items():
        each = [changes[key] for _, changes in parts]
        if key == "skipping":
            result[key] = _skipping([item for item in each if isinstance(item, Skipping)])
        elif key == "editing":
            result[key] = _editing([item for item in each if isinstance(item, Editing)])
        elif key == "proxy":
            result[key] = _proxy([item for item in each if isinstance(item, Proxy)])
        elif key == "textures":
            result[key] = _textures(manifest, parts)
        elif key == "levels":
            # Filters may differ; what the manifest says of all is said of the first channel that has the level.
            by_index = {level.index: level for level in reversed([*_chained(each)])}
            result[key] = tuple(by_index[index] for index in sorted(by_index))
        elif key in {"palettes", "programs", "transfer_functions"}:
            # What is drawn of several channels comes first: it is the default picture.
            together = () if scene.together is None else (scene.together.name,)
            names = [*together, *(transfer.name for transfer in scene.transfer)]
            result[key] = tuple(sorted(_chained(each), key=lambda item: names.index(_transfer_of(item))))
        elif key in _OF_CHANNELS or all(changes == first for changes in each):
            result[key] = first
        else:
            raise VolprepError("VP1244", path=scene.name, what=key)
    if listed := _LISTED & result.keys():
        result["channels"] = tuple(
            channel.model_copy(update={key: changes[key] for key in listed})
            for channel, (_, changes) in zip(manifest.channels or (), parts, strict=True)
        )
    return result


def with_transfers(channels: tuple[Channel, ...] | None, scene: Scene) -> tuple[Channel, ...] | None:
    """Return the channels the transfer functions that the scene has for them now: import may be older than that."""
    if channels is None:
        return None
    names = {drawn.name: tuple(transfer.name for transfer in drawn.transfer) for drawn in drawn_channels(scene)}
    return tuple(channel.model_copy(update={"transfers": names[channel.name]}) for channel in channels)


def _textures(manifest: Manifest, parts: Sequence[tuple[Plan, Changes]]) -> tuple[Texture, ...]:
    each = [(plan, tuple(_chained([changes["textures"]]))) for plan, changes in parts]
    # What any channel has dropped or replaced goes.
    kept = [texture for texture in manifest.textures if all(texture in textures for _, textures in each)]
    made: dict[str, Texture] = {}
    for plan, textures in each:
        for texture in textures:
            if texture not in manifest.textures:
                if texture.name in made:
                    raise VolprepError("VP1244", path=plan.channel, what=f"texture {texture.name}")
                of_channel = texture.transfer is None and not texture.channels and plan.channel is not None
                named = {"channels": (plan.channel,)} if of_channel else {}
                made[texture.name] = texture.model_copy(update=named)
    by_name = {texture.name: texture for texture in kept} | made
    return tuple(by_name[name] for name in sorted(by_name))


def _skipping(each: Sequence[Skipping]) -> Skipping:
    return Skipping(
        epsilon=each[0].epsilon,
        tables=tuple(table for skipping in each for table in skipping.tables),
        ranges=tuple(ranges for skipping in each for ranges in skipping.ranges),
    )


def _editing(each: Sequence[Editing]) -> Editing | None:
    return Editing(histograms=tuple(_chained(editing.histograms for editing in each))) if each else None


def _proxy(each: Sequence[Proxy]) -> Proxy:
    # Every channel gives what was there before it, too.
    meshes = dict.fromkeys(mesh for proxy in each for mesh in proxy.meshes)
    programs = dict.fromkeys(program for proxy in each for program in proxy.programs)
    return each[0].model_copy(update={"meshes": tuple(meshes), "programs": tuple(programs)})


def _transfer_of(item: TransferFunction | Palette | Program) -> str:
    return item.name if isinstance(item, TransferFunction) else item.transfer


def _chained(each: Iterable[Any]) -> Iterable[Any]:
    # Records of several kinds, each under its key of the manifest.
    return (item for items in each for item in items)
