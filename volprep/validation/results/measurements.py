"""Frozen records of report.json, the measurements of validation. The page shows nothing that is not in here.

Errors are separated by origin. The *data* error is lost in the package's level and quantisation: the oracle on the
package's decoded data against the oracle on the source. The *drawing* error is added by the renderer: its picture
against the oracle on the same data. The drawing error in turn consists of the lookup table's (oracle with the table as
transfer function), the quadrature's (float target, rays running to their end), early termination's, and the target's (8
bits).
"""

from collections.abc import Iterable, Sequence
from statistics import fmean
from typing import Annotated, Literal

from pydantic import Field

from volprep.validation.results.seen import KeptLight, NonNegative, OtherDrawing, SeenNumbers
from volprep.validation.timing.turns import Milliseconds
from volprep_formats.grid import Count
from volprep_formats.package.values import ByteCount
from volprep_formats.record import Record

Decibel = float | None
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Target = Literal["rgba8", "rgba16f", "rgba32f"]
WayName = Literal["neither", "table", "mesh", "both"]


class ErrorNumbers(Record):
    """Errors of one picture against another. All pixels count for `rmse` and `maximum`, seen ones for the rest.

    A pixel is seen if one of the pictures has an opacity or a light of more than half a step of 8 bits there.
    """

    rmse: NonNegative
    """Root mean square over all pixels and the four channels, premultiplied linear values from 0 to 1."""
    maximum: NonNegative
    """Largest difference of one channel of one pixel, premultiplied linear."""
    seen_rmse: NonNegative
    """Root mean square over seen pixels and the four channels, premultiplied linear."""
    off: Fraction
    """Part of the seen pixels with an sRGB channel off by more than 10 of 255, over black or over white."""
    psnr_black_db: Decibel
    """Peak signal to noise over black, sRGB, on the foreground; null if the pictures are the same."""
    psnr_white_db: Decibel
    """Peak signal to noise over white, sRGB, on the foreground; null if the pictures are the same."""
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
    """Whether everything that the tolerance limits is within it."""
    total: ErrorNumbers
    """Rendering against truth."""
    seen: SeenNumbers
    """The visible error, which the tolerance limits."""
    data: ErrorNumbers
    """Oracle on the package's data against truth: the error of level and quantisation. In every second row and column
    of a large picture, except in the view of the sweep."""
    drawing: ErrorNumbers
    """Rendering against the oracle on the package's data: lookup table, quadrature and arithmetic. In the pixels of
    `data`."""
    truth_bound: NonNegative
    """Largest bound of the oracle on its own error over all pixels, for truth and for the package's data. An estimate
    of MIDA, of light from a place, and of lit segments."""
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
    draw: Milliseconds | None
    """Times of a draw; null for a step finer than half of the nominal one whose draws are too slow to repeat seven
    times."""
    total: ErrorNumbers
    """Rendering against truth, with the target of the report."""
    drawing: ErrorNumbers
    """Rendering against the oracle on the level's data, with the target of the report."""
    quadrature: ErrorNumbers | None = None
    """Rendering into a float target, rays running to their end, against the oracle with the lookup table.

    Absent if it was not measured: at coarse levels, and without a float target.
    """


class LevelFloor(Record):
    """Lowest error that one level can reach, in the view of the sweep."""

    level: Annotated[int, Field(ge=0)]
    """Level."""
    shape_zyx: tuple[Count, Count, Count]
    """Voxels."""
    texture_bytes: ByteCount
    """Size of the level's texture files."""
    data: ErrorNumbers
    """Oracle on the level's data against truth."""


