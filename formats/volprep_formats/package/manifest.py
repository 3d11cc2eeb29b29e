"""manifest.json: names every other file of a package, and says how to draw them."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Grid
from volprep_formats.package.channel import Channel, ChannelPart, Level, Quantization, SourceRecord, Statistics
from volprep_formats.package.palette import Palette
from volprep_formats.package.parts.compression.record import CompressedForm
from volprep_formats.package.parts.costs.record import DrawCost
from volprep_formats.package.parts.editing.record import Editing
from volprep_formats.package.parts.fidelity.record import Fidelity
from volprep_formats.package.parts.hybrid.record import Hybrid
from volprep_formats.package.parts.proxy.record import Proxy
from volprep_formats.package.parts.skip.record import Skipping
from volprep_formats.package.parts.together.record import Together
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import Program
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import Fraction, TransferFunction
from volprep_formats.package.values import ByteCount, PackagePath, Sha256
from volprep_formats.record import Record
from volprep_formats.source import ChannelName

FileRole = Literal["texture", "shader", "preview", "grid", "subvolume", "mesh", "histogram", "work"]
"""What a file of a package is for."""


class FileRecord(Record):
    """One file of the package."""

    path: PackagePath
    """Path inside the package."""
    role: FileRole
    """What the file is for. Working data exists in drafts only."""
    size_bytes: ByteCount
    """Size of the file."""
    sha256: Sha256
    """SHA-256 of the file's bytes."""


class Tolerance(Record):
    """Largest error that a standard view may have, on premultiplied linear values from 0 to 1."""

    rmse: Fraction = 0.02
    """Root mean square over all pixels and channels."""
    maximum: Fraction = 0.25
    """Largest error of one channel of one pixel."""


Projection = Literal["orthographic", "perspective"]
"""Projection of a picture."""


class LevelStep(Record):
    """How far apart samples are where a level is drawn."""

    level: Annotated[int, Field(ge=0)]
    """Number of the level."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal distance of the samples along a ray."""


