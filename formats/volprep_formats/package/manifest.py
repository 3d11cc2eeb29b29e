"""manifest.json: the list of a package's files, and how to draw them."""

from typing import Annotated, Literal, get_args

from pydantic import Field

from volprep_formats.grid import Grid, Index
from volprep_formats.package.channel import Channel, ChannelPart, Level, Quantization, SourceRecord, Statistics
from volprep_formats.package.palette import Palette
from volprep_formats.package.parts.compression.record import CompressedForm
from volprep_formats.package.parts.editing.record import Editing
from volprep_formats.package.parts.fidelity.record import LevelFidelity
from volprep_formats.package.parts.hybrid.record import Hybrid
from volprep_formats.package.parts.on_demand.record import OnDemand
from volprep_formats.package.parts.proxy.record import Proxy
from volprep_formats.package.parts.segments.record import Segments
from volprep_formats.package.parts.skip.record import Skipping
from volprep_formats.package.picture import MOST_FRAMES, Drawing, FrameTextures, Picture, SeriesFrame
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import (
    OF_ALL_SAMPLES,
    ComposedProgram,
    LevelStep,
    PictureProgram,
    Program,
    RaySampling,
)
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import Fraction, TransferFunction
from volprep_formats.package.values import ByteCount, PackagePath, Sha256, open_word
from volprep_formats.record import Record
from volprep_formats.source import ChannelName

FileRole = Literal["texture", "shader", "preview", "grid", "subvolume", "bricks", "mesh", "histogram", "work"]
"""Use of a file of a package."""
VERSION = (1, 0)
"""Version of the format that is written: major, minor."""


class FileRecord(Record):
    """One file of the package."""

    path: PackagePath
    """Path inside the package."""
    role: Annotated[str, open_word(*get_args(FileRole))]
    """Use of the file. Working data exists in drafts only. A reader ignores files of other roles."""
    size_bytes: ByteCount
    """Size of the file."""
    sha256: Sha256
    """SHA-256 of the file's bytes."""


class LevelTolerance(Record):
    """Largest error of a level for previews, drawn where one of its voxels covers about one pixel.

    A person who compares the two pictures sees a difference, but not a plain one, and no thin structure is missing.
    Where the tolerance of the package allows more, that holds. The report of a validation has the largest pictures in
    which the level is within it.
    """

    rmse: Fraction = 0.035
    """Root mean square over seen pixels and the four channels, premultiplied linear: 9 or 10 of 255 steps of sRGB at
    middle grey, from where on people see a difference side by side."""
    flip: Fraction = 0.1
    """Mean of FLIP over seen pixels at 67 pixels a degree, over black or white, whichever is larger. Beyond it pictures
    differ plainly."""
    kept_light: Fraction = 0.5
    """Smallest share of the truth's light that each thin structure keeps: the faintest that counts is brighter than
    its surroundings by 0.05, and half of that can still be seen. 0 sets no requirement."""


class Tolerance(Record):
    """Largest error that a standard view may have.

    Errors count over seen pixels: pixels whose opacity or light exceeds half a step of 8 bits in the truth or in the
    picture.
    """

    rmse: Fraction = 0.01
    """Root mean square over seen pixels and the four channels, premultiplied linear values from 0 to 1."""
    maximum: Fraction = 0.25
    """Largest error of one channel of one pixel, premultiplied linear."""
    flip: Fraction = 0.03
    """Mean of FLIP over seen pixels at 67 pixels a degree, over black or white, whichever is larger. An attentive
    person who flips between two pictures hardly notices 0.03."""
    kept_light: Fraction = 0.75
    """Smallest share of the truth's light that each thin structure keeps: anything connected and thinner than two
    voxels of the level, such as a vessel, a strut or a wire. 0 sets no requirement."""
    levels: LevelTolerance = LevelTolerance()
    """Tolerance of levels for previews."""

    @property
    def of_previews(self) -> "Tolerance":
        """The tolerance that a level for previews is judged by: the looser of both; its largest error is not judged."""
        return Tolerance(
            rmse=max(self.rmse, self.levels.rmse),
            maximum=1.0,
            flip=max(self.flip, self.levels.flip),
            kept_light=min(self.kept_light, self.levels.kept_light),
            levels=self.levels,
        )


