"""Records of the witnesses: VTK's pictures, and the second reading."""

from typing import Annotated

from pydantic import Field

from volprep.validation.witness.check import WitnessCheck
from volprep_formats.grid import Count
from volprep_formats.record import Record

NonNegative = Annotated[float, Field(ge=0.0)]


class WitnessView(Record):
    """One standard view that VTK has drawn from the scan."""

    view: str
    """Name of the standard view."""
    passed: bool
    """Whether it agrees with the truth, and with the package's picture."""
    truth_rmse: NonNegative
    """VTK's picture against the oracle's, root mean square over all pixels and channels, premultiplied linear."""
    truth_maximum: NonNegative
    """Largest difference of one channel of one pixel, premultiplied linear; reported, not judged."""
    drawn_rmse: NonNegative
    """VTK's picture against the one that the package draws, root mean square."""
    bound: NonNegative
    """Largest error of VTK's own picture, root mean square; the error against truth must stay below it, that
    against the package's picture below it and the scene's tolerance together."""
    step_part: NonNegative
    """The part of the bound that its steps and its samples of the transfer function make."""


class WitnessedProgram(Record):
    """The finest level of one transfer function, witnessed."""

    program: str
    """Name of the program whose pictures are compared."""
    transfer: str
    """Name of the transfer function."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Distance of VTK's samples."""
    entries: Count
    """Samples of the transfer function that VTK interpolates between."""
    views: Annotated[tuple[WitnessView, ...], Field(min_length=1)]
    """Standard views."""
    picture: str
    """File of the view of the sweep: truth, the package and VTK over black, and VTK's difference from the truth."""

    @property
    def passed(self) -> bool:
        """Whether VTK agrees in all views."""
        return all(view.passed for view in self.views)


class NotWitnessed(Record):
    """Something that a witness cannot read or draw as it should be."""

    item: str
    """Name of the program or item."""
    reason: str
    """The reason."""


class Witness(Record):
    """VTK's pictures of the scan with the same cameras and transfer functions, and the second reading."""

    renderer: str | None
    """VTK and pyvista with their versions; null if there was nothing that VTK can draw."""
    driver: str | None
    """The OpenGL that VTK drew with: GL_RENDERER and GL_VERSION; null as above."""
    programs: tuple[WitnessedProgram, ...]
    """Programs that VTK drew."""
    missing: tuple[NotWitnessed, ...] = ()
    """Programs and items that no witness covers."""
    checks: tuple[WitnessCheck, ...] = ()
    """Comparisons of the second reading of scan, scene and package."""

    @property
    def disagreeing(self) -> tuple[str, ...]:
        """Programs with a view that VTK does not agree with."""
        return tuple(program.program for program in self.programs if not program.passed)

    @property
    def unwitnessed(self) -> tuple[str, ...]:
        """Items that no witness covers, with the reasons."""
        return tuple(f"{witnessed.item} ({witnessed.reason})" for witnessed in self.missing)

    @property
    def contradicted(self) -> tuple[str, ...]:
        """Items about which the second reading disagrees."""
        return tuple(check.item for check in self.checks if not check.passed)
