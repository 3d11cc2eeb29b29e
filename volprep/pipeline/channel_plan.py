"""The plan of one channel: first what it decides for itself, then what follows from what all channels share."""

import math
from dataclasses import dataclass
from typing import Protocol

from volprep.compositing import COMPOSITINGS
from volprep.parts.classification.decision import StepLengths, choose_tables, require_isovalues
from volprep.parts.compression.decision import CompressionChoice, CompressionGrounds, choose_compression
from volprep.parts.compression.whole import WholeSource
from volprep.parts.editing.decision import describe_editing, plan_editing
from volprep.parts.normals.decision import normal_items, plan_normals, wanted_normals
from volprep.parts.programs.decision import ray_casters
from volprep.parts.programs.early_end import EarlyEnd, behind_cutoff, cutoff_of, light_cost
from volprep.parts.programs.step import StepChoice, choose_steps, describe_steps
from volprep.parts.proxy.decision import describe_proxy, plan_proxy
from volprep.parts.skip.decision import Found, describe_skip, plan_skip
from volprep.parts.slices.decision import SlicesChoice, describe_slices, plan_of_slices
from volprep.parts.subvolumes.decision import plan_subvolumes
from volprep.parts.values.decision import ValueChoice, choose_values
from volprep.parts.values.items import Grounds, describe_codes
from volprep.pipeline.items import describe
from volprep.plan.functions import describe_functions
from volprep.plan.products import SubvolumesPlan
from volprep.plan.records import ChannelPlan, CropPlan, Shared
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep.techniques import TECHNIQUES
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo


@dataclass(frozen=True)
class ChannelScan:
    """One channel of a scan, and what the scene wants of it."""

    name: str
    """Name of the channel."""
    scene: Scene
    """The scene with the source and the transfer functions of this channel alone."""
    info: SourceInfo
    """What the source is."""
    measured: Measured
    """What was measured of it."""
    functions: tuple[TransferFunction, ...]
    """Its transfer functions over physical values."""
    whole: WholeSource | None = None
    """The source itself, where it has been imported; compression is decided on it."""


class Begun(Protocol):
    """A channel of which all is decided that does not depend on the others."""

    @property
    def steps(self) -> tuple[StepChoice, ...]:
        """Distance of the samples that suits each of its levels, finest first."""

    @property
    def early_end(self) -> EarlyEnd:
        """How opaque its rays can be, and what lies behind."""

    def finished(self, shared: Shared) -> tuple[ChannelPlan, tuple[PlanItem, ...]]:
        """Return its plan, and what was decided about it."""


def begin(scan: ChannelScan, profile: DeviceProfile, crop: CropPlan, grid: Grid) -> Begun:
    """Decide codes and levels of a channel.

    Raises VP3020 and VP3021 for bits and windows that cannot be, VP3022 when the profile holds no level, VP3024 and
    VP3025 for what cannot be done with labels, VP3050 for normals that it cannot hold, VP3060 for slices with what
    needs shaders, VP3070 for a compressed format that the profile does not have, VP3071 for mipmaps where it has no 3D
    textures, VP3116 and VP3117 for an isovalue of nothing that is seen.
    """
    require_isovalues(scan.scene, scan.functions, scan.measured)
    values = choose_values(scan.scene, profile, scan.info, scan.measured, scan.functions)
    if not profile.has_shaders:
        return _Slices(scan, values, plan_of_slices(scan.name, scan.scene, profile, grid, scan.functions))
    grounds = CompressionGrounds(
        scan.name, scan.scene, profile, scan.info, scan.measured, scan.functions, values, crop, grid
    )
    compression = choose_compression(grounds, scan.whole)
    layout = compression.layout
    bits = values.quantize.bits
    subvolumes = plan_subvolumes(scan.scene, profile, grid, bits, layout.volumes, scan.functions)
    finest = () if subvolumes is None or not subvolumes.programs else layout.candidates[:1]
    steps = choose_steps(
        scan.scene,
        scan.functions,
        scan.info,
        scan.measured,
        grid=grid,
        levels=layout.levels,
        in_pieces=[level for level in finest if level.index < layout.levels[0].index],
    )
    return _Volume(scan, profile, grid, values, compression, subvolumes, steps)


