"""A report with every part in it, without a scan, a package or a driver."""

import numpy as np
from tiny_packages import function

from volprep.plan.form_trial import FormTrial
from volprep.validation.results.measurements import (
    Breakdown,
    Convergence,
    Driver,
    EmptySpace,
    ErrorNumbers,
    LevelFloor,
    ProgramResult,
    SavingView,
    SavingWay,
    Sweep,
    SweepPoint,
    ViewPictures,
    ViewResult,
)
from volprep.validation.results.report import Cost, PackageFacts, Report
from volprep.validation.results.seen import (
    FullSize,
    KeptLight,
    LeastKept,
    OtherDrawing,
    OtherView,
    SeenNumbers,
    SizeErrors,
)
from volprep.validation.timing.turns import Milliseconds
from volprep.validation.verdicts.verdict import judge, passes
from volprep_formats.grid import Grid
from volprep_formats.package.channel import Channel, Level, Quantization, SourceRecord, Statistics
from volprep_formats.package.manifest import FileRecord, Manifest, PlanItem, RenderSettings, Tolerance
from volprep_formats.package.parts.proxy.record import Proxy, ProxyMeshFile
from volprep_formats.package.parts.skip.record import Skipping, SkipTable
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.texture import Texture
from volprep_formats.source import SourceInfo

CHANNEL = "scan"
VIEWS = ("anterior", "superior", "anterior-left")
STEP_RATIOS = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125)


def errors(rmse: float, maximum: float | None = None) -> ErrorNumbers:
    """Numbers that belong to an error of `rmse`."""
    return ErrorNumbers(
        rmse=rmse,
        maximum=rmse * 8 if maximum is None else maximum,
        seen_rmse=rmse * 2,
        off=0.0,
        psnr_black_db=float(-20 * np.log10(rmse)) if rmse else None,
        psnr_white_db=None,
        ssim_black=1 - rmse,
        ssim_white=1.0,
    )


def seen(
    rmse: float, *, flip: float = 0.01, kept: float = 1.0, maximum: float | None = None, within: float = 0.0
) -> SeenNumbers:
    """What a person sees of an error; `within` is the uncertainty of the kept light."""
    return SeenNumbers(
        share=0.25,
        rmse=rmse,
        maximum=rmse * 8 if maximum is None else maximum,
        off=0.001,
        flip=flip,
        kept_light=kept,
        kept_light_at_most=kept + within,
        things=2,
        least_kept=LeastKept(rows=(3, 9), columns=(4, 30), light=12.5),
    )


def in_full(numbers: SeenNumbers) -> FullSize:
    """The same errors in large pictures."""
    shared = FullSize.model_fields.keys() & SeenNumbers.model_fields.keys()
    return FullSize(**{name: getattr(numbers, name) for name in shared}, contrast_loss=0.1)


def level_view(numbers: SeenNumbers, box: SeenNumbers, **view: object) -> OtherView:
    """One view of a coarse level beside the box reference; errors are the same in pictures of every size."""
    fields = {"passed": False, "rmse": numbers.rmse / 2, "shift_voxels": 0.02, **view}
    fields = {"full": in_full(numbers), "box_full": in_full(box), **fields}
    return OtherView(view="anterior-left", seen=numbers, box=box, **fields)


def level_drawing(
    level: int, numbers: SeenNumbers, *, preview: bool = False, excused: bool = False, **view: object
) -> OtherDrawing:
    """A coarse level in one view."""
    found = level_view(numbers, seen(0.03, flip=0.1, kept=0.4), **view)
    size = {name: getattr(numbers, name) for name in ("rmse", "flip", "kept_light")}
    return OtherDrawing(
        item=f"level {level} with skin",
        program="raycast",
        level=level,
        preview_only=preview,
        excused=excused,
        pixels=48,
        sizes=(SizeErrors(pixels=48, passed=found.passed, **size),),
        right_up_to_pixels=48 if found.passed else None,
        views=(found,),
    )


def view(name: str, total: ErrorNumbers, tolerance: Tolerance) -> ViewResult:
    """One view with this total error."""
    numbers = seen(total.seen_rmse, maximum=total.maximum)
    pictures = {field: f"pictures/{name}-{field.replace('_', '-')}.png" for field in ViewPictures.model_fields}
    return ViewResult(
        view=name,
        passed=passes(numbers, tolerance),
        total=total,
        seen=numbers,
        data=errors(total.rmse * 0.8),
        drawing=errors(total.rmse * 0.5),
        truth_bound=3e-7,
        pictures=ViewPictures(**pictures),
    )


