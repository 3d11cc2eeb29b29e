"""report.json: what validation measured, as frozen records. The page shows nothing that is not in here.

An error is told apart by its origin. The *data* error is what the package's level and quantisation lost: the oracle
on the package's decoded data against the oracle on the source. The *drawing* error is what the renderer adds: its
picture against the oracle on the same data. The drawing error in turn is the lookup table's (oracle with the table
as transfer function), the quadrature's (float target, rays running to their end), early termination's, and the
target's (8 bits).
"""

from collections.abc import Iterable, Sequence
from statistics import fmean
from typing import Annotated, Literal

from pydantic import Field

from volprep.parts.levels.records import LevelChoice
from volprep.plan.device_records import DeviceRecord
from volprep.plan.form_trial import FormTrial
from volprep.validation.ablation.records import Ablation
from volprep.validation.witness.records import Witness
from volprep_formats.grid import Count
from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.package.values import ByteCount, Sha256
from volprep_formats.record import Record

NonNegative = Annotated[float, Field(ge=0.0)]
Decibel = float | None
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Target = Literal["rgba8", "rgba16f", "rgba32f"]
WayName = Literal["neither", "table", "mesh", "both"]


class ErrorNumbers(Record):
    """How far one picture is from another. All pixels of the picture count for `rmse` and `maximum`."""

    rmse: NonNegative
    """Root mean square over all pixels and the four channels, premultiplied linear values from 0 to 1."""
    maximum: NonNegative
    """Largest difference of one channel of one pixel, premultiplied linear."""
    psnr_black_db: Decibel
    """Peak signal to noise over black, sRGB, on the foreground; null where the pictures are the same."""
    psnr_white_db: Decibel
    """Peak signal to noise over white, sRGB, on the foreground; null where the pictures are the same."""
    ssim_black: float
    """Structural similarity over black, sRGB, on the foreground; 1 where the pictures are the same."""
    ssim_white: float
    """Structural similarity over white, sRGB, on the foreground; 1 where the pictures are the same."""


class ViewPictures(Record):
    """Files of one view's pictures, in the folder of the report."""

    truth_black: str
    """Oracle on the source, over black."""
    drawn_black: str
    """Rendering, over black."""
    difference: str
    """Largest difference of a pixel's channels, amplified; see `difference_gain` of the report."""
    truth_white: str
    """Oracle on the source, over white."""
    drawn_white: str
    """Rendering, over white."""


class ViewResult(Record):
    """One standard view at the finest level of the package, drawn with the nominal step."""

    view: str
    """Name of the standard view."""
    passed: bool
    """Whether the total error is within the tolerance, in rmse and in maximum."""
    total: ErrorNumbers
    """Rendering against truth."""
    data: ErrorNumbers
    """Oracle on the package's data against truth: what level and quantisation lost."""
    drawing: ErrorNumbers
    """Rendering against the oracle on the package's data: lookup table, quadrature and arithmetic."""
    truth_bound: NonNegative
    """Largest bound of the oracle on its own error, truth and package's data alike, over all pixels."""
    pictures: ViewPictures
    """Files of the pictures."""


class SweepPoint(Record):
    """One step size at one level."""

    level: Annotated[int, Field(ge=0)]
    """Level that was drawn."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Distance of the samples."""
    step_ratio: Annotated[float, Field(gt=0.0)]
    """Step over the nominal step of the level."""
    samples_mean: NonNegative
    """Samples per ray that meets the volume, mean; early termination takes fewer."""
    samples_max: Annotated[int, Field(ge=0)]
    """Samples of the longest ray."""
    draw_ms: NonNegative
    """Median time of a draw, in milliseconds."""
    draws: Count
    """Draws that were timed, after one that was not."""
    total: ErrorNumbers
    """Rendering against truth, with the target of the report."""
    drawing: ErrorNumbers
    """Rendering against the oracle on the level's data, with the target of the report."""
    quadrature: ErrorNumbers | None = None
    """Rendering into a float target, rays running to their end, against the oracle with the lookup table.

    Absent where it was not measured: at coarse levels, and without a float target.
    """


class LevelFloor(Record):
    """What one level can reach at best, in the view of the sweep."""

    level: Annotated[int, Field(ge=0)]
    """Level."""
    shape_zyx: tuple[Count, Count, Count]
    """Voxels."""
    texture_bytes: ByteCount
    """Size of the level's texture files."""
    data: ErrorNumbers
    """Oracle on the level's data against truth."""