@dataclass(frozen=True)
class _Slices:
    """A channel that becomes stacks of slices."""

    scan: ChannelScan
    values: ValueChoice
    choice: SlicesChoice

    @property
    def steps(self) -> tuple[StepChoice, ...]:
        distance_mm = min(stack.distance_mm for stack in self.choice.slices.stacks)
        return (StepChoice(self.choice.level.index, distance_mm, "slices are as far apart as voxels are"),)

    @property
    def early_end(self) -> EarlyEnd:
        return EarlyEnd(0.0, 0.0, 0.0)

    def finished(self, shared: Shared) -> tuple[ChannelPlan, tuple[PlanItem, ...]]:
        scene = self.scan.scene
        plan = ChannelPlan(
            channel=self.scan.name,
            shared=shared,
            transfer_functions=self.scan.functions,
            quantize=self.values.quantize,
            levels=(self.choice.level,),
            volumes=(),
            lookups=(),
            slices=self.choice.slices,
            programs=(),
        )
        codes = describe_codes(plan, scene, self.values)
        functions = describe_functions(scene, self.scan.functions)
        return plan, (*codes, *describe_slices(plan, self.choice), *functions)


@dataclass(frozen=True)
class _Volume:
    """A channel through which rays are cast."""

    scan: ChannelScan
    profile: DeviceProfile
    grid: Grid
    values: ValueChoice
    compression: CompressionChoice
    subvolumes: SubvolumesPlan | None
    steps: tuple[StepChoice, ...]

    @property
    def early_end(self) -> EarlyEnd:
        scan, quantize = self.scan, self.values.quantize
        # Rounding to a code, and to an entry of the lookup table, may reach a little beyond the values of the source.
        first, last = quantize.window
        slack = (last - first) * (1 / 255 + 1 / (self.values.entries - 1))
        low, high = scan.measured.statistics.minimum - slack, scan.measured.statistics.maximum + slack
        # The largest extinction of any value of the source, along the whole diagonal.
        largest_per_mm = max(Table.exact(each).largest_extinction(low, high) for each in scan.functions)
        opacity = 1.0 - math.exp(-largest_per_mm * math.hypot(*self.grid.extent_mm_zyx))
        spacing_mm_zyx, cutoff = scan.info.grid.spacing_mm_zyx, cutoff_of(scan.scene)
        rays_zyx = scan.measured.rays_zyx
        light = light_cost(scan.scene)
        return EarlyEnd(
            opacity, *behind_cutoff(scan.functions, rays_zyx, spacing_mm_zyx, quantize.filter, cutoff, light)
        )

    def finished(self, shared: Shared) -> tuple[ChannelPlan, tuple[PlanItem, ...]]:
        scan, scene, functions, values = self.scan, self.scan.scene, self.scan.functions, self.values
        layout = self.compression.layout
        levels, volumes = layout.levels, layout.volumes
        normals = plan_normals(wanted_normals(scene), layout.profile, levels, layout.beside)
        step = StepLengths(segment_mm=shared.render.step_mm, voxel_mm_zyx=scan.info.grid.spacing_mm_zyx)
        tables = choose_tables(scene, self.profile, functions, values, scan.measured, step)
        found = Found(
            layout.profile,
            shared.crop,
            self.grid,
            values.quantize,
            values.entries,
            levels,
            volumes,
            scan.measured,
            normals,
            COMPOSITINGS[shared.compositing],
            scene.editable,
            TECHNIQUES[scene.render.technique].loops,
        )
        skip = plan_skip(scene.skip, functions, found)
        programs = tuple(program for each in functions for program in ray_casters(each.name, volumes, scene))
        proxy = plan_proxy(scene.proxy, functions, programs, found) if scene.proxy else None
        plan = ChannelPlan(
            channel=scan.name,
            shared=shared,
            transfer_functions=functions,
            quantize=values.quantize,
            levels=levels,
            volumes=tables.classified(volumes),
            subvolumes=self.subvolumes,
            lookups=tables.lookups,
            preintegrated=tables.preintegrated,
            palettes=tables.palettes,
            skip=skip,
            editing=plan_editing(scene, self.grid, levels),
            normals=normals,
            proxy=proxy,
            programs=programs,
            forms=self.compression.forms,
        )
        grounds = Grounds(scene, scan.info, values, layout.candidates, layout.fits, tables)
        return plan, (
            *describe(plan, grounds),
            *describe_steps(shared.render, self.steps),
            *self.compression.items,
            *describe_skip(skip, functions, scene.skip, found),
            *(describe_proxy(proxy, functions, scene.proxy, found) if scene.proxy else ()),
            *describe_editing(plan.editing),
            *normal_items(normals, scene, levels),
        )
