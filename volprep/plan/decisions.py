"""Results of the decisions about one channel, with their reasons. The rooms of `volprep.parts` make them."""

from dataclasses import dataclass

from volprep.plan.form_trial import FormTrial
from volprep.plan.probe import PictureDifference, Quantizer
from volprep.plan.records import (
    ChannelPlan,
    LevelPlan,
    LookupPlan,
    PalettePlan,
    PreintegratedPlan,
    QuantizePlan,
    VolumePlan,
)
from volprep.plan.room import Beside, Misfit
from volprep.scene.scene import LightFactor
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ProgramDesign
from volprep_formats.textures.block_formats import CompressedFormat


@dataclass(frozen=True)
class ValueChoice:
    """A quantizer and tables, and their errors."""

    quantize: QuantizePlan
    """Bits and window."""
    quantizer: Quantizer
    """The same, with the rounding of texels."""
    entries: int
    """Length of each lookup table."""
    error: PictureDifference
    """Largest change that codes and tables together make in the sample of rays, over all transfer functions."""
    lit_error: PictureDifference | None
    """Largest change that codes make in lit rays; None where nothing is lit, or codes are exact."""
    normals_error: PictureDifference | None
    """The same with the code of normals that the package holds; None where no light reads any."""
    narrow_error: PictureDifference | None
    """The change with 8 bits, lit or not, where 16 were chosen because of it."""
    exact: bool
    """Whether every stored value of the source has a code of its own."""


@dataclass(frozen=True)
class Layout:
    """Levels and their textures."""

    profile: DeviceProfile
    """Device class as far as levels are concerned: it has no 3D textures if they are compressed."""
    beside: Beside
    """Room that tables and passes take beside each level."""
    candidates: list[LevelPlan]
    """Levels that there could be."""
    fits: list[VolumePlan | Misfit]
    """Texture of each candidate, or why the device class cannot hold it."""
    levels: tuple[LevelPlan, ...]
    """Levels that the package holds, finest first."""
    volumes: tuple[VolumePlan, ...]
    """Their textures."""
    programs: tuple[ProgramDesign, ...] = ()
    """Programs that draw them, one for each transfer function that has pictures of its own."""


@dataclass(frozen=True)
class Packed:
    """Levels that several channels share, if any, and the decisions."""

    volumes: tuple[VolumePlan, ...]
    """Textures in common, of each level."""
    reason: str
    """Why channels share texels, or why they do not."""
    items: tuple[PlanItem, ...]
    """The decision, where there is one to make."""

    def of(self, plan: ChannelPlan) -> tuple[VolumePlan, ...]:
        """Return the textures of a channel: the ones it shares, or its own."""
        return self.volumes if any(plan.channel in volume.channels for volume in self.volumes) else plan.volumes


@dataclass(frozen=True)
class CompressionChoice:
    """Compressed form of the levels, and the trials."""

    form: CompressedFormat | None = None
    """Form that was chosen; None if levels are not compressed."""
    items: tuple[PlanItem, ...] = ()
    """The decision for people, one item for each form that was tried."""
    forms: tuple[FormTrial, ...] = ()
    """Results of the trials."""


@dataclass(frozen=True)
class CutChoice:
    """Whether the volume that the scene's planes cut has light of its own."""

    kept: bool
    """Whether it has."""
    reason: str
    """Why."""


@dataclass(frozen=True)
class LightChoice:
    """The resolution of light that is computed once."""

    factor: LightFactor | None
    """Voxels along the edge of a texel; None if the light is left out."""
    reason: str
    """Why."""
    remark: str = ""
    """Note for the user; empty if the light is kept and within the tolerance."""
    cut: CutChoice | None = None
    """Light of the cut volume; None if the scene does not ask for it."""


@dataclass(frozen=True)
class StepChoice:
    """The step of one level."""

    level: int
    """Number of the level."""
    step_mm: float
    """Distance of the samples along a ray."""
    reason: str
    """Why."""
    in_pieces: bool = False
    """Whether the package holds the level in sub-volumes only."""
    is_beyond: bool = False
    """Whether no step that was tried is within the tolerance, which codes and levels share."""


@dataclass(frozen=True)
class Tables:
    """The classification of the package, one of the three for each transfer function, and the reasons."""

    lookups: tuple[LookupPlan, ...] = ()
    """Lookup tables."""
    preintegrated: tuple[PreintegratedPlan, ...] = ()
    """Pre-integrated tables."""
    palettes: tuple[PalettePlan, ...] = ()
    """Palettes."""
    points: tuple[str, ...] = ()
    """Transfer functions whose control points programs hold."""
    voxels: tuple[str, float] | None = None
    """Where voxels are classified: their transfer function, and the length of its path in millimetres."""
    reasons: tuple[str, ...] = ()
    """Error of each."""

    def classified(self, volumes: tuple[VolumePlan, ...]) -> tuple[VolumePlan, ...]:
        """Return the volumes with voxels classified, if they are to be."""
        if self.voxels is None:
            return volumes
        transfer, reference_mm = self.voxels
        update = {"transfer": transfer, "reference_mm": reference_mm}
        return tuple(volume.model_copy(update=update) for volume in volumes)