class Breakdown(Record):
    """Where the error of the sweep's view at the nominal step comes from, at the finest level."""

    data: ErrorNumbers
    """Oracle on the level's data against truth: level and quantisation."""
    table: ErrorNumbers
    """Oracle with the lookup table against the oracle with the control points, both on the level's data."""
    quadrature: ErrorNumbers | None
    """Rendering into a float target, rays running to their end, against the oracle with the table.

    Null where the driver has no float target, or where the package's shader is not the one that this version of
    volprep composes, so that termination cannot be told apart.
    """
    termination: ErrorNumbers | None
    """What early ray termination changes in the float target; null as above."""
    target: ErrorNumbers | None
    """Rendering into the 8-bit target against the one into the float target; null as above. Of stacks of slices against
    the same in double precision."""
    texels: ErrorNumbers | None = None
    """Of stacks of slices: their texels composited in double precision, with the opacity of each ray's path between two
    slices, against truth: classification before the filter, distance of the slices, palettes and bits."""
    angle: ErrorNumbers | None = None
    """Of stacks of slices: what multiplying opacities in place of that changes where rays meet slices at an angle."""


class Convergence(Record):
    """Order with which the quadrature error falls as the step is refined."""

    expected: float
    """2 for midpoint samples with exponential opacity."""
    slopes: tuple[float, ...]
    """Slope of log error over log step from each step to the next finer one; empty without a float target."""
    observed: float | None
    """Slope fitted to the finest steps whose slopes agree; null where none do."""
    fitted_steps_mm: tuple[float, ...]
    """Steps that `observed` was fitted to."""
    limits: tuple[str, ...]
    """What keeps the slope from the expected one, in words."""


class Sweep(Record):
    """Error against run time: one view, several step sizes, several levels."""

    view: str
    """View that was drawn."""
    float_target: Target | None
    """Target of the quadrature numbers; null where they were not measured."""
    points: tuple[SweepPoint, ...]
    """Measured points, level by level, coarsest step first."""
    floors: tuple[LevelFloor, ...]
    """What each level can reach, finest level first."""
    breakdown: Breakdown
    """Where the error at the nominal step comes from."""
    convergence: Convergence
    """Order of convergence at the finest level."""


class LevelComparison(Record):
    """What a coarse level gained by how it was made: the oracle on the data against truth, in the view of the sweep."""

    level: Annotated[int, Field(ge=1)]
    """Level."""
    filter: str
    """Filter that made it."""
    box: ErrorNumbers
    """The box filter, with the transfer function as it is."""
    common: ErrorNumbers
    """The filter, with the transfer function as it is."""
    own: ErrorNumbers | None
    """The filter, with the level's own lookup table; null where it has none."""
    picture: str
    """File of the pictures over black, side by side: box, the filter, with its own table if there is one, truth."""


class SavingView(Record):
    """What one standard view takes, drawn in one way."""

    view: str
    """Name of the standard view."""
    samples_mean: NonNegative | None
    """Samples of a ray that meets the volume, mean; null without a float target, into which they are counted."""
    looks_mean: NonNegative | None
    """Entries of the skip table that such a ray reads, mean; null as above."""
    difference: NonNegative
    """Largest difference of one channel of one pixel from the picture with neither table nor mesh.

    In perspective, over the pixels whose rays have the same number of samples however float32 rounds.
    """


class SavingWay(Record):
    """Drawing with some of what leaves out empty space."""

    way: WayName
    """What leaves out empty space: neither, the skip table, the mesh at which rays begin, or both."""
    draw_ms: NonNegative
    """Median time of a draw in the view of the sweep, in milliseconds."""
    draws: Count
    """Draws that were timed, after one that was not."""
    views: Annotated[tuple[SavingView, ...], Field(min_length=1)]
    """Standard views."""

    @property
    def samples_mean(self) -> float | None:
        """Samples of a ray that meets the volume, mean of the views."""
        return _mean([view.samples_mean for view in self.views])

    @property
    def looks_mean(self) -> float | None:
        """Entries of the skip table that such a ray reads, mean of the views."""
        return _mean([view.looks_mean for view in self.views])

    @property
    def difference(self) -> float:
        """Largest difference of any view from the picture with neither table nor mesh."""
        return max(view.difference for view in self.views)