Projection = Literal["orthographic", "perspective"]
"""Projection of a picture."""


class RenderSettings(Record):
    """Rendering settings of the package. Fragments are premultiplied linear light; alpha is the opacity."""

    projection: Projection = "orthographic"
    """Projection of the standard views."""
    tolerance: Tolerance = Tolerance()
    """Largest error of a standard view against the oracle."""
    hybrid: Hybrid | None = None
    """Hybrid resolution: the volume drawn with few pixels, and lines at full resolution; absent if only the volume is
    drawn."""


class SubvolumeFiles(Record):
    """Level 0 in sub-volumes."""

    grid: PackagePath
    """JSON file with the cuts of the level and its pieces."""
    pieces: tuple[PackagePath, ...] = ()
    """KTX 2 files of the pieces that are not empty, in their order."""
    whole: PackagePath | None = None
    """KTX 2 file of the whole level, which may be a texture, too."""


class PlanItem(Record):
    """One decision of the plan."""

    name: str
    """Name of the item, for people."""
    kind: str = ""
    """Kind of item, for programs, for example "skip-table"; items of one kind differ in channel, transfer function or
    level. The list is open."""
    channel: ChannelName | None = None
    """Channel for which it was decided; absent if it concerns all."""
    transfer: str | None = None
    """Transfer function for which it was decided; absent if it concerns all."""
    level: Index | None = None
    """Level for which it was decided; absent if it concerns all."""
    kept: bool
    """Whether the package includes it."""
    reason: str
    """Reason of the decision."""
    files: tuple[PackagePath, ...] = ()
    """Files that exist because of this item."""
    size_bytes: ByteCount = 0
    """Size if it is kept, or the size saved if it is left out."""


class PartRecords(Record):
    """The parts of a package in its manifest. A new part adds a field or uses an existing one."""

    textures: tuple[Texture, ...] = ()
    """Textures, sorted by name."""
    palettes: tuple[Palette, ...] = ()
    """Palettes of transfer functions, which shaders hold as constants."""
    skipping: Skipping | None = None
    """Empty-space skipping."""
    editing: Editing | None = None
    """Data for apps whose users edit transfer functions."""
    subvolumes: SubvolumeFiles | None = None
    """Level 0 in sub-volumes, for devices that cannot hold it whole."""
    on_demand: OnDemand | None = None
    """All levels in bricks, which a reader fetches as a view needs them."""
    proxy: Proxy | None = None
    """Proxy geometry."""
    preview: PackagePath | None = None
    """Picture of the package, PNG."""

    def textures_of(self, *roles: str, level: int | None = None) -> list[Texture]:
        """Return the textures of some roles, or of all if none is given; with `level`, of one level alone."""
        held = (texture for texture in self.textures if not roles or texture.role in roles)
        return [texture for texture in held if level is None or texture.level == level]

    def levels_of(self, role: str) -> list[int]:
        """Return the levels that have textures of a role, the finest first."""
        return sorted({texture.level for texture in self.textures_of(role) if texture.level is not None})

    def lights(self, *, cut: bool = False) -> dict[str | None, Texture]:
        """Return the textures of light that is computed once, by transfer function: of the whole volume, or cut."""
        return {
            texture.transfer: texture
            for texture in self.textures
            if texture.light is not None and texture.is_of_a_cut == cut
        }

    @property
    def palette_of(self) -> dict[str, Palette]:
        """Palettes by their transfer functions."""
        return {palette.transfer: palette for palette in self.palettes}


class Contribution(PartRecords):
    """Addition of one run of a stage to the manifest, for one channel or for the package."""

    channel: ChannelPart | None = None
    """Addition to the record of its channel."""
    programs: tuple[ComposedProgram, ...] = ()
    """Shader programs."""
    fidelity: tuple[LevelFidelity, ...] = ()
    """Fidelity of pictures to the scan, if the scene requests it."""
    previews: tuple[Index, ...] = ()
    """Levels of its channel that are drawn for previews only."""
    later_frames: tuple[FrameTextures, ...] = ()
    """Textures of the frames after the first one."""


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
    """Additions to the manifest: for the package, for each channel, or for both."""


