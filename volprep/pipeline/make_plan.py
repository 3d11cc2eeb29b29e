"""Make the plan of a scene: one decision after the other."""

import math
from dataclasses import dataclass

from volprep.parts.bricks.decision import require_bricks
from volprep.parts.classification.decision import StepLengths, choose_tables, require_classification
from volprep.parts.compression.decision import CompressionGrounds, choose_compression
from volprep.parts.compression.whole import WholeSource
from volprep.parts.editing.decision import describe_editing, for_edits, plan_editing
from volprep.parts.normals.decision import normal_items, plan_normals, wanted_normals
from volprep.parts.programs.decision import ray_casters, technique_of
from volprep.parts.proxy.decision import describe_proxy, plan_proxy
from volprep.parts.skip.decision import Found, describe_skip, plan_skip
from volprep.parts.slices.decision import plan_of_slices, refuse_slices
from volprep.parts.subvolumes.decision import plan_subvolumes
from volprep.parts.values.decision import choose_values
from volprep.parts.values.items import Grounds
from volprep.parts.values.labels import require_distinct_labels, step_voxels_of
from volprep.pipeline.items import describe
from volprep.plan.crop import choose_crop
from volprep.plan.functions import resolved_functions
from volprep.plan.products import NormalsPlan, ProxyPlan, SkipPlan, SubvolumesPlan
from volprep.plan.records import CropPlan, LevelPlan, Plan, VolumePlan
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep.transfer.table import Table
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import RenderSettings, Statistics
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo


@dataclass(frozen=True)
class Common:
    """What is decided for several channels together."""

    crop: CropPlan
    """The part of the source that becomes level 0."""
    step_mm: float | None = None
    """Nominal distance of the samples, if it is not what the channel would have."""
    cutoff: bool | None = None
    """Whether rays may stop early, if it is not what the channel would have."""


