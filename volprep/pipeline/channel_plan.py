"""The plan of one channel: first its own decisions, then the ones that depend on the settings of all channels."""

import math
from dataclasses import dataclass, replace
from typing import Protocol

from volprep.parts.case import Case
from volprep.parts.channel_scan import ChannelScan
from volprep.parts.classification.decision import StepLengths, choose_tables
from volprep.parts.compression.decision import choose_form
from volprep.parts.layout.decision import lay_out
from volprep.parts.light.trial import try_light
from volprep.parts.part import Decided, LaidOut
from volprep.parts.programs.decision import ray_casters
from volprep.parts.programs.early_end import EarlyEnd, behind_cutoff, cutoff_of, light_cost
from volprep.parts.programs.step import choose_steps, layers_of
from volprep.parts.registry import PARTS
from volprep.parts.slices.channel import channel_of_slices
from volprep.parts.values.decision import choose_values
from volprep.plan.decisions import CompressionChoice, LightChoice, StepChoice, ValueChoice
from volprep.plan.products import SubvolumesPlan
from volprep.plan.records import ChannelPlan, CropPlan, LevelPlan, Shared
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile


def valued(scan: ChannelScan, profile: DeviceProfile) -> ValueChoice:
    """Choose the codes of a channel. Raises VP3020, VP3021, VP3025 and VP3026 for codes that cannot be."""
    return choose_values(scan.scene, profile, scan.info, scan.measured, scan.functions)


class Begun(Protocol):
    """A channel with every decision made that does not depend on the other channels."""

    @property
    def steps(self) -> tuple[StepChoice, ...]:
        """Distance of the samples that suits each of its levels, finest first."""

    @property
    def early_end(self) -> EarlyEnd:
        """Largest opacity of its rays, and the samples behind the cutoff."""

    def finished(self, shared: Shared) -> "Finished":
        """Return its plan with what the channels share."""


class Finished(Protocol):
    """A channel with every decision made, apart from texels that it may share with others."""

    @property
    def plan(self) -> ChannelPlan:
        """Its plan."""

    def items(self, plan: ChannelPlan) -> tuple[PlanItem, ...]:
        """List the decisions; `plan` is the final plan of the channel."""


def begin(scan: ChannelScan, values: ValueChoice, profile: DeviceProfile, crop: CropPlan, grid: Grid) -> Begun:
    """Decide levels and parts of a channel, whose codes `values` says.

    Raises VP3022 if the profile holds no level, VP3024 for what cannot be done with labels, VP3050 for normals that it
    cannot hold, VP3060 for slices with what needs shaders, VP3070 for a compressed format that the profile does not
    have, VP3071 for mipmaps where it has no 3D textures.
    """
    light = _tried_light(scan, crop, grid)
    if light is not None and light.factor is None:
        lighting = scan.scene.lighting.model_copy(update={"baked": "none"})
        scan = replace(scan, scene=scan.scene.model_copy(update={"lighting": lighting}))
    if not profile.has_shaders:
        return channel_of_slices(scan, values, profile, grid)
    case = Case(
        channel=scan.name,
        scene=scan.scene,
        profile=profile,
        crop=crop,
        grid=grid,
        info=scan.info,
        measured=scan.measured,
        functions=scan.functions,
        values=values,
        segments=scan.segments,
        light=light,
    )
    neighbours = [part.beside for part in PARTS if part.beside is not None]
    compression = choose_form(case, neighbours, scan.whole)
    layout = lay_out(case, neighbours, compression.form)
    programs = tuple(
        program for each in case.drawn_alone for program in ray_casters(each.name, layout.volumes, scan.scene)
    )
    channel = LaidOut(case, layout, programs)
    for part in PARTS:
        planned = part.plan(channel)
        if planned is not None:
            channel = replace(channel, parts=(*channel.parts, planned))
    steps = choose_steps(
        scan.scene,
        scan.functions,
        scan.info,
        scan.measured,
        grid=grid,
        levels=layout.levels,
        in_pieces=_in_pieces(channel),
        layers=layers_of(scan.scene.render.technique, profile),
        finest=scan.finest,
        finer=scan.finer,
    )
    return _Volume(channel, compression, steps)


def _tried_light(scan: ChannelScan, crop: CropPlan, grid: Grid) -> LightChoice | None:
    """Measure light that is computed once; None without it, or without the whole source."""
    if scan.whole is None or scan.scene.source.labels:
        return None
    whole = scan.whole
    return try_light(scan.scene, whole.volume, whole.info, crop, grid, scan.functions, whole.progress)


def _in_pieces(channel: LaidOut) -> list[LevelPlan]:
    """Return level 0 if the package draws it in pieces only."""
    subvolumes, layout = channel.part(SubvolumesPlan), channel.layout
    finest = () if subvolumes is None or not subvolumes.programs else layout.candidates[:1]
    return [level for level in finest if level.index < layout.levels[0].index]


@dataclass(frozen=True)
class _Volume:
    """A channel through which rays are cast."""

    channel: LaidOut
    compression: CompressionChoice
    steps: tuple[StepChoice, ...]

    @property
    def early_end(self) -> EarlyEnd:
        case = self.channel.case
        quantize = case.values.quantize
        # Rounding to a code, and to an entry of the lookup table, may reach a little beyond the values of the source.
        first, last = quantize.window
        slack = (last - first) * (1 / 255 + 1 / (case.values.entries - 1))
        low, high = case.measured.statistics.minimum - slack, case.measured.statistics.maximum + slack
        # The largest extinction of any value of the source, along the whole diagonal.
        largest_per_mm = max(Table.exact(each).largest_extinction(low, high) for each in case.functions)
        opacity = 1.0 - math.exp(-largest_per_mm * math.hypot(*case.grid.extent_mm_zyx))
        spacing_mm_zyx, cutoff = case.info.grid.spacing_mm_zyx, cutoff_of(case.scene)
        rays_zyx = case.measured.rays_zyx
        light = light_cost(case.scene)
        return EarlyEnd(
            opacity, *behind_cutoff(case.functions, rays_zyx, spacing_mm_zyx, quantize.filter, cutoff, light)
        )

    def finished(self, shared: Shared) -> "_FinishedVolume":
        channel, case, layout = self.channel, self.channel.case, self.channel.layout
        step = StepLengths(segment_mm=shared.rays.step_mm, voxel_mm_zyx=case.info.grid.spacing_mm_zyx)
        tables = choose_tables(case.scene, case.profile, case.functions, case.values, case.measured, step)
        plan = ChannelPlan(
            channel=case.channel,
            shared=shared,
            transfer_functions=case.functions,
            quantize=case.values.quantize,
            levels=layout.levels,
            volumes=tables.classified(layout.volumes),
            lookups=tables.lookups,
            preintegrated=tables.preintegrated,
            palettes=tables.palettes,
            parts=channel.parts,
            programs=channel.programs,
            forms=self.compression.forms,
        )
        return _FinishedVolume(plan, Decided(channel, self.compression, self.steps, tables))


@dataclass(frozen=True)
class _FinishedVolume:
    """The plan of a volume."""

    plan: ChannelPlan
    decided: Decided

    def items(self, plan: ChannelPlan) -> tuple[PlanItem, ...]:
        return tuple(item for part in PARTS for item in part.items(plan, self.decided))
