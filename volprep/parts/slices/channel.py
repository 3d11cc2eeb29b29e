"""A channel that becomes stacks of slices: its decisions before and after those that all channels share."""

from dataclasses import dataclass

from volprep.parts.channel_scan import ChannelScan
from volprep.parts.programs.early_end import EarlyEnd
from volprep.parts.slices.decision import SlicesChoice, describe_slices, plan_of_slices
from volprep.parts.values.items import describe_codes
from volprep.plan.decisions import StepChoice, ValueChoice
from volprep.plan.functions import describe_functions
from volprep.plan.records import ChannelPlan, Shared
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile


def channel_of_slices(scan: ChannelScan, values: ValueChoice, profile: DeviceProfile, grid: Grid) -> "SlicesChannel":
    """Decide the stacks of a channel. Raises as `plan_of_slices`."""
    return SlicesChannel(scan, values, plan_of_slices(scan.name, scan.scene, profile, grid, scan.functions))


@dataclass(frozen=True)
class SlicesChannel:
    """A channel that becomes stacks of slices."""

    scan: ChannelScan
    values: ValueChoice
    choice: SlicesChoice

    @property
    def steps(self) -> tuple[StepChoice, ...]:
        """Distance of the slices."""
        distance_mm = min(stack.distance_mm for stack in self.choice.slices.stacks)
        return (StepChoice(self.choice.level.index, distance_mm, "slices are as far apart as voxels are"),)

    @property
    def early_end(self) -> EarlyEnd:
        """No early end: there are no rays."""
        return EarlyEnd(0.0, 0.0, 0.0)

    def finished(self, shared: Shared) -> "FinishedSlices":
        """Return the plan of the channel."""
        plan = ChannelPlan(
            channel=self.scan.name,
            shared=shared,
            transfer_functions=self.scan.functions,
            quantize=self.values.quantize,
            levels=(self.choice.level,),
            volumes=(),
            lookups=(),
            parts=(self.choice.slices,),
            programs=(),
        )
        return FinishedSlices(plan, self)


@dataclass(frozen=True)
class FinishedSlices:
    """The plan of stacks of slices."""

    plan: ChannelPlan
    begun: SlicesChannel

    def items(self, plan: ChannelPlan) -> tuple[PlanItem, ...]:
        """List the decisions; `plan` is the final plan of the channel."""
        scan, begun = self.begun.scan, self.begun
        codes = describe_codes(plan, scan.scene, begun.values)
        functions = describe_functions(scan.scene, scan.functions)
        return (*codes, *describe_slices(plan, begun.choice), *functions)
