"""stress.json: how the chain from scan to picture bears cases in which arithmetic is hard; and its page."""

from typing import Annotated, Literal

from pydantic import Field

from volprep.validation.results.measurements import Driver, ErrorNumbers, Target
from volprep.validation.results.seen import NonNegative
from volprep.validation.verdicts.verdict import passes_errors
from volprep_formats.grid import Count
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.program import ClassificationName, TechniqueName
from volprep_formats.record import Record

Precision = Literal["highp", "mediump", "mediump-coordinates"]
"""Numbers of a shader: as it ships, or rounded as a phone may."""


_WORSE = 1.05
"""A finer step counts as worse if its error is larger by a twentieth, and by half a step of 8 bits."""
_ROUNDING = 0.5 / 255


class StressPoint(Record):
    """One distance of the samples, in the oblique view."""

    step_ratio: Annotated[float, Field(gt=0.0)]
    """Distance over the nominal one."""
    rmse: NonNegative
    """Root mean square error over seen pixels against truth."""
    draw_ms: NonNegative
    """Median time of a draw, in milliseconds."""


class StressDrawing(Record):
    """One case, drawn in one way."""

    classification: ClassificationName
    """Unit that is classified: each sample, or each segment between two samples."""
    technique: TechniqueName = "ray-casting"
    """Rendering technique of the program."""
    level: Annotated[int, Field(ge=0)] = 0
    """Level that is drawn. A coarse one is compared with an integral of its own data."""
    precision: Precision = "highp"
    """Numbers of the shader. highp: as it ships. mediump: each operation is rounded to a 16-bit float.
    mediump-coordinates: only the coordinates of textures are."""
    total: ErrorNumbers
    """The worst view against truth: the one with the largest share of the limit, or of the usual tolerance."""
    precise: ErrorNumbers | None = None
    """The same in a float target, if a program blends layers, because 8 bits round each layer: this one is judged."""
    limit: Tolerance | None
    """Largest error that it may have; null if it is only reported."""
    common_planes: bool = False
    """Whether all rays have their samples in common planes, and the feature is so sharp that it depends on them where
    its silhouette is. A plane at the silhouette, as with an odd number of layers around a centred ball, shows it
    exactly; half a layer away it is too small by a strip whose width grows with the square of the step. The RMSE of
    the worse case grows with the step: 0.0509, 0.0288, 0.0185, 0.0102 for 3, 1.6, 1.1 and 0.8 voxels (an opaque ball,
    view slices, 10 directions), and 0.0049 for 2 voxels and an odd number. So the limit falls with the step, and no
    step is compared with a longer one."""
    laws: tuple[str, ...]
    """Laws of light that a picture breaks, in words."""
    points: tuple[StressPoint, ...]
    """Error against run time, coarsest step first, in a target of 8 bits; none of a coarse level."""
    precise_points: tuple[StressPoint, ...] = ()
    """The same in a target of floats, where a program blends layers: these are judged."""
    of_rays: tuple[StressPoint, ...] = ()
    """Where `common_planes` holds: the points of ray casting with the same classification. A lookup table whose entries
    are wider than the feature leaves an error that planes add to, and that no step makes smaller. On the wall with
    tables of bytes ray casting has 0.033, 0.031, 0.031, 0.031 at 2, 1, 1/2 and 1/4 of the step, view slices 0.040,
    0.031, 0.031, 0.031; with pre-integrated tables slices have 0.0006, and nothing is added. So a step may have the
    error of ray casting."""
    picture: str | None
    """File of the oblique view over black, side by side: truth, rendering, difference; null without a picture."""

    @property
    def passed(self) -> bool:
        """Whether every step is within the limit, none is worse than a longer one, and no law is broken."""
        if self.limit is None:
            return not self.laws
        within = passes_errors(self.precise or self.total, self.limit)
        return within and not (self.laws or self.worse_steps or self.steps_beyond)

    @property
    def judged_points(self) -> tuple[StressPoint, ...]:
        """The points that are judged."""
        return self.precise_points or self.points

    @property
    def worse_steps(self) -> tuple[float, ...]:
        """Steps, over the nominal one, that are worse than a longer one by more than rounding.

        None where the places of planes decide.
        """
        if self.common_planes:
            return ()
        worse: list[float] = []
        least = float("inf")
        for point in self.judged_points:
            if point.rmse > _WORSE * least + _ROUNDING:
                worse.append(point.step_ratio)
            least = min(least, point.rmse)
        return tuple(worse)

    @property
    def steps_beyond(self) -> tuple[float, ...]:
        """Steps, no longer than the nominal one, whose error is beyond the limit."""
        if self.limit is None:
            return ()
        steps = (point for point in self.judged_points if point.step_ratio <= 1.0)
        return tuple(step.step_ratio for step in steps if step.rmse > self._limit_of(step.step_ratio, self.limit.rmse))

    def _limit_of(self, step_ratio: float, nominal: float) -> float:
        """Return the largest error of a step, if that of the nominal step is `nominal`."""
        if not self.common_planes:
            return nominal
        of_rays = max((ray.rmse for ray in self.of_rays if ray.step_ratio == step_ratio), default=0.0)
        return max(nominal * step_ratio, min(nominal, _WORSE * of_rays + _ROUNDING))

    @property
    def problems(self) -> tuple[str, ...]:
        """Faults of its steps and laws, in words."""
        steps = [f"step {ratio:g}× is worse than a longer one" for ratio in self.worse_steps]
        steps += [f"step {ratio:g}× is beyond the limit" for ratio in self.steps_beyond if ratio != 1.0]
        return (*self.laws, *steps)

    @property
    def is_first(self) -> bool:
        """Whether it is the default way of scenes: the other ways vary it in one thing."""
        return (self.technique, self.level, self.precision) == ("ray-casting", 0, "highp")

    @property
    def name(self) -> str:
        """Description of the renderer."""
        varied = (
            self.technique if self.technique != "ray-casting" else None,
            f"level {self.level}" if self.level else None,
            self.precision if self.precision != "highp" else None,
        )
        return ", ".join((self.classification, *(value for value in varied if value)))