def times(median: float) -> Milliseconds:
    """Times of seven draws."""
    return Milliseconds(median=median, low=0.9 * median, high=1.2 * median, pictures=7)


def sweep_of(levels: tuple[int, ...]) -> Sweep:
    """A sweep whose quadrature is of order 2."""
    points = tuple(
        SweepPoint(
            level=level,
            step_mm=0.25 * step_ratio,
            step_ratio=step_ratio,
            samples_mean=400 / step_ratio,
            samples_max=int(900 / step_ratio),
            draw=times(60 / step_ratio + 15) if step_ratio > 0.2 else None,
            total=errors(float(np.hypot(0.002 * step_ratio**2, 0.003 * (level + 1)))),
            drawing=errors(float(np.hypot(0.002 * step_ratio**2, 0.0009))),
            quadrature=errors(0.002 * step_ratio**2) if level == 0 else None,
        )
        for level in levels
        for step_ratio in STEP_RATIOS[: 6 if level == 0 else 3]
    )
    return Sweep(
        view="anterior-left",
        timed_size=128,
        float_target="rgba32f",
        points=points,
        floors=tuple(
            LevelFloor(
                level=level,
                shape_zyx=(40 >> level, 48 >> level, 48 >> level),
                texture_bytes=92_160 >> 3 * level,
                data=errors(0.003 * (level + 1)),
            )
            for level in levels
        ),
        breakdown=Breakdown(
            data=errors(0.003), table=errors(0.0004), quadrature=errors(0.002), termination=None, target=errors(0.0009)
        ),
        convergence=Convergence(
            expected=2.0,
            slopes=(2.0, 2.0, 2.0, 2.0, 2.0),
            observed=2.0,
            fitted_steps_mm=(0.25, 0.125, 0.0625, 0.03125),
            limits=("Nothing limits it.",),
        ),
    )


def empty_space_of(*, passed: bool) -> EmptySpace:
    """What a skip table and a mesh save; where it does not pass, the mesh changes a picture."""
    ways = {"neither": (400.0, 0.0), "table": (120.0, 90.0), "mesh": (200.0, 0.0), "both": (120.0, 40.0)}
    return EmptySpace(
        drawn_by="proxy-raycast",
        ways=tuple(
            SavingWay(
                way=way,
                draw=times(samples / 4),
                views=tuple(
                    SavingView(
                        view=name,
                        samples_mean=samples,
                        looks_mean=looks,
                        difference=0.0 if passed or way in {"neither", "table"} else 0.5,
                    )
                    for name in VIEWS
                ),
            )
            for way, (samples, looks) in ways.items()
        ),
        limit=1 / 255,
        rounding=0.0,
        passed=passed,
        mesh_read_ms=1.5,
        picture="pictures/raycast-samples.png",
    )


FORMS = (
    FormTrial(
        format="etc2-rgba8unorm",
        channel=CHANNEL,
        kept=False,
        level=0,
        size_bytes=23_040,
        basis="sample",
        pictures=1,
        psnr_db=38.0,
        rmse=0.004,
        maximum=0.2,
    ),
    FormTrial(
        format="astc-6x6-unorm",
        channel=CHANNEL,
        kept=True,
        level=0,
        size_bytes=41_000,
        basis="level",
        pictures=9,
        psnr_db=45.0,
        rmse=0.002,
        maximum=0.1,
        seconds=2.5,
    ),
)


