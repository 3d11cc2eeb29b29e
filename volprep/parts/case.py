"""Inputs of the decisions about the parts of one channel."""

from collections.abc import Callable
from dataclasses import dataclass

from volprep.plan.decisions import LightChoice, ValueChoice
from volprep.plan.records import CropPlan, LevelPlan
from volprep.plan.room import Beside, Misfit
from volprep.scan.segments.record import FoundSegments
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep_formats.grid import Grid
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo

Neighbour = Callable[[Scene, DeviceProfile, LevelPlan, Beside], Beside | Misfit]
"""Adds the room that a part takes beside the texture of a level, or says why the two do not fit together."""


@dataclass(frozen=True)
class Case:
    """One channel: its scan, the scene's settings, the device class, and its codes."""

    channel: str
    """Name of the channel."""
    scene: Scene
    """The scene with the source and the transfer functions of this channel only."""
    profile: DeviceProfile
    """Device class."""
    crop: CropPlan
    """Part of the source that becomes level 0."""
    grid: Grid
    """Grid of level 0."""
    info: SourceInfo
    """Header of the source."""
    measured: Measured
    """Statistics of the source."""
    functions: tuple[TransferFunction, ...]
    """Transfer functions over physical values."""
    values: ValueChoice
    """Codes and their costs."""
    segments: FoundSegments | None = None
    """Segments of the scan; None if the scene wants none."""
    light: LightChoice | None = None
    """Measurements of precomputed light; None if it was not measured."""

    @property
    def drawn_alone(self) -> tuple[TransferFunction, ...]:
        """Transfer functions that have pictures of their own: none if one picture of a scan has all of them."""
        is_whole = self.segments is None and self.scene.render.classification != "colour"
        return self.functions if is_whole else ()
