"""A channel of a scan before anything is decided about it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from volprep.parts.programs.patch_rays import PatchRays
from volprep.plan.whole_source import WholeSource
from volprep.scan.segments.record import FoundSegments
from volprep.scan.slabs import RawVolume
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo


@dataclass(frozen=True)
class ChannelScan:
    """One channel of a scan, and the scene's settings for it."""

    name: str
    """Name of the channel."""
    scene: Scene
    """The scene with the source and the transfer functions of this channel alone."""
    info: SourceInfo
    """Description of the source."""
    measured: Measured
    """Measurements of the source."""
    functions: tuple[TransferFunction, ...]
    """Its transfer functions over physical values."""
    whole: WholeSource | None = None
    """The source itself, where it has been imported; compression is decided on it."""
    segments: FoundSegments | None = None
    """Segments of the scan; None if the scene wants none."""
    voxels: RawVolume | None = None
    """Stored values of the source, if known; the step of level 0 is measured along rays through them."""
    labels: RawVolume | None = None
    """Label of each voxel of the source, as the import numbered them, if known."""
    finest: Sequence[PatchRays] = ()
    """Rays of views through them."""
    finer: Callable[[], Sequence[PatchRays]] | None = None
    """Samples the same rays more finely; None without such rays."""