def _mean(each: Sequence[float | None]) -> float | None:
    found = [number for number in each if number is not None]
    return fmean(found) if found else None


class EmptySpace(Record):
    """What skip tables and proxy geometry save, and that they change no picture."""

    drawn_by: str
    """Name of the program that draws as the package does."""
    ways: Annotated[tuple[SavingWay, ...], Field(min_length=2)]
    """With neither first, as the package is drawn last."""
    limit: NonNegative
    """Largest difference that there may be: a step of 8 bits, what the scene lets both take from a ray, rounding."""
    rounding: NonNegative
    """What rays that are moved as little as rounding moves them change at most, on this driver; 0 where no picture
    differs so much that it was measured."""
    passed: bool
    """Whether all views of all ways are within that."""
    mesh_read_ms: NonNegative | None
    """Median time of reading the mesh's file, with its decompression, in milliseconds; null without a mesh."""
    picture: str | None
    """File of the samples of each pixel in the view of the sweep, the ways side by side; null where not counted."""


class OtherView(Record):
    """One standard view of something that is not drawn at the finest level of the package."""

    view: str
    """Name of the standard view."""
    passed: bool
    """Whether the error is within the tolerance, in rmse; of pieces also in maximum."""
    rmse: NonNegative
    """Root mean square error over all pixels and channels, premultiplied linear."""
    maximum: NonNegative
    """Largest difference of one channel of one pixel, premultiplied linear."""


class OtherDrawing(Record):
    """A coarse level, the pieces of level 0, an edit or a cut, drawn in standard views and judged."""

    item: str
    """What is drawn."""
    program: str
    """Name of the program that draws it."""
    level: Annotated[int, Field(ge=0)] | None = None
    """Level that is drawn; null for a cut, which is part of none."""
    preview_only: bool = False
    """Whether it is a level for previews only, whose errors are told and not judged."""
    pixels: Count
    """Width and height of the pictures: one pixel for a voxel of a level, or as large as those of the report."""
    views: Annotated[tuple[OtherView, ...], Field(min_length=1)]
    """Standard views."""

    @property
    def passed(self) -> bool:
        """Whether all views are within the tolerance."""
        return all(view.passed for view in self.views)

    @property
    def rmse(self) -> float:
        """RMSE of the worst view."""
        return max(view.rmse for view in self.views)


class ProgramResult(Record):
    """What one shader program draws."""

    program: str
    """Name of the program in the manifest."""
    technique: str
    """How it goes through the volume."""
    transfer: str
    """Name of the transfer function that it draws."""
    level: Annotated[int, Field(ge=0)]
    """Finest level that it draws: the level of the nine views."""
    views: tuple[ViewResult, ...]
    """Standard views."""
    sweep: Sweep
    """Error against run time."""
    levels: tuple[LevelComparison, ...] = ()
    """What the coarse levels gained by how they were made, finest first."""
    empty_space: EmptySpace | None = None
    """What its skip table and its mesh save; null where it has neither."""
    others: tuple[OtherDrawing, ...] = ()
    """Coarse levels, pieces of level 0, an edit and a cut that are drawn with the same transfer function."""


class Deviation(Record):
    """Something in the package that does not follow from scene and scan."""

    code: str
    """Code of the diagnostic that it is told by."""
    item: str
    """What it is found in."""
    problem: str
    """What is wrong with it."""


class Derivation(Record):
    """The package made again from scene and scan, and compared byte by byte."""

    files: Count
    """Number of files that were derived and compared."""
    size_bytes: ByteCount
    """Their size."""
    findings: tuple[Deviation, ...] = ()
    """What differs; nothing in a package that may ship."""

    @property
    def items(self) -> tuple[str, ...]:
        """What differs, each item once."""
        return tuple(dict.fromkeys(finding.item for finding in self.findings))

    def with_findings(self, found: Iterable[Deviation]) -> "Derivation":
        """Return the record with what else was found."""
        return self.model_copy(update={"findings": (*self.findings, *found)})


class PreviewOutcome(Record):
    """A level for previews only, and how far its pictures are from the truth."""

    item: str
    """What was drawn."""
    rmse: NonNegative
    """Root mean square error of the worst view, with one pixel for a voxel of the level."""
    within: bool
    """Whether it is within the tolerance all the same."""


