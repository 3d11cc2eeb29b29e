"""The channels of a scene: which there are, and which are drawn."""

import re
from dataclasses import dataclass
from pathlib import Path

from volprep.scene.scene import Scene
from volprep.scene.transfer import SceneTransfer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers import list_channels
from volprep_formats.source import ChannelSpec, SourceSpec

LABELS = "labels"
"""The preset whose values are labels."""
ONLY_CHANNEL = "scan"
"""Name of the channel of a source that has one."""


@dataclass(frozen=True)
class SceneChannel:
    """A channel that transfer functions are for."""

    name: str
    """Its name."""
    spec: SourceSpec
    """Where it is."""
    transfer: tuple[SceneTransfer, ...]
    """Its transfer functions, in the order of the scene."""


def with_listed_channels(scene: Scene) -> Scene:
    """Return the scene with "all" channels of a file replaced by their list; its path is absolute.

    A name becomes lower case, other characters than letters, digits, - and _ become -, equal ones get a number. Raises
    VP1004, VP1241 for a transfer function of a channel that is not there, VP1242, and the errors of the reader.
    """
    source = scene.source
    if source.channels != "all":
        return _with_labels_of_presets(scene)
    names: list[str] = []
    key, labels = list_channels(source, Path("/"))
    if key == "volume" and source.volume is not None:
        raise VolprepError("VP1004", path=source.path, key=key, format="all of its channels")
    for number, label in enumerate(labels, 1):
        plain = re.sub(r"[^a-z0-9_-]+", "-", label.lower()).strip("-_")[:50] or f"channel-{number}"
        names.append(plain if plain not in names else f"{plain}-{number}")
    for transfer in scene.transfer:
        if transfer.channel is not None and transfer.channel not in names:
            raise VolprepError("VP1241", path=source.path, wanted=transfer.channel, found=", ".join(names))
    shared = source.model_dump(exclude={"channels"})
    listed = tuple(ChannelSpec(**{**shared, "name": name, key: number}) for number, name in enumerate(names, 1))
    return _with_labels_of_presets(scene.with_source(SourceSpec(channels=listed)))


def _with_labels_of_presets(scene: Scene) -> Scene:
    """Return the scene in which the channels that are drawn with the preset "labels" are labels.

    That holds unless the scene says that they are not.
    """
    source = scene.source
    of_labels = {transfer.channel for transfer in scene.transfer if transfer.preset == LABELS}
    if not of_labels:
        return scene
    if isinstance(source.channels, tuple) and source.channels:
        named = {label or source.channels[0].name for label in of_labels}
        channels = tuple(
            channel.model_copy(update={"labels": True}) if channel.name in named and channel.labels is None else channel
            for channel in source.channels
        )
        return scene.with_source(source.model_copy(update={"channels": channels}))
    return scene if source.labels is not None else scene.with_source(source.model_copy(update={"labels": True}))


def drawn_channels(scene: Scene) -> tuple[SceneChannel, ...]:
    """Return the channels that transfer functions are for, that of the first one first; "all" has been listed."""
    assert scene.source.channels != "all"  # noqa: S101 - see above
    if not scene.source.channels:
        return (SceneChannel(ONLY_CHANNEL, scene.source, scene.transfer),)
    specs = {channel.name: channel for channel in scene.source.channels}
    first = scene.source.channels[0].name
    names = list(dict.fromkeys(transfer.channel or first for transfer in scene.transfer))
    return tuple(
        SceneChannel(
            name, specs[name], tuple(transfer for transfer in scene.transfer if (transfer.channel or first) == name)
        )
        for name in names
    )


def left_out(scene: Scene) -> tuple[str, ...]:
    """Return the names of the channels that no transfer function is for."""
    drawn = {channel.name for channel in drawn_channels(scene)}
    channels = scene.source.channels
    return tuple(channel.name for channel in channels if isinstance(channel, ChannelSpec) and channel.name not in drawn)


def files_of(spec: SourceSpec) -> tuple[Path, ...]:
    """Return the paths of all that is read of a source; "all" has been listed."""
    each = spec.channels if isinstance(spec.channels, tuple) and spec.channels else (spec,)
    return tuple(path for channel in each for path in channel.places())