class Breakdown(Record):
    """Parts of the error in the sweep's view at the nominal step, at the finest level."""

    data: ErrorNumbers
    """Oracle on the level's data against truth: level and quantisation."""
    table: ErrorNumbers
    """Oracle with the lookup table against the oracle with the control points, both on the level's data."""
    quadrature: ErrorNumbers | None
    """Rendering into a float target, rays running to their end, against the oracle with the table.

    Null if the driver has no float target, or if the package's shader is not the one that this version of volprep
    composes, so that the error of termination cannot be separated.
    """
    termination: ErrorNumbers | None
    """Change by early ray termination in the float target; null as above."""
    target: ErrorNumbers | None
    """Rendering into the 8-bit target against the one into the float target; null as above. Of stacks of slices against
    the same in double precision."""
    texels: ErrorNumbers | None = None
    """For stacks of slices: their texels composited in double precision, with the opacity of each ray's path between
    two slices, against truth: classification before the filter, distance of the slices, palettes and bits."""
    angle: ErrorNumbers | None = None
    """For stacks of slices: the change by multiplying opacities instead, for rays that meet slices at an angle."""


class Convergence(Record):
    """Order of the quadrature error under step refinement."""

    expected: float
    """2 for midpoint samples with exponential opacity."""
    slopes: tuple[float, ...]
    """Slope of log error over log step from each step to the next finer one; empty without a float target."""
    observed: float | None
    """Slope fitted to the finest steps whose slopes agree; null if none do."""
    fitted_steps_mm: tuple[float, ...]
    """Steps that `observed` was fitted to."""
    limits: tuple[str, ...]
    """Reason why the slope differs from the expected one, in words."""


class Sweep(Record):
    """Error against run time: one view, several step sizes, several levels."""

    view: str
    """View that was drawn."""
    timed_size: Count
    """Width and height of the timed pictures: as in the report, or a quarter or a sixteenth of their
    pixels where the driver is slow."""
    float_target: Target | None
    """Target of the quadrature numbers; null if they were not measured."""
    points: tuple[SweepPoint, ...]
    """Measured points, level by level, coarsest step first."""
    floors: tuple[LevelFloor, ...]
    """Lowest error of each level, finest level first."""
    breakdown: Breakdown
    """Parts of the error at the nominal step."""
    convergence: Convergence
    """Order of convergence at the finest level."""

    def of_level(self, level: int) -> list[SweepPoint]:
        """Return the points of a level."""
        return [point for point in self.points if point.level == level]


class LevelComparison(Record):
    """Gain of a coarse level from how it was made: the oracle on the data against truth, in the view of the sweep."""

    level: Annotated[int, Field(ge=1)]
    """Level."""
    filter: str
    """Filter that made it."""
    box: ErrorNumbers
    """The box filter, with the unmodified transfer function."""
    common: ErrorNumbers
    """The filter, with the unmodified transfer function."""
    own: ErrorNumbers | None
    """The filter, with the level's own lookup table; null if it has none."""
    picture: str
    """File of the pictures over black, side by side: box, the filter, with its own table if there is one, truth."""


class SavingView(Record):
    """Cost of one standard view, drawn in one way."""

    view: str
    """Name of the standard view."""
    samples_mean: NonNegative | None
    """Samples of a ray that meets the volume, mean.

    Null without a float target, which holds the counts, and if no counted ray meets the volume: a thin slab, seen from
    its edge, can lie between the rays.
    """
    looks_mean: NonNegative | None
    """Entries of the skip table that such a ray reads, mean; null as above."""
    difference: NonNegative
    """Largest difference of one channel of one pixel from the picture with neither table nor mesh.

    In perspective, over the pixels whose rays have the same number of samples however float32 rounds.
    """


class SavingWay(Record):
    """Drawing with some of the empty-space techniques."""

    way: WayName
    """Empty-space technique: neither, the skip table, the mesh where rays begin, or both."""
    draw: Milliseconds
    """Times of a draw in the view of the sweep; for the last way, the times of the nominal step in the sweep."""
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
    """Savings of skip tables and proxy geometry, and the proof that they change no picture."""

    drawn_by: str
    """Name of the program that draws as the package does."""
    ways: Annotated[tuple[SavingWay, ...], Field(min_length=2)]
    """With neither first, as the package is drawn last."""
    limit: NonNegative
    """Largest allowed difference: a step of 8 bits, the opacity that the scene lets both leave out of a ray, and
    rounding."""
    rounding: NonNegative
    """Largest change of a picture on this driver when rays are moved by as little as rounding moves them; 0 if no
    picture differed enough to need this measurement."""
    passed: bool
    """Whether all views of all ways are within that."""
    mesh_read_ms: NonNegative | None
    """Median time of reading the mesh's file, with its decompression, in milliseconds; null without a mesh."""
    picture: str | None
    """File of the samples of each pixel in the view of the sweep, the ways side by side; null if not counted."""


