"""A transfer function in a scene: its own points, a preset, or a file of another program."""

from typing import Annotated, Self

from pydantic import Field, ValidationError, model_validator

from volprep.scene.points import ANY_SCAN, Measure, PhysicalValue, TransferWish
from volprep.scene.presets import load_preset
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.record import problems
from volprep_formats.source import ChannelName


class SceneTransfer(TransferWish):
    """A transfer function: a preset, a file, or points."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9_-]+$")]
    """Name, unique in the scene; lower-case letters, digits, - and _. If absent, a preset has its own name."""
    channel: ChannelName | None = None
    """Channel whose values it maps, if the source has several; if absent, the first one."""
    preset: str | None = None
    """A transfer function that comes with volprep; volprep presets lists them."""
    file: str | None = None
    """File of 3D Slicer (.vp), ParaView (.json) or ITK-SNAP (labels, .txt); relative to the scene. Its opacities are
    for a path of reference_mm, or of 1 mm if that is absent. Or a record of looks (.json), whose function of this name,
    or only function, is taken with its own extinctions."""

    isovalue: PhysicalValue | None = None
    """Value of the surface that the compositings isosurface and first-hit show, in the unit of the points' values."""

    intensities: tuple[PhysicalValue, PhysicalValue] | None = None
    """Values that map to the intensities 0 and 1 with the compositing mida, in the unit of the points' values; if
    absent, the values of the first and the last point."""

    @model_validator(mode="before")
    @classmethod
    def _preset_names(cls, data: object) -> object:
        if isinstance(data, dict) and "name" not in data and isinstance(data.get("preset"), str):
            return {**data, "name": data["preset"]}
        return data

    @model_validator(mode="after")
    def _is_a_function(self) -> Self:
        ways = [self.preset is not None, self.file is not None, bool(self.points)]
        if sum(ways) != 1:
            msg = "it needs points, or a preset, or a file: one of them"
            raise ValueError(msg)
        if self.file is None:
            try:
                self.resolved(ANY_SCAN)
            except ValidationError as error:
                raise ValueError(problems(error)) from error
        return self

    @property
    def wish(self) -> TransferWish:
        """The points and the meaning of their numbers, from any source. Raises ValueError for an unknown preset."""
        if self.preset is None:
            return self
        return load_preset(self.preset)

    def resolved(self, measure: Measure = ANY_SCAN) -> TransferFunction:
        """Return the function over physical values; `measure` counts where the numbers are relative to the scan."""
        function = self.wish.function(self.name, measure)
        more: dict[str, object] = {}
        if self.isovalue is not None:
            more["isovalue"] = self.wish.physical(self.isovalue, measure)
        if self.intensities is not None:
            low, high = self.intensities
            more["intensities"] = (self.wish.physical(low, measure), self.wish.physical(high, measure))
        return function.model_copy(update=more)