class Heading(Record):
    """The part of a manifest about the whole package. It follows from scene, profile and plan."""

    name: str
    """Name of the scene."""
    generator: str
    """Program and version that wrote the package."""
    profile: DeviceProfile
    """Class of devices that the package is for."""
    grid: Grid | None = None
    """Voxels of level 0, whether or not the package holds it: all of the source, or a part where its border was
    cropped."""
    frames: Annotated[tuple[SeriesFrame, ...], Field(min_length=1, max_length=MOST_FRAMES)] | None = None
    """Frames of a time series, in the order of time; absent where the package shows one volume."""
    pictures: tuple[Picture, ...] = ()
    """Pictures that a user can choose, the default one first."""
    segments: Segments | None = None
    """Segments of the scan, for the picture that has their name."""
    compression: tuple[CompressedForm, ...] = ()
    """Compressed forms that were considered for the finest level, and the loss of each."""
    render: RenderSettings | None = None
    """Rendering settings of the package."""
    plan: tuple[PlanItem, ...] = ()
    """Every decision, with its reason."""


class Manifest(Heading, PartRecords):
    """The manifest of a package."""

    format: Literal["volpkg"] = "volpkg"
    """Marks the file."""
    version: Annotated[str, Field(pattern=r"^1\.(0|[1-9][0-9]{0,3})$")] = f"{VERSION[0]}.{VERSION[1]}"
    """Version of the format: major.minor. A reader refuses another major version."""
    extensions_used: tuple[str, ...] = ()
    """Names of the extensions whose data the package has, as in glTF."""
    extensions_required: tuple[str, ...] = ()
    """Extensions without which the package cannot be drawn. A reader refuses a package that requires an unknown
    extension."""
    state: Literal["draft", "sealed"]
    """A draft is under construction; only a sealed package may be shipped."""
    channels: tuple[Channel, ...] = ()
    """Channels of the volume; at least one in a package, none in a draft before its source is imported."""
    programs: tuple[Program, ...] = ()
    """Shader programs, which drawings name."""
    stages: tuple[StageRecord, ...] = ()
    """Stages that have run; drafts only."""
    files: tuple[FileRecord, ...] = ()
    """Every file but the manifest, in order of path."""

    @property
    def transfer_functions(self) -> tuple[TransferFunction, ...]:
        """Transfer functions of all channels, the default one first."""
        return tuple(function for channel in self.channels for function in channel.transfer_functions)

    @property
    def holds_labels(self) -> bool:
        """Whether the voxels of a package of one channel are labels, which it samples without mixing them."""
        return any(texture.filter == "nearest" for texture in self.textures_of("volume", "slices"))

    def files_of(self, role: str) -> list[FileRecord]:
        """Return the files of a role."""
        return [record for record in self.files if record.role == role]

    def opaque_length_mm(self, function: TransferFunction) -> float | None:
        """Return the length whose opacity pixels have, if pictures show one value of a ray; None if they show more."""
        of_one_value = all(program.compositing not in OF_ALL_SAMPLES for program in self.programs)
        return function.reference_mm if self.programs and of_one_value else None

    @property
    def levels(self) -> tuple[Level, ...]:
        """Levels that any channel has, finest first, each as the first channel that has it says."""
        by_index = {level.index: level for channel in reversed(self.channels) for level in channel.levels}
        return tuple(by_index[index] for index in sorted(by_index))

    def level(self, index: int | None) -> Level:
        """Return the level of this number."""
        return next(level for level in self.levels if level.index == index)

    def picture(self, name: str | None) -> Picture | None:
        """Return the picture of this name, the default one for None; None if there is no such picture."""
        return next((picture for picture in self.pictures if name in {None, picture.name}), None)

    def grid_of(self, channel: str) -> Grid | None:
        """Return the grid of level 0 of a channel: that of its own pictures, or the one of the package."""
        own = (picture for picture in self.pictures if picture.mixing == "one" and picture.media[0].channel == channel)
        return next((picture.grid for picture in own if picture.grid is not None), self.grid)

    @property
    def box(self) -> Grid:
        """Grid whose box the default picture is drawn in: its own, or that of the finest level."""
        own = next((picture.grid for picture in self.pictures), None)
        return own or self.levels[0].grid

    def at_frame(self, frame: int) -> "Manifest":
        """Return the manifest with the drawings of one frame, and without the textures of others alone."""
        shown = [
            (picture, tuple(drawing for drawing in picture.drawings if (drawing.frame or 0) == frame))
            for picture in self.pictures
        ]
        drawn = {name for _, drawings in shown for drawing in drawings for name in drawing.textures}
        others = {name for _, drawing in self.drawings for name in drawing.textures} - drawn
        skipping = self.skipping
        if skipping is not None:
            tables = tuple(table for table in skipping.tables if table.texture not in others)
            skipping = skipping.model_copy(update={"tables": tables})
        return self.model_copy(
            update={
                "pictures": tuple(picture.model_copy(update={"drawings": drawings}) for picture, drawings in shown),
                "textures": tuple(texture for texture in self.textures if texture.name not in others),
                "skipping": skipping,
            }
        )

    @property
    def level_programs(self) -> tuple[PictureProgram, ...]:
        """Programs that draw levels of each picture with rays through the whole box."""
        named = [(picture, dict.fromkeys(drawing.program for drawing in picture.drawings)) for picture in self.pictures]
        return tuple(self.picture_program(name, picture) for picture, names in named for name in names if name)

    def picture_program(self, name: str, picture: Picture) -> PictureProgram:
        """Return the program of this name as it draws a picture."""
        program = next(program for program in self.programs if program.name == name)
        fields = {field: getattr(program, field) for field in Program.model_fields}
        levels = tuple(drawing.level for drawing in picture.drawings if name in drawing.programs)
        # Pieces are of level 0, as bricks on demand are.
        return PictureProgram(**fields, transfer=picture.name, levels=levels or (0,))

    def skips(self, program: Program) -> bool:
        """Return whether a program looks at skip tables."""
        tables = {texture.name for texture in self.textures_of("skip")}
        return any(
            program.name in drawing.programs and not tables.isdisjoint(drawing.textures) for _, drawing in self.drawings
        )

    @property
    def step_mm(self) -> float | None:
        """Nominal distance of the samples along a ray, in millimetres, in the finest drawing of the default picture."""
        return next((drawing.step_mm for _, drawing in self.drawings), None)

    @property
    def opacity_cutoff(self) -> float | None:
        """Opacity at which rays stop; None if they run to their end."""
        return next((program.opacity_cutoff for program in self.programs), None)

    def rays(self, program: Program) -> RaySampling:
        """Return where the rays of a program take samples, in drawings of the picture that it draws."""
        picture = next(picture for picture in self.pictures if program.name in picture.programs)
        for beside in (picture.pieces, picture.on_demand):
            if beside is not None and program.name == beside.program:
                return RaySampling(step_mm=beside.step_mm, opacity_cutoff=program.opacity_cutoff)
        steps = [
            LevelStep(level=drawing.level, step_mm=drawing.step_mm) for drawing in picture.drawings if drawing.step_mm
        ]
        return RaySampling(step_mm=steps[0].step_mm, level_steps=steps[1:], opacity_cutoff=program.opacity_cutoff)

    @property
    def drawings(self) -> tuple[tuple[Picture, Drawing], ...]:
        """Every drawing with its picture."""
        return tuple((picture, drawing) for picture in self.pictures for drawing in picture.drawings)

    @property
    def previews(self) -> frozenset[int]:
        """Levels that are drawn for previews only."""
        return frozenset(drawing.level for _, drawing in self.drawings if drawing.preview_only)

    def function(self, name: str | None) -> TransferFunction:
        """Return the transfer function of this name."""
        return next(function for function in self.transfer_functions if function.name == name)

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
        """Conversion from stored to physical values of the first channel, or of the only one."""
        return self.channels[0].quantization

    def __repr__(self) -> str:
        """Return one line; `model_dump()` has everything."""
        size = sum(record.size_bytes for record in self.files)
        return f"<Manifest {self.name}: {self.profile.name}, {self.state}, {len(self.files)} files, {size} bytes>"

    __str__ = __repr__
