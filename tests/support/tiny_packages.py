"""Small packages for tests, made by the real stages from codes that the test chooses."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Literal
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from volprep.parts.bricks import part as bricks_stage
from volprep.parts.bricks.decision import Bricks, as_bricks
from volprep.parts.classification import stage as transfer
from volprep.parts.mosaic import part as mosaic
from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic
from volprep.parts.normals import stage as normals_stage
from volprep.parts.normals.decision import plan_normals
from volprep.parts.programs import stage as shaders
from volprep.parts.proxy import part as proxy_stage
from volprep.parts.proxy.decision import proxy_program
from volprep.parts.skip import stage as skip_stage
from volprep.parts.skip.decision import skip_table_plan
from volprep.parts.texture import part as texture
from volprep.parts.texture.mipmaps import in_one_texture, mipmap_levels
from volprep.parts.work import coarser_levels, codes_name, finest_level
from volprep.plan.products import ProxyMeshPlan, ProxyPlan, SkipPlan
from volprep.plan.records import (
    ChannelPlan,
    CropPlan,
    LevelPlan,
    LookupPlan,
    PalettePlan,
    PreintegratedPlan,
    QuantizePlan,
    Shared,
    VolumePlan,
)
from volprep.plan.room import Beside, one_channel
from volprep.scene.profiles import load_profile
from volprep.scene.scene import BrickSettings, NormalSettings, ProxySettings
from volprep_formats.grid import Grid
from volprep_formats.package.channel import ChannelPart, Quantization, SourceRecord, Statistics
from volprep_formats.package.manifest import Contribution, Heading, RenderSettings, StageRecord
from volprep_formats.package.parts.skip.record import SkipKind
from volprep_formats.package.picture import Picture, PictureMedium
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ClassificationName, ProgramDesign, RaySampling, TechniqueName
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.progress import Silent
from volprep_formats.record import Record
from volprep_formats.source import SourceInfo

KEY = "0" * 64
CHANNEL = "scan"
ONE_CHANNEL = Packing()
FOUR_CHANNELS = Packing(slices_per_texel=4)
ES2 = load_profile("gles2-2048", Path())
ES3 = load_profile("gles3", Path())
NORM16 = load_profile("gles3-norm16", Path())
Point = tuple[float, tuple[float, float, float], float]


def function(*points: Point, name: str = "test", **more: float) -> TransferFunction:
    """Transfer function of points (value, linear colour, extinction per millimetre)."""
    every = tuple(TransferPoint(value=v, colour=c, extinction_per_mm=e) for v, c, e in points)
    return TransferFunction(name=name, points=every, **more)


def tiny_package(
    folder: Path,
    codes: NDArray[np.generic] | Sequence[NDArray[np.generic]],
    transfer_function: TransferFunction,
    profile: DeviceProfile = ES3,
    *,
    spacing_mm_zyx: tuple[float, float, float] = (1.0, 1.0, 1.0),
    packing: Packing = ONE_CHANNEL,
    room: Room | None = None,
    step_mm: float = 0.5,
    cutoff: float | None = None,
    entries: int = 256,
    window: tuple[float, float] = (0.0, 255.0),
    grid: Grid | None = None,
    classification: ClassificationName = "lookup",
    skip: tuple[SkipKind, int] | None = None,
    normals: NormalSettings | None = None,
    lighting: Literal["none", "headlight"] = "none",
    technique: TechniqueName = "ray-casting",
    proxy: ProxySettings | None = None,
    labels: bool = False,
    mipmaps: bool = False,
    bricks: BrickSettings | None = None,
    quantization: Quantization | None = None,
) -> Package:
    """Package of one level, or of several that halve every axis, whose codes are uint8 or uint16 [z, y, x].

    `window` are the physical values of the smallest and the largest code; `entries` is the size of whatever table.
    `skip` is a kind of skip table and the cells along an edge of a block. `lighting` needs `normals`. `labels` says
    that codes are labels, `mipmaps` that levels are those of one texture, `bricks` that they are bricks.
    `quantization` is what codes mean, if it is not what the window says.
    """
    levels = [codes] if isinstance(codes, np.ndarray) else list(codes)
    grid = grid or Grid.of(levels[0].shape, spacing_mm_zyx)
    rays = RaySampling(step_mm=step_mm, opacity_cutoff=cutoff)
    volumes = tuple(_volume(index, level, profile, packing, room) for index, level in enumerate(levels))
    plan = _plan(levels, grid, transfer_function, profile, volumes, entries, window, rays)
    plan = _classified(plan, classification)
    if labels:
        nearest = tuple(volume.model_copy(update={"filter": "nearest"}) for volume in plan.volumes)
        plan = plan.model_copy(update={"volumes": nearest})
    if mipmaps:
        chained = mipmap_levels(CHANNEL, grid, max(levels[-1].shape), profile, "box")
        volumes = in_one_texture(plan.volumes, chained, profile, Beside(1, 0))
        plan = plan.model_copy(update={"levels": tuple(chained), "volumes": tuple(volumes)})
    if bricks is not None:
        plan = _with_bricks(plan, bricks)
    if skip is not None:
        tables = tuple(skip_table_plan(transfer_function.name, level, *skip, profile) for level in plan.levels)
        plan = with_part(plan, SkipPlan(epsilon=0.0, shares=(0.0,), tables=tables, ranges=()))
    skipping = () if skip is None else (skip_stage.STAGE,)
    lit = tuple(program.model_copy(update={"lighting": lighting, "technique": technique}) for program in plan.programs)
    planned = plan_normals(normals, profile, plan.levels, Beside(1, 0))
    plan = with_part(plan.model_copy(update={"programs": lit}), planned)
    vectors = () if normals is None else (normals_stage.STAGE,)
    if proxy is not None:
        plan = with_part(plan, _proxy_plan(plan, proxy))
    meshes = () if proxy is None else (proxy_stage.STAGE,)
    source = SourceInfo(format="raw", grid=grid, stored_type=str(levels[0].dtype))
    part = ChannelPart(
        name=CHANNEL,
        source=SourceRecord(info=source, sha256=KEY),
        statistics=Statistics(minimum=0.0, maximum=1.0, non_finite=0),
        quantization=quantization or _quantization(plan.quantize),
        levels=(*finest_level(plan), *coarser_levels(plan, dict.fromkeys(range(1, len(levels)), "box"))),
    )
    pictures = tuple(
        Picture(name=name, media=(PictureMedium(channel=CHANNEL, transfer=name),)) for name in plan.transfers
    )
    heading = Heading(
        name="tiny", generator="test", profile=profile, grid=grid, render=RenderSettings(), pictures=pictures
    )
    # Of the 0.2 s that a package takes, nine tenths are its 34 calls of fsync; other tests kill and look.
    with patch("os.fsync"):
        draft = Draft.create(folder, heading)
        for index, level in enumerate(levels):
            draft.write(codes_name(index, CHANNEL), "work", np.ascontiguousarray(level).tobytes())
        draft.commit(StageRecord(name="quantize", key=KEY, made=(Contribution(channel=part),)))
        stages = {"mosaic": mosaic.STAGE, "texture3d": texture.STAGE, "bricks": bricks_stage.STAGE}
        layout = stages[plan.volumes[0].sampling]
        for stage in (transfer.STAGE, *vectors, layout, *skipping, *meshes, shaders.STAGE):
            # Proxy meshes are made for all channels of a package: of this one.
            work, planned = (
                (stage.channel, plan) if stage.channel else (stage.package, SimpleNamespace(channels=(plan,)))
            )
            made = work.run(draft, planned, Silent())
            draft.commit(StageRecord(name=stage.name, key=KEY, made=(made,)))
    return Package.open(folder, allow_draft=True)


def lossless(slope: float = 1.0, intercept: float = 0.0, bits: Literal[8, 16] = 8) -> Quantization:
    """Codes that give each value back."""
    return _quantization(QuantizePlan(bits=bits, window=(intercept, intercept + slope * (2**bits - 1))))


def _quantization(plan: QuantizePlan) -> Quantization:
    low, high = plan.window
    nothing = {"rmse": 0.0, "max_error": 0.0, "clipped_below": 0, "clipped_above": 0}
    return Quantization(
        bits=plan.bits, window=plan.window, slope=(high - low) / (2**plan.bits - 1), intercept=low, **nothing
    )


def with_part(plan: ChannelPlan, part: Record | None) -> ChannelPlan:
    return plan if part is None else plan.model_copy(update={"parts": (*plan.parts, part)})


def _proxy_plan(plan: ChannelPlan, wanted: ProxySettings) -> ProxyPlan:
    """Give each level a mesh, whether or not it saves samples."""
    (transfer,) = plan.transfer_functions
    indices = [level.index for level in plan.levels]
    return ProxyPlan(
        form=wanted.form,
        block=wanted.block,
        epsilon=wanted.epsilon,
        draco=wanted.draco,
        shares=(0.0,),
        meshes=tuple(
            ProxyMeshPlan(transfer=transfer.name, level=index, file=f"meshes/proxy-{index}.glb") for index in indices
        ),
        programs=tuple(proxy_program(program) for program in plan.programs),
    )


def _plan(  # noqa: PLR0917 - all that a test chose
    levels: list[NDArray[np.generic]],
    grid: Grid,
    transfer_function: TransferFunction,
    profile: DeviceProfile,
    volumes: tuple[VolumePlan, ...],
    entries: int,
    window: tuple[float, float],
    rays: RaySampling,
) -> ChannelPlan:
    texture3d = profile.max_3d_texture_size > 0
    lookup_format = "rgba16float" if "rgba16float" in profile.texture_formats else "rgba8unorm"
    crop = CropPlan(start_zyx=(0, 0, 0), stop_zyx=grid.shape_zyx)
    return ChannelPlan(
        channel=CHANNEL,
        shared=Shared(profile=profile, crop=crop, grid=grid, render=RenderSettings(), rays=rays),
        transfer_functions=(transfer_function,),
        quantize=QuantizePlan(bits=levels[0].dtype.itemsize * 8, window=window),
        levels=tuple(
            LevelPlan(
                channel=CHANNEL,
                index=i,
                factors_zyx=(2**i, 2**i, 2**i),
                shape_zyx=level.shape,
                filter="box" if i else "none",
            )
            for i, level in enumerate(levels)
        ),
        volumes=volumes,
        lookups=(
            LookupPlan(
                transfer=transfer_function.name, name="lut", file="lut.ktx2", format=lookup_format, entries=entries
            ),
        ),
        programs=(
            ProgramDesign(
                name="ray-caster",
                sampling="texture3d" if texture3d else "mosaic",
                vertex="ray.vert",
                fragment="ray.frag",
                levels=tuple(range(len(levels))),
                transfer=transfer_function.name,
            ),
        ),
    )


def _with_bricks(plan: ChannelPlan, wanted: BrickSettings) -> ChannelPlan:
    """Give a program for each level, which is bricks."""
    bits = plan.quantize.bits
    volumes = tuple(
        as_bricks(level, bits, plan.profile, Beside(1, 0), Bricks(wanted, filter=plan.volumes[0].filter))
        for level in plan.levels
    )
    (program,) = plan.programs
    programs = tuple(
        program.model_copy(
            update={
                "name": f"{program.name}-{level.index}",
                "sampling": "bricks",
                "levels": (level.index,),
                "fragment": f"ray-{level.index}.frag",
            }
        )
        for level in plan.levels
    )
    return plan.model_copy(update={"volumes": volumes, "programs": programs})


def _classified(plan: ChannelPlan, name: ClassificationName) -> ChannelPlan:
    """Give the plan with another kind of table in place of its lookup table."""
    if name == "lookup":
        return plan
    (lookup,), (program,) = plan.lookups, plan.programs
    tables: dict[str, object] = {}
    if name == "palette":
        tables["palettes"] = (PalettePlan(transfer=lookup.transfer, entries=lookup.entries),)
    elif name == "preintegrated":
        tables["preintegrated"] = (PreintegratedPlan(**lookup.model_dump(exclude={"format"})),)
    if name == "preclassified":
        # Six steps: short enough for the dense, long enough for the faint.
        update = {"transfer": lookup.transfer, "reference_mm": 6 * plan.rays.step_mm, "format": "rgba8unorm"}
        one_voxel = {"components_per_voxel": 4}
        tables = {
            "volumes": tuple(
                volume.model_copy(
                    update={**update, "mosaic": volume.mosaic and volume.mosaic.model_copy(update=one_voxel)}
                )
                for volume in plan.volumes
            )
        }
    program = program.model_copy(update={"classification": name})
    return plan.model_copy(update={"lookups": (), "programs": (program,), **tables})


def _volume(
    index: int, codes: NDArray[np.generic], profile: DeviceProfile, packing: Packing, room: Room | None
) -> VolumePlan:
    name = f"volume-{CHANNEL}-{index}"
    if profile.max_3d_texture_size > 0:
        texel = one_channel(8 * codes.dtype.itemsize, profile)
        assert texel is not None, profile
        return VolumePlan(
            level=index,
            names=(name,),
            files=(f"{name}.ktx2",),
            format=texel,
            shape_zyx=codes.shape,
            mosaic=None,
            channels=(CHANNEL,),
        )
    room = room or Room(profile.max_texture_size, profile.texture_units - 1, profile.npot, profile.square)
    layout = fit_mosaic(codes.shape, packing, room)
    assert layout is not None, f"{codes.shape} does not fit {room} with {packing}"
    names = tuple(f"{name}-{part}" for part in range(layout.textures))
    return VolumePlan(
        level=index,
        names=names,
        files=tuple(f"{each}.ktx2" for each in names),
        format="r8unorm" if packing.slices_per_texel == 1 else "rgba8unorm",
        shape_zyx=(1, *layout.texture_shape_yx),
        mosaic=layout,
        channels=(CHANNEL,),
    )