class StressResult(Record):
    """One case."""

    case: str
    """Its name."""
    hard: str
    """Description of the difficulty."""
    refused: str | None
    """Error code of the refusal; null if it was drawn."""
    must_refuse: str | None
    """Error code of the expected refusal; null if it must be drawn."""
    drawings: tuple[StressDrawing, ...]
    """Ways in which it was drawn; empty if it was refused."""

    @property
    def passed(self) -> bool:
        """Whether it was refused or drawn as it must be."""
        return self.refused == self.must_refuse and all(drawing.passed for drawing in self.drawings)


class StressReport(Record):
    """All cases on one class of devices."""

    format: Literal["volprep-stress"] = "volprep-stress"
    """Marks the file."""
    version: Literal["1.0"] = "1.0"
    """Version of the format: major.minor."""
    generator: str
    """Program and version that drew."""
    profile: str
    """Class of devices."""
    picture_size: Count
    """Width and height of the pictures, in pixels."""
    oracle_tolerance: NonNegative
    """Bound that the oracle was asked to keep for each channel."""
    laws_target: Target
    """Target of the pictures that laws were checked in; errors are measured in 8 bits."""
    difference_gain: Annotated[float, Field(gt=0.0)]
    """Factor on the differences in the pictures."""
    passed: bool
    """Whether every case was tried, and is refused or drawn as it must be."""
    results: tuple[StressResult, ...]
    """Cases."""
    not_judged: tuple[str, ...] = ()
    """Sentences that list drawings without a limit, and things that no case draws."""
    left_out: tuple[str, ...] = ()
    """Cases that were not tried, because the time was over."""
    driver: Driver | None
    """The OpenGL ES that drew; null if every case was refused."""
