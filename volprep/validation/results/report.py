"""report.json: one validation of one package. The page shows nothing that is not in here."""

from typing import Annotated, Literal

from pydantic import Field

from volprep.plan.device_records import DeviceRecord
from volprep.plan.form_trial import FormTrial
from volprep.plan.level_choice import LevelChoice
from volprep.validation.results.measurements import Derivation, Driver, ProgramResult, Target
from volprep.validation.results.seen import NonNegative
from volprep.validation.verdicts.verdict import Verdict
from volprep.validation.witness.records import Witness
from volprep_formats.grid import Count
from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.package.values import ByteCount, Sha256
from volprep_formats.record import Record


class Cost(Record):
    """Environment and duration of the validation."""

    seconds: dict[str, float]
    """Wall time of each part, by name, in seconds."""
    threads: Count
    """Threads of the oracle."""
    peak_memory_bytes: ByteCount
    """Largest resident memory of the process, with files that the system has mapped, and can let go of."""
    source_bytes: ByteCount
    """Size of the source volume, a file that the system maps into memory where rays read it."""


class PackageFacts(Record):
    """Package that was validated."""

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
    """Package that was validated."""
    picture_size: Count
    """Width and height of the pictures, in pixels."""
    target: Target
    """Render target of the pictures that were judged."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal step of the package; the views are drawn with it."""
    tolerance: Tolerance
    """Largest error that a view may have."""
    oracle_tolerance: NonNegative
    """Bound that the oracle was asked to keep for each channel. A view whose verdict is clear has a drafted truth, with
    the larger bound that its `truth_bound` states."""
    difference_gain: Annotated[float, Field(gt=0.0)]
    """Factor on the differences in the pictures named `difference`."""
    verdict: Verdict
    """Whether the package may ship."""
    warnings: tuple[str, ...] = ()
    """Warnings for users of the package: full resolution that it lacks, functions that show nothing."""
    derivation: Derivation | None = None
    """Contents that were derived again from the scan and compared."""
    witness: Witness | None = None
    """Result of the second renderer; null if none was requested."""
    layout_picture: str | None = None
    """File of a figure of proxy meshes, bricks, sub-volumes or slices; null without any, or without VTK."""
    programs: tuple[ProgramResult, ...]
    """Results of each program."""
    made: tuple[LevelChoice, ...] = ()
    """How each coarse level was made, and the alternatives that were tried, as the build noted beside the package."""
    forms: tuple[FormTrial, ...] = ()
    """Compressed forms that were considered; the cost of encoding is noted beside the package."""
    devices: tuple[DeviceRecord, ...] = ()
    """Measurements of this package on devices."""
    driver: Driver
    """The OpenGL ES that drew the pictures."""
    cost: Cost
    """Environment and duration of the validation."""

    def __repr__(self) -> str:
        """Return one line; `verdict` and `model_dump()` have the numbers."""
        return f"<Report: {self.verdict.code}, {self.verdict.failed} pictures beyond>"

    __str__ = __repr__
