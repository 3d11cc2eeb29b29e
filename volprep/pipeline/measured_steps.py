"""Replace the estimated steps of a plan by the steps that were measured on the levels of its draft."""

from collections.abc import Mapping, Sequence

from volprep.parts.level_choices import choices_of
from volprep.plan.level_choice import MeasuredStep
from volprep.plan.records import ChannelPlan, Plan
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.program import LevelStep, RaySampling
from volprep_formats.package.storage.draft import Draft

_Key = tuple[str | None, int]
"""Channel and level."""


def with_measured_steps(drafts: Sequence[Draft], plan: Plan) -> Plan:
    """Return the plan with the steps that were measured when levels were made.

    Of several channels, and of the frames of a series, each with a draft, the finest step counts. Without such levels
    the plan is returned as it is.
    """
    if not plan.shared.measure_steps:
        return plan
    measured: dict[_Key, MeasuredStep] = {}
    for channel in plan.channels:
        for choice in (choice for draft in drafts for choice in choices_of(draft, channel)):
            key = channel.channel, choice.level
            if choice.step is not None and (key not in measured or choice.step.step_mm < measured[key].step_mm):
                measured[key] = choice.step
    if not measured:
        return plan
    shared = plan.shared.model_copy(update={"rays": _rays(plan, measured)})
    channels = tuple(
        channel.model_copy(update={"shared": channel.shared.model_copy(update={"rays": shared.rays})})
        for channel in plan.channels
    )
    items = tuple(_described(item, measured, shared.rays) for item in plan.items)
    return plan.model_copy(update={"shared": shared, "channels": channels, "items": items})


def _rays(plan: Plan, measured: Mapping[_Key, MeasuredStep]) -> RaySampling:
    planned = plan.shared.rays
    indices = sorted({level.index for channel in plan.channels for level in channel.levels})
    by_level = {index: _finest(plan.channels, index, measured, planned) for index in indices}
    kept = {each.level: each.step_mm for each in planned.level_steps if each.level not in by_level}
    by_level |= kept
    first = by_level[indices[0]]
    others = (LevelStep(level=index, step_mm=step) for index, step in sorted(by_level.items()) if step != first)
    return planned.model_copy(update={"step_mm": first, "level_steps": tuple(others)})


def _finest(
    channels: tuple[ChannelPlan, ...], index: int, measured: Mapping[_Key, MeasuredStep], planned: RaySampling
) -> float:
    """Return the finest step of a level that was measured in any channel; the planned one if none was."""
    found = [measured[channel.channel, index].step_mm for channel in channels if (channel.channel, index) in measured]
    return min(found, default=planned.step_of(index))


def _described(item: PlanItem, measured: Mapping[_Key, MeasuredStep], rays: RaySampling) -> PlanItem:
    """Return an item about a step with the measurement."""
    found = None if item.kind != "step" or item.level is None else measured.get((item.channel, item.level))
    if found is None or item.level is None:
        return item
    step_mm = rays.step_of(item.level)
    shared = "" if step_mm == found.step_mm else f"; here {step_mm:.3g} mm, for another channel"
    return item.model_copy(update={"reason": f"{found.step_mm:.3g} mm, {found.reason}{shared}"})