class TracedLight(Record):
    """Precomputed light against path tracing of the scan, over visible pixels."""

    rmse: NonNegative
    """Root mean square error of premultiplied linear colours, without the noise of the paths."""
    rmse_below: NonNegative
    """Upper bound of the RMSE, three standard errors above the estimate."""
    noise_rmse: NonNegative
    """Root mean square noise of the path traced pictures, which is subtracted."""
    pixels: Annotated[int, Field(ge=0)]
    """Pixels that were compared."""
    paths: Count
    """Paths of each pixel."""
    orientations: Count = 1
    """Orientations of the light around the volume: 2 if an app may turn it."""
    passed: bool
    """Whether the error is within the tolerance's root mean square, or beyond it by no more than noise can explain."""


class ProgramResult(Record):
    """Results of one shader program."""

    program: str
    """Name of the program in the manifest."""
    technique: str
    """Its rendering technique."""
    transfer: str
    """Name of the transfer function that it draws."""
    level: Annotated[int, Field(ge=0)]
    """Finest level that it draws: the level of the nine views."""
    views: tuple[ViewResult, ...]
    """Standard views."""
    sweep: Sweep
    """Error against run time."""
    levels: tuple[LevelComparison, ...] = ()
    """Gains of the coarse levels from how they were made, finest first."""
    empty_space: EmptySpace | None = None
    """Savings of its skip table and its mesh; null if it has neither."""
    light: TracedLight | None = None
    """Its precomputed light against path tracing; null if it has none."""
    cut_light: TracedLight | None = None
    """Its light of the cut volume against path tracing of that volume; null if it has none."""
    others: tuple[OtherDrawing, ...] = ()
    """Coarse levels, pieces of level 0, an edit and a cut that are drawn with the same transfer function."""
    kept_light: tuple[KeptLight, ...] = ()
    """Light that thin things keep at each level, finest first; levels without thin things are left out."""

    @property
    def settled(self) -> OtherDrawing | None:
        """The picture of level 0 that a device settles on, from the bricks on demand that it holds.

        None if the nine views are of level 0, or there are no bricks.
        """
        from_bricks = (other for other in self.others if other.bound is not None)
        return next(from_bricks, None) if self.level > 0 else None

    @property
    def traced_lights(self) -> tuple[TracedLight, ...]:
        """Its precomputed light, of the whole volume and of the cut one, against path tracing."""
        return tuple(light for light in (self.light, self.cut_light) if light is not None)


class Deviation(Record):
    """Something in the package that does not follow from scene and scan."""

    code: str
    """Code of its diagnostic."""
    item: str
    """Item of the package with the difference."""
    problem: str
    """Description of the difference."""


class Derivation(Record):
    """The package made again from scene and scan, and compared byte by byte."""

    files: Count
    """Number of files that were derived and compared."""
    size_bytes: ByteCount
    """Their size."""
    findings: tuple[Deviation, ...] = ()
    """Differences from the derived package; empty for a package that may ship."""

    @property
    def items(self) -> tuple[str, ...]:
        """Differing items, each once."""
        return tuple(dict.fromkeys(finding.item for finding in self.findings))

    def with_findings(self, found: Iterable[Deviation]) -> "Derivation":
        """Return the record with more findings."""
        return self.model_copy(update={"findings": (*self.findings, *found)})


class Driver(Record):
    """The OpenGL ES that drew the pictures."""

    vendor: str
    """GL_VENDOR."""
    renderer: str
    """GL_RENDERER."""
    version: str
    """GL_VERSION."""
