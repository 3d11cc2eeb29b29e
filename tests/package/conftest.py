"""A small sealed package, made through `Draft` as the stages make it: odd sizes, unequal spacing, a flipped axis."""

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from volprep_formats.grid import Grid
from volprep_formats.package.channel import ChannelPart, Level, Quantization, SourceRecord, Statistics
from volprep_formats.package.manifest import Contribution, Heading, PlanItem, RenderSettings, StageRecord
from volprep_formats.package.picture import Picture, PictureMedium
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ComposedProgram, Program, RaySampling, Sampler, Uniform
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import MosaicLayout, Texture
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.source import SourceInfo
from volprep_formats.textures import ktx2

GRID = Grid.of((5, 7, 9), (2.5, 0.7, 0.3), (-12.0, 30.0, 4.5), ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)))


def key(name: str) -> str:
    return hashlib.sha256(name.encode()).hexdigest()


def profile(*, mosaic: bool) -> DeviceProfile:
    return DeviceProfile(
        name="small",
        api="es2.0" if mosaic else "es3.0",
        max_texture_size=64,
        max_3d_texture_size=0 if mosaic else 64,
        texture_units=8,
        texture_formats=("r8unorm", "rgba8unorm"),
        index_bits=16,
        max_texture_bytes=1_000_000,
    )


def heading(*, mosaic: bool = False) -> Heading:
    return Heading(
        name="shells",
        generator="volprep 0.1.0",
        profile=profile(mosaic=mosaic),
        pictures=(Picture(name="bone", media=(PictureMedium(channel="scan", transfer="bone"),)),),
    )


def _levels(*, mosaic: bool) -> tuple[Level, ...]:
    factors = [(1, 1, 1)] if mosaic else [(1, 1, 1), (1, 2, 2)]
    grids = [GRID.coarser(factor) for factor in factors]
    return tuple(
        Level(index=index, factors_zyx=factor, grid=grid, filter="box" if index else "none")
        for index, (factor, grid) in enumerate(zip(factors, grids, strict=True))
    )


def _volume(draft: Draft, level: Level, voxels: np.ndarray, *, mosaic: bool) -> Texture:
    """Write the texture of one level. The mosaic has three columns, and a row of one empty tile."""
    file = f"textures/level{level.index}.ktx2"
    layout = None
    shape = level.grid.shape_zyx
    if mosaic:
        slices, height, width = shape
        layout = MosaicLayout(
            tile_shape_yx=(height, width),
            slices=slices,
            slices_per_texel=1,
            tiles_x=3,
            tiles_y=2,
            texture_shape_yx=(2 * height, 3 * width),
        )
        tiles = np.zeros((6, height, width), np.uint8)
        tiles[:slices] = voxels
        voxels = tiles.reshape(2, 3, height, width).swapaxes(1, 2).reshape(1, 2 * height, 3 * width)
        shape = voxels.shape
    image = ktx2.Ktx2Image("r8unorm", shape, voxels, 2 if mosaic else 3)
    draft.write(file, "texture", ktx2.encode(image))
    return Texture(
        name=f"volume-scan-{level.index}",
        role="volume",
        file=file,
        shape_zyx=shape,
        format="r8unorm",
        dimension="2d" if mosaic else "3d",
        level=level.index,
        channels=("scan",),
        mosaic=layout,
    )


def _program(*, mosaic: bool) -> ComposedProgram:
    program = Program(
        name="raycast",
        sampling="mosaic" if mosaic else "texture3d",
        vertex="shaders/screen.vert",
        fragment="shaders/raycast.frag",
        uniforms=(
            Uniform(name="u_box_from_clip", type="mat4x4f", source="box_from_clip"),
            Uniform(name="u_step_mm", type="f32", source="step_mm"),
        ),
        samplers=("u_volume", "u_transfer"),
    )
    inputs = (Sampler(name="u_volume", role="volume"), Sampler(name="u_transfer", role="transfer"))
    levels = (0,) if mosaic else (0, 1)
    rays = RaySampling(step_mm=0.15)
    return ComposedProgram(program=program, picture="bone", levels=levels, inputs=inputs, rays=rays)


def run_import(draft: Draft, seed: int = 0) -> None:
    voxels = np.random.default_rng(seed).integers(0, 256, GRID.shape_zyx, np.uint8)
    draft.write("work/level0-scan.raw", "work", voxels.tobytes())
    quantization = Quantization(
        bits=8, window=(0.0, 255.0), slope=1.0, intercept=0.0, rmse=0.0, max_error=0.0, clipped_below=0, clipped_above=0
    )
    part = ChannelPart(
        name="scan",
        source=SourceRecord(info=SourceInfo(format="raw", grid=GRID, stored_type="uint8"), sha256=key("scan")),
        statistics=Statistics(minimum=0.0, maximum=255.0, non_finite=0),
        stored_type="uint8",
        quantization=quantization,
    )
    draft.commit(StageRecord(name="import", key=key("import"), made=(Contribution(channel=part),)))