class RenderSettings(Record):
    """How the package wants to be drawn. Fragments are premultiplied linear light; alpha is the opacity."""

    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal distance of the samples along a ray, at the finest level that is held whole, and at each not among
    `level_steps`."""
    level_steps: tuple[LevelStep, ...] = ()
    """Coarser levels that are drawn with other steps, finest first; before them level 0, if it comes in sub-volumes
    only."""
    opacity_cutoff: Fraction | None = None
    """A ray stops when its opacity passes this, with steps finer than the nominal one a greater one; absent if rays
    run to their end."""
    projection: Projection = "orthographic"
    """Projection of the standard views."""
    tolerance: Tolerance = Tolerance()
    """Largest error of a standard view against the oracle."""
    hybrid: Hybrid | None = None
    """How an app draws the volume with few pixels and lines with all; absent if it draws the volume alone."""

    def step_of(self, level: int) -> float:
        """Return the nominal distance of the samples along a ray, in millimetres, where a level is drawn."""
        return next((each.step_mm for each in self.level_steps if each.level == level), self.step_mm)


class SubvolumeFiles(Record):
    """Level 0 in sub-volumes."""

    grid: PackagePath
    """JSON file that says where the level is cut and what lies where."""
    pieces: tuple[PackagePath, ...] = ()
    """KTX 2 files of the pieces that are not empty, in their order."""
    whole: PackagePath | None = None
    """KTX 2 file of the whole level, which may be a texture, too."""
    programs: tuple[Program, ...] = ()
    """Programs that draw the pieces around a point, one for each transfer function; none without files of pieces."""


class PlanItem(Record):
    """One decision of the plan."""

    name: str
    """What was decided about."""
    channel: ChannelName | None = None
    """Channel for which it was decided; absent for what concerns all."""
    kept: bool
    """Whether the package has it."""
    reason: str
    """Why."""
    files: tuple[PackagePath, ...] = ()
    """Files that exist because of this item."""
    size_bytes: ByteCount = 0
    """What it costs if it is kept, or would have cost if it is left out."""


class Contribution(Record):
    """What one run of a stage adds to the manifest, for one channel or for the package. Nobody else changes it."""

    channel: ChannelPart | None = None
    """What it says of its channel."""
    textures: tuple[Texture, ...] = ()
    """Textures that it wrote."""
    palettes: tuple[Palette, ...] = ()
    """Palettes of transfer functions."""
    skipping: Skipping | None = None
    """Empty-space skipping."""
    programs: tuple[Program, ...] = ()
    """Shader programs."""
    editing: Editing | None = None
    """What an app needs when its users edit transfer functions."""
    subvolumes: SubvolumeFiles | None = None
    """Level 0 in sub-volumes."""
    proxy: Proxy | None = None
    """Proxy geometry."""
    fidelity: tuple[Fidelity, ...] = ()
    """How near its pictures are to the scan."""
    costs: tuple[DrawCost, ...] = ()
    """What its pictures cost a device."""
    preview: PackagePath | None = None
    """Picture of the package."""


class StageRecord(Record):
    """A stage that has run on a draft."""

    name: str
    """Name of the stage."""
    key: Sha256
    """Digest of its settings and of the keys of the stages that it reads. While it stays the same, the stage need not
    run."""
    files: tuple[PackagePath, ...] = ()
    """Files that the stage wrote."""
    made: tuple[Contribution, ...] = ()
    """What it added to the manifest: for the package, for each channel, or for both."""


class Heading(Record):
    """What a manifest says of the package as a whole: it follows from scene, profile and plan."""

    name: str
    """Name of the scene."""
    generator: str
    """Program and version that wrote the package."""
    profile: DeviceProfile
    """Class of devices that the package is for."""
    grid: Grid | None = None
    """Voxels of level 0, whether or not the package holds it: the source without the border that nobody sees."""
    together: Together | None = None
    """Channels that are drawn into one picture, which is then the default picture."""
    compression: tuple[CompressedForm, ...] = ()
    """Compressed forms that were considered for the finest level, and what each loses."""
    render: RenderSettings | None = None
    """How the package wants to be drawn."""
    plan: tuple[PlanItem, ...] = ()
    """What was decided, kept or left out, and why."""


class Manifest(Heading):
    """The manifest of a package."""

    format: Literal["volpkg"] = "volpkg"
    """Marks the file."""
    version: Literal["1.0"] = "1.0"
    """Version of the format: major.minor. A reader refuses a higher major version."""
    state: Literal["draft", "sealed"]
    """A draft is under construction; only a sealed package may be shipped."""
    channels: tuple[Channel, ...] = ()
    """Channels of the volume; at least one in a package, none in a draft before its source is imported."""
    textures: tuple[Texture, ...] = ()
    """Textures, in order of name."""
    palettes: tuple[Palette, ...] = ()
    """Palettes of transfer functions, which shaders hold as constants."""
    skipping: Skipping | None = None
    """Empty-space skipping."""
    programs: tuple[Program, ...] = ()
    """Shader programs. The first one draws the default transfer function, or the picture of several channels."""
    editing: Editing | None = None
    """What an app needs when its users edit transfer functions."""
    subvolumes: SubvolumeFiles | None = None
    """Level 0 in sub-volumes, for devices that cannot hold it whole."""
    proxy: Proxy | None = None
    """Proxy geometry."""
    fidelity: tuple[Fidelity, ...] = ()
    """How near pictures are to the scan, for each level and transfer function; empty where the scene does not ask."""
    costs: tuple[DrawCost, ...] = ()
    """What drawing each level with each transfer function costs a device, in the order of the programs."""
    preview: PackagePath | None = None
    """Picture of the package, PNG."""
    stages: tuple[StageRecord, ...] = ()
    """Stages that have run; drafts only."""
    files: tuple[FileRecord, ...] = ()
    """Every file but the manifest, in order of path."""

    @property
    def transfer_functions(self) -> tuple[TransferFunction, ...]:
        """Transfer functions of all channels, the default one first."""
        return tuple(function for channel in self.channels for function in channel.transfer_functions)

    @property
    def levels(self) -> tuple[Level, ...]:
        """Levels that any channel has, finest first, each as the first channel that has it says.

        A level is for previews only if it is so in any channel.
        """
        every = [level for channel in reversed(self.channels) for level in channel.levels]
        by_index = {level.index: level for level in every}
        for index in {level.index for level in every if level.preview_only}:
            by_index[index] = by_index[index].model_copy(update={"preview_only": True})
        return tuple(by_index[index] for index in sorted(by_index))

    @property
    def source(self) -> SourceRecord:
        """Scan of the first channel, whose grid all have."""
        return self.channels[0].source

    @property
    def statistics(self) -> Statistics:
        """Values of the scan of the first channel, or of the only one."""
        return self.channels[0].statistics

    @property
    def quantization(self) -> Quantization | None:
        """How the stored values of the first channel, or of the only one, map to physical values."""
        return self.channels[0].quantization