def manifest_of(tolerance: Tolerance) -> Manifest:
    """The manifest of a small package with two levels."""
    grid = Grid.of((40, 48, 48), (1.0, 0.9, 0.9))
    levels = (
        Level(index=0, factors_zyx=(1, 1, 1), grid=grid, filter="none"),
        Level(index=1, factors_zyx=(2, 2, 2), grid=grid.coarser((2, 2, 2)), filter="box"),
    )
    return Manifest(
        state="sealed",
        name="small-head",
        generator="volprep 0.1.0",
        profile=DeviceProfile(
            name="gles3",
            api="es3.0",
            max_texture_size=4096,
            max_3d_texture_size=1024,
            texture_units=16,
            texture_formats=("r8unorm",),
            index_bits=32,
            max_texture_bytes=1 << 28,
        ),
        channels=(
            Channel(
                name=CHANNEL,
                stored_type="uint8",
                source=SourceRecord(
                    info=SourceInfo(
                        format="dicom", grid=grid, stored_type="int16", modality="MR", remarks=("one file ignored",)
                    ),
                    sha256="a" * 64,
                ),
                statistics=Statistics(minimum=0, maximum=278, non_finite=0),
                quantization=Quantization(
                    bits=8,
                    window=(0.0, 255.0),
                    slope=1.0,
                    intercept=0.0,
                    rmse=0.25,
                    max_error=0.5,
                    clipped_below=0,
                    clipped_above=12,
                ),
                levels=levels,
                transfer_functions=(
                    function(
                        (20, (0.9, 0.5, 0.3), 0.0), (60, (0.9, 0.6, 0.4), 0.2), (200, (1.0, 1.0, 0.9), 1.5), name="skin"
                    ),
                ),
            ),
        ),
        textures=(
            *(
                Texture(
                    name=f"volume-{CHANNEL}-{level.index}",
                    role="volume",
                    file=f"level{level.index}.ktx2",
                    shape_zyx=level.grid.shape_zyx,
                    format="r8unorm",
                    dimension="3d",
                    level=level.index,
                    channels=(CHANNEL,),
                )
                for level in levels
            ),
            Texture(
                name="skip-skin-0",
                role="skip",
                file="skip.ktx2",
                shape_zyx=(10, 12, 12),
                format="r8unorm",
                dimension="3d",
                level=0,
                transfer="skin",
            ),
        ),
        skipping=Skipping(
            tables=(
                SkipTable(
                    texture="skip-skin-0",
                    level=0,
                    transfer="skin",
                    kind="distance",
                    block=4,
                    blocks_zyx=(10, 12, 12),
                    empty_share=0.7,
                ),
            )
        ),
        proxy=Proxy(
            meshes=(
                ProxyMeshFile(
                    name="skin-0",
                    transfer="skin",
                    level=0,
                    form="merged",
                    block=8,
                    file="mesh.glb",
                    vertices=80,
                    triangles=156,
                    box_from_mesh_mm_xyz=(0.225, 0.225, 0.25),
                    occupied_share=0.3,
                ),
            )
        ),
        render=RenderSettings(tolerance=tolerance),
        plan=(
            PlanItem(
                name="level 0",
                channel=CHANNEL,
                kept=True,
                reason="finest level that fits",
                files=("level0.ktx2",),
                size_bytes=92160,
            ),
            PlanItem(
                name="normals", channel=CHANNEL, kept=False, reason="the scene has no lighting", size_bytes=276480
            ),
        ),
        files=(
            FileRecord(path="level0.ktx2", role="texture", size_bytes=92160, sha256="b" * 64),
            FileRecord(path="mesh.glb", role="mesh", size_bytes=4_096, sha256="d" * 64),
            FileRecord(path="skip.ktx2", role="texture", size_bytes=1_640, sha256="e" * 64),
        ),
    )


def report_of(totals: tuple[float, ...], tolerance: Tolerance | None = None, *, same_pictures: bool = True) -> Report:
    """A report whose views have these total root mean square errors."""
    tolerance = tolerance or Tolerance()
    views = tuple(view(name, errors(rmse), tolerance) for name, rmse in zip(VIEWS, totals, strict=True))
    programs = (
        ProgramResult(
            program="raycast",
            technique="ray-casting",
            transfer="skin",
            level=0,
            views=views,
            sweep=sweep_of((0, 1)),
            empty_space=empty_space_of(passed=same_pictures),
            others=(level_drawing(1, seen(0.02, flip=0.05, kept=0.8), preview=True, passed=True),),
            kept_light=(
                KeptLight(level=1, view="superior", kept_light=0.8, box=0.4, things=2, picture="pictures/kept1.png"),
            ),
        ),
    )
    return Report(
        generator="volprep 0.1.0",
        package=PackageFacts(
            file_name="small-head.volpkg", manifest_sha256="c" * 64, size_bytes=123_456, manifest=manifest_of(tolerance)
        ),
        picture_size=256,
        target="rgba8",
        step_mm=0.25,
        tolerance=tolerance,
        oracle_tolerance=1e-6,
        difference_gain=32.0,
        warnings=("full resolution is left out, the finest level has 9×9×9 of 18×18×18 voxels",),
        verdict=judge(programs, tolerance),
        programs=programs,
        forms=FORMS,
        driver=Driver(vendor="Mesa", renderer="llvmpipe", version="OpenGL ES 3.2 Mesa"),
        cost=Cost(
            seconds={"oracle": 12.5, "all": 75.0}, threads=2, peak_memory_bytes=512_000_000, source_bytes=184_320
        ),
    )
