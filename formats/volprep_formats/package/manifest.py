"""manifest.json: names every other file of a package, and says how to draw them."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Count, Grid, Vector
from volprep_formats.package.palette import Palette
from volprep_formats.package.parts.compression.record import CompressedForm
from volprep_formats.package.parts.editing.record import Editing
from volprep_formats.package.parts.proxy.record import Proxy
from volprep_formats.package.parts.skip.record import Skipping
from volprep_formats.package.parts.together.record import Together
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import Program
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import Fraction, TransferFunction
from volprep_formats.package.values import ByteCount, PackagePath, Sha256
from volprep_formats.record import Record
from volprep_formats.source import ChannelName, SourceInfo, StoredType

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


class SourceRecord(Record):
    """The scan that the package was made from. Nothing in it can name a patient."""

    info: SourceInfo
    """What the reader said."""
    sha256: Sha256
    """Digest of the geometry and the stored values; a source with another digest is another scan."""


class Statistics(Record):
    """What one pass over the source found. Values are physical."""

    minimum: float
    """Smallest finite value."""
    maximum: float
    """Largest finite value."""
    non_finite: Annotated[int, Field(ge=0)]
    """Number of voxels that are NaN or infinite."""


class Quantization(Record):
    """How physical values became stored values, and what that lost."""

    bits: Literal[8, 16]
    """Bits of a stored value."""
    window: tuple[float, float]
    """Physical values of the smallest and the largest code."""
    slope: float
    """physical = slope · stored + intercept."""
    intercept: float
    """physical = slope · stored + intercept."""
    rmse: Annotated[float, Field(ge=0.0)]
    """Root mean square error of the voxels inside the window, in physical units."""
    max_error: Annotated[float, Field(ge=0.0)]
    """Largest error of a voxel inside the window, in physical units."""
    clipped_below: Annotated[int, Field(ge=0)]
    """Number of voxels below the window."""
    clipped_above: Annotated[int, Field(ge=0)]
    """Number of voxels above the window."""


LevelFilter = Literal[
    "nearest",
    "bilinear",
    "box",
    "binomial",
    "gaussian",
    "lanczos3",
    "minimum",
    "maximum",
    "median",
    "mode",
    "mode-foreground",
    "feature-preserving",
    "least-squares",
    "appearance",
    "transmittance",
]
"""Filters that make a level from level 0."""


class Level(Record):
    """One resolution of the volume."""

    index: Annotated[int, Field(ge=0)]
    """0 is the resolution of the source."""
    factors_zyx: tuple[Count, Count, Count]
    """Voxels of level 0 along each axis that make one voxel of this level."""
    grid: Grid
    """Positions of the voxels."""
    texture_from_box_per_mm_xyz: Vector
    """Box millimetres times this are the normalised texture coordinates of the level: 1 / (n · spacing). n counts
    texels; a mipmap may have more texels than the level has voxels."""
    filter: Literal["none"] | LevelFilter
    """Filter that made the level from level 0; none for level 0."""


class Tolerance(Record):
    """Largest error that a standard view may have, on premultiplied linear values from 0 to 1."""

    rmse: Fraction = 0.02
    """Root mean square over all pixels and channels."""
    maximum: Fraction = 0.25
    """Largest error of one channel of one pixel."""


Projection = Literal["orthographic", "perspective"]
"""Projection of a picture."""


class RenderSettings(Record):
    """How the package wants to be drawn. Fragments are premultiplied linear light; alpha is the opacity."""

    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal distance of the samples along a ray."""
    opacity_cutoff: Fraction | None = None
    """A ray stops when its opacity passes this; absent if no ray can reach it."""
    projection: Projection = "orthographic"
    """Projection of the standard views."""
    tolerance: Tolerance = Tolerance()
    """Largest error of a standard view against the oracle."""


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
    kept: bool
    """Whether the package has it."""
    reason: str
    """Why."""
    files: tuple[PackagePath, ...] = ()
    """Files that exist because of this item."""
    size_bytes: ByteCount = 0
    """What it costs if it is kept, or would have cost if it is left out."""


class StageRecord(Record):
    """A stage that has run on a draft."""

    name: str
    """Name of the stage."""
    key: Sha256
    """Digest of its settings and of the keys of the stages that it reads. While it stays the same, the stage need not
    run."""
    files: tuple[PackagePath, ...] = ()
    """Files that the stage wrote."""


class Channel(Record):
    """One of several channels. All share the grid of level 0; each has the levels that fit."""

    name: ChannelName
    """Name, unique in the package."""
    source: SourceRecord
    """Scan that it was made from; its grid is that of the first channel."""
    statistics: Statistics
    """Values of the scan."""
    stored_type: StoredType | None = None
    """Type of its values in the working data and the volume textures."""
    quantization: Quantization | None = None
    """How its stored values map to physical values."""
    levels: tuple[Level, ...] = ()
    """Levels of this channel in the package, finest first."""
    transfers: tuple[str, ...]
    """Names of the transfer functions of its values. The programs of these functions draw its textures."""


class Manifest(Record):
    """The manifest of a package."""

    format: Literal["volpkg"] = "volpkg"
    """Marks the file."""
    version: Literal["1.0"] = "1.0"
    """Version of the format: major.minor. A reader refuses a higher major version."""
    state: Literal["draft", "sealed"]
    """A draft is under construction; only a sealed package may be shipped."""
    name: str
    """Name of the scene."""
    generator: str
    """Program and version that wrote the package."""
    profile: DeviceProfile
    """Class of devices that the package is for."""
    source: SourceRecord
    """Scan that the package was made from; with several channels, that of the first."""
    statistics: Statistics
    """Values of the scan."""
    channels: Annotated[tuple[Channel, ...], Field(min_length=2)] | None = None
    """Channels, if there are several. What the manifest itself says of its source then holds for the first of them."""
    together: Together | None = None
    """Channels that are drawn into one picture, which is then the default picture."""
    grid: Grid | None = None
    """Voxels of level 0, whether or not the package holds it: the source without the border that nobody sees."""
    stored_type: StoredType | None = None
    """Type of the values in the working data and the volume textures."""
    quantization: Quantization | None = None
    """How stored values map to physical values."""
    levels: tuple[Level, ...] = ()
    """Levels in the package, finest first."""
    transfer_functions: tuple[TransferFunction, ...] = ()
    """Transfer functions, the default one first."""
    textures: tuple[Texture, ...] = ()
    """Textures."""
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
    compression: tuple[CompressedForm, ...] = ()
    """Compressed forms that were considered for the finest level, and what each loses."""
    render: RenderSettings | None = None
    """How the package wants to be drawn."""
    preview: PackagePath | None = None
    """Picture of the package, PNG."""
    plan: tuple[PlanItem, ...] = ()
    """What was decided, kept or left out, and why."""
    stages: tuple[StageRecord, ...] = ()
    """Stages that have run; drafts only."""
    files: tuple[FileRecord, ...] = ()
    """Every file but the manifest, in order of path."""
