"""What a build begins with: the request with its channels listed, each of which can be opened."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from volprep.scan.channels import opened_channel
from volprep.scene.channels import SceneChannel, drawn_channels, files_of, with_listed_channels
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo, VolumeSource


@dataclass(frozen=True)
class Prepared:
    """A request of which scene, class of devices and channels are known."""

    scene: Scene
    """The scene; paths are absolute, and "all" channels of a file are listed."""
    profile: DeviceProfile
    """Class of devices."""
    channels: tuple[SceneChannel, ...]
    """The channels that are drawn, the default one first."""
    scene_path: Path | None
    """The scene file, absolute; None for a source without a scene."""
    first_look: bool
    """Whether nobody gave a transfer function, so that one is made from what is measured."""

    def sources(self, progress: Progress) -> Iterator[tuple[SceneChannel, SourceInfo, VolumeSource]]:
        """Open one channel after the other; its voxels have the grid of the first one.

        Raises VP1240 for a channel whose voxels lie elsewhere, and what the reader raises.
        """
        first: SourceInfo | None = None
        for channel in self.channels:
            registered = None if first is None else (self.channels[0].name, first.grid)
            with opened_channel(channel.name, channel.spec, registered, progress) as source:
                info = source.info if first is None else source.info.model_copy(update={"grid": first.grid})
                first = first or info
                yield channel, info, source


def prepare(request: Request) -> Prepared:
    """List the channels of a request. Raises VP1001 for a source that is not there, and what a listing raises."""
    scene = with_listed_channels(request.scene)
    for path in files_of(scene.source):
        if not path.exists():
            raise VolprepError("VP1001", path=path)
    return Prepared(scene, request.profile, drawn_channels(scene), request.scene_path, request.first_look)