class Verdict(Record):
    """Whether the package may ship, and the view that comes closest to its limit or is furthest beyond it."""

    passed: bool
    """Whether every view of every program is within the tolerance, no skip table and no mesh changes one, everything
    follows from the scan, and everything was judged."""
    views: Count
    """Number of pictures that were judged."""
    failed: Annotated[int, Field(ge=0)]
    """Number of pictures beyond the tolerance."""
    changed: tuple[str, ...] = ()
    """Programs whose skip table or mesh changes a picture, which is a defect whatever the tolerance."""
    differing: tuple[str, ...] = ()
    """Items that do not follow from scene and scan."""
    beyond: tuple[str, ...] = ()
    """Coarse levels, pieces of level 0, edits and cuts of which a view is beyond the tolerance; not those for previews
    only."""
    previews: tuple[PreviewOutcome, ...] = ()
    """Levels for previews only, with what their pictures had: they are told, and decide nothing."""
    unproved: tuple[str, ...] = ()
    """What the package ships and no picture has judged."""
    disagreeing: tuple[str, ...] = ()
    """Programs whose pictures, or whose truth, a second renderer does not agree with."""
    worst_program: str
    """Program of the worst view."""
    worst_view: str
    """The worst view: the one with the largest share of a tolerance."""
    worst_rmse: NonNegative
    """Its root mean square error."""
    worst_maximum: NonNegative
    """Its largest error."""
    worst_data_rmse: NonNegative
    """Its root mean square error that level and quantisation made."""
    worst_drawing_rmse: NonNegative
    """Its root mean square error that the renderer made."""
    share: NonNegative
    """Its error over the tolerance, the larger of the two shares; above 1 it fails."""


class Driver(Record):
    """The OpenGL ES that drew the pictures."""

    vendor: str
    """GL_VENDOR."""
    renderer: str
    """GL_RENDERER."""
    version: str
    """GL_VERSION."""


class Cost(Record):
    """What validation took."""

    seconds: dict[str, float]
    """Wall time of each part, by name, in seconds."""
    threads: Count
    """Threads of the oracle."""
    peak_memory_bytes: ByteCount
    """Largest resident memory of the process, with files that the system has mapped, and can let go of."""
    source_bytes: ByteCount
    """Size of the source volume, a file that the system maps into memory where rays read it."""


class PackageFacts(Record):
    """What was validated."""

    file_name: str
    """Name of the package's folder."""
    manifest_sha256: Sha256
    """Digest of manifest.json, which names the digests of all other files."""
    size_bytes: ByteCount
    """Size of all files of the package with the manifest."""
    manifest: Manifest
    """The manifest."""


class Report(Record):
    """One validation of one package."""

    format: Literal["volprep-report"] = "volprep-report"
    """Marks the file."""
    version: Literal["1.0"] = "1.0"
    """Version of the format: major.minor."""
    generator: str
    """Program and version that validated."""
    package: PackageFacts
    """What was validated."""
    picture_size: Count
    """Width and height of the pictures, in pixels."""
    target: Target
    """Render target of the pictures that were judged."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal step of the package, with which the views are drawn."""
    tolerance: Tolerance
    """Largest error that a view may have."""
    oracle_tolerance: NonNegative
    """Bound that the oracle was asked to keep for each channel."""
    difference_gain: Annotated[float, Field(gt=0.0)]
    """Factor on the differences in the pictures named `difference`."""
    verdict: Verdict
    """Whether the package may ship."""
    derivation: Derivation | None = None
    """What was derived again from the scan and compared."""
    witness: Witness | None = None
    """What a second renderer says; null where none was asked."""
    layout_picture: str | None = None
    """File of a figure of proxy meshes, bricks, sub-volumes or slices; null where there are none, or without VTK."""
    ablation: Ablation | None = None
    """What each item of the package is worth; null where it was not measured."""
    programs: tuple[ProgramResult, ...]
    """What each program draws."""
    made: tuple[LevelChoice, ...] = ()
    """How each coarse level was made and what else was tried, as the build noted it beside the package."""
    forms: tuple[FormTrial, ...] = ()
    """Compressed forms that were considered; what encoding took stands beside the package."""
    devices: tuple[DeviceRecord, ...] = ()
    """What devices have measured of this package."""
    driver: Driver
    """The OpenGL ES that drew the pictures."""
    cost: Cost
    """What validation took."""