def make_plan(  # noqa: PLR0917 - the scene, the class of devices, what the source is, and what is given beside
    scene: Scene,
    profile: DeviceProfile,
    info: SourceInfo,
    measured: Measured,
    common: Common | None = None,
    whole: WholeSource | None = None,
) -> Plan:
    """Decide everything that the stages need to know; for one of several channels, with what they have in common.

    Without the whole source, compression is decided by a sample of it, and the plan says so.

    Raises VP3020 and VP3021 for bits and windows that cannot be, VP3022 when the profile holds no level, VP3024 and
    VP3025 for what cannot be done with labels, VP3031 and VP3032 for bricks that cannot be, VP3040 for a classification
    that the profile cannot do, VP3043 for one that mixes labels, VP3050 for normals that it cannot hold, VP3060 for
    slices with what needs shaders, or without need, VP3070 for a compressed format that the profile does not have,
    VP3071 for mipmaps where it has no 3D textures, VP3080 for what cannot be had where functions may be edited.
    """
    scene = for_edits(scene, profile)
    if not profile.has_shaders:
        return plan_of_slices(scene, profile, info, measured)
    refuse_slices(scene, profile)
    require_classification(scene, profile)
    require_distinct_labels(scene)
    require_bricks(scene, profile)
    functions = resolved_functions(scene, info, measured)
    values = choose_values(scene, profile, info, measured, functions)
    crop = common.crop if common else choose_crop(scene.crop, functions, measured.ranges_zyx)
    grid = info.grid.part(crop.start_zyx, crop.stop_zyx)
    compressing = CompressionGrounds(scene, profile, info, measured, functions, values, crop, grid)
    compression = choose_compression(compressing, whole)
    layout = compression.layout
    levels, volumes = layout.levels, layout.volumes
    normals = plan_normals(wanted_normals(scene), layout.profile, levels, layout.beside)
    subvolumes = plan_subvolumes(scene, profile, grid, values.quantize.bits, volumes, functions)
    voxel_mm = _finest_spacing_mm(grid, levels[0])
    step_mm = step_voxels_of(scene, functions, voxel_mm) * voxel_mm
    step_mm = common.step_mm or step_mm if common else step_mm
    step = StepLengths(segment_mm=step_mm, voxel_mm_zyx=info.grid.spacing_mm_zyx)
    tables = choose_tables(scene, profile, functions, values, measured, step)
    found = Found(
        layout.profile, crop, grid, values.quantize, values.entries, levels, volumes, measured, normals, scene.editable
    )
    skip = plan_skip(scene.skip, functions, found)
    programs = tuple(program for each in functions for program in ray_casters(each.name, volumes, scene.render))
    proxy = plan_proxy(scene.proxy, functions, programs, found) if scene.proxy else None
    # Rounding to a code, and to an entry of the lookup table, may reach a little beyond the values of the source.
    slack = (values.quantize.window[1] - values.quantize.window[0]) * (1 / 255 + 1 / (values.entries - 1))
    opacity = _largest_opacity(functions, measured.statistics, slack, grid)
    stops = scene.editable or opacity > scene.render.opacity_cutoff
    stops = common.cutoff if common and common.cutoff is not None else stops
    plan = Plan(
        profile=profile,
        crop=crop,
        grid=grid,
        transfer_functions=functions,
        quantize=values.quantize,
        levels=levels,
        volumes=tables.classified(volumes),
        subvolumes=subvolumes,
        lookups=tables.lookups,
        preintegrated=tables.preintegrated,
        palettes=tables.palettes,
        skip=skip,
        editing=plan_editing(scene, grid, levels),
        normals=normals,
        proxy=proxy,
        programs=programs,
        render=RenderSettings(
            step_mm=step_mm,
            opacity_cutoff=scene.render.opacity_cutoff if stops else None,
            projection=scene.render.projection,
            tolerance=scene.tolerance,
        ),
        forms=compression.forms,
        stages=_stages(levels, volumes, subvolumes, skip, proxy, normals),
        items=(),
    )
    grounds = Grounds(scene, info, values, layout.candidates, layout.fits, opacity, tables)
    skipping = describe_skip(skip, functions, scene.skip, found)
    meshes = describe_proxy(proxy, functions, scene.proxy, found) if scene.proxy else ()
    return plan.model_copy(
        update={
            "items": (
                *describe(plan, grounds),
                *compression.items,
                *skipping,
                *meshes,
                *describe_editing(plan.editing),
                *normal_items(normals, scene, levels),
            )
        }
    )


def _stages(  # noqa: PLR0917 - what needs a stage
    levels: tuple[LevelPlan, ...],
    volumes: tuple[VolumePlan, ...],
    subvolumes: SubvolumesPlan | None,
    skip: SkipPlan,
    proxy: ProxyPlan | None,
    normals: NormalsPlan | None,
) -> tuple[str, ...]:
    pyramid = ("pyramid",) if any(level.index for level in levels) else ()
    pieces = ("grid",) if subvolumes is not None else ()
    layout = {"raycast_mosaic": "mosaic", "raycast_bricks": "bricks"}.get(technique_of(volumes[0]), "texture")
    skipping = ("skip",) if skip.tables or skip.ranges else ()
    meshes = ("proxy",) if proxy is not None and proxy.meshes else ()
    vectors = ("normals",) if normals is not None else ()
    return (
        "import",
        "quantize",
        *pyramid,
        "transfer",
        *vectors,
        layout,
        *skipping,
        *meshes,
        *pieces,
        "shaders",
        "seal",
    )


def _finest_spacing_mm(grid: Grid, finest: LevelPlan) -> float:
    return min(h * f for h, f in zip(grid.spacing_mm_zyx, finest.factors_zyx, strict=True))


def _largest_opacity(
    functions: tuple[TransferFunction, ...], statistics: Statistics, slack: float, grid: Grid
) -> float:
    """Bound the opacity of any ray: the largest extinction of any value of the source along the whole diagonal."""
    low, high = statistics.minimum - slack, statistics.maximum + slack
    extinction_per_mm = max(Table.exact(function).largest_extinction(low, high) for function in functions)
    return 1.0 - math.exp(-extinction_per_mm * math.hypot(*grid.extent_mm_zyx))