def run_texture(draft: Draft) -> None:
    mosaic = draft.manifest.profile.api == "es2.0"
    voxels = np.frombuffer(draft.read_bytes("work/level0-scan.raw"), np.uint8).reshape(GRID.shape_zyx)
    levels = _levels(mosaic=mosaic)
    textures = []
    for level in levels:
        fz, fy, fx = level.factors_zyx
        textures.append(_volume(draft, level, voxels[::fz, ::fy, ::fx], mosaic=mosaic))
    table = np.random.default_rng(1).integers(0, 256, (1, 1, 16, 4), np.uint8)
    draft.write("textures/bone.ktx2", "texture", ktx2.encode(ktx2.Ktx2Image("rgba8unorm", (1, 1, 16), table, 2)))
    lookup = Texture(
        name="lookup-bone",
        role="transfer",
        file="textures/bone.ktx2",
        shape_zyx=(1, 1, 16),
        format="rgba8unorm",
        dimension="2d",
        transfer="bone",
        max_extinction_per_mm=2.0,
    )
    bone = TransferFunction(
        name="bone",
        points=(
            TransferPoint(value=0.0, colour=(0.0, 0.0, 0.0), extinction_per_mm=0.0),
            TransferPoint(value=255.0, colour=(1.0, 1.0, 1.0), extinction_per_mm=2.0),
        ),
    )
    part = ChannelPart(name="scan", levels=levels, transfer_functions=(bone,))
    made = Contribution(channel=part, textures=(*textures, lookup))
    draft.commit(
        StageRecord(name="texture", key=key("texture"), made=(made,)), draft.manifest.model_copy(update={"grid": GRID})
    )


def run_shaders(draft: Draft) -> None:
    mosaic = draft.manifest.profile.api == "es2.0"
    draft.write("shaders/screen.vert", "shader", b"attribute vec2 a_ndc;\n")
    draft.write("shaders/raycast.frag", "shader", b"void main() {}\n")
    made = Contribution(programs=(_program(mosaic=mosaic),))
    told = draft.manifest.model_copy(update={"render": RenderSettings()})
    draft.commit(StageRecord(name="shaders", key=key("shaders"), made=(made,)), told)


def run_seal(draft: Draft) -> None:
    draft.write("preview.png", "preview", b"\x89PNG, or so")
    files = tuple(record.path for record in draft.manifest.files if record.role != "work")
    made = Contribution(preview="preview.png")
    plan = (PlanItem(name="everything", kept=True, reason="small", files=files),)
    told = draft.manifest.model_copy(update={"plan": plan})
    draft.commit(StageRecord(name="seal", key=key("seal"), made=(made,)), told, seal=True)


STAGES = (run_import, run_texture, run_shaders, run_seal)


def build(folder: Path, *, mosaic: bool = False, seed: int = 0) -> Path:
    draft = Draft.create(folder, heading(mosaic=mosaic))
    run_import(draft, seed)
    for stage in STAGES[1:]:
        stage(draft)
    return folder


@pytest.fixture(scope="session")
def templates(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Packages to copy: building one waits for the disk several times."""
    room = tmp_path_factory.mktemp("templates")
    return {"3d": build(room / "3d"), "mosaic": build(room / "mosaic", mosaic=True)}


@pytest.fixture
def sealed(tmp_path: Path, templates: dict[str, Path]) -> Path:
    """A sealed package with two 3D levels."""
    return Path(shutil.copytree(templates["3d"], tmp_path / "shells.volpkg"))


@pytest.fixture
def sealed_mosaic(tmp_path: Path, templates: dict[str, Path]) -> Path:
    """A sealed package with one mosaic."""
    return Path(shutil.copytree(templates["mosaic"], tmp_path / "tiles.volpkg"))


@pytest.fixture
def draft(tmp_path: Path) -> Draft:
    """A draft after its stages import and texture."""
    made = Draft.create(tmp_path / "draft.volpkg", heading())
    run_import(made)
    run_texture(made)
    return made


@pytest.fixture
def manifest() -> Heading:
    """What a new draft says of its package."""
    return heading()


@pytest.fixture
def new_draft(tmp_path: Path, manifest: Heading) -> Draft:
    """A draft before its first stage."""
    return Draft.create(tmp_path / "new.volpkg", manifest)


@pytest.fixture
def build_package() -> Callable[..., Path]:
    """Function that builds a sealed package in a folder that it makes."""
    return build
