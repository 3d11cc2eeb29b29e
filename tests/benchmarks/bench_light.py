"""Light that is computed once beside what shaders can do at run time, against the same path-traced truth.

`python -m tests.benchmarks.bench_light SCAN [--every N] [--preset NAME] [--profile NAME] [--ways WORDS]` prints a table
in Markdown: decibels, size, preparation and drawing. Each way is a package that is built as a user builds it, and drawn
on the driver at hand. The truth is multiple scattering under a white sky; every picture may have one factor of
brightness, the one that suits it best, so that a way is not judged by its exposure. `--every` takes each Nth voxel
along each axis. `--ways` takes the first way and those whose names have the words: OpenGL ES 2 has no shadows.
`--timed-pixels` is the width and height of the pictures that are timed; a GPU needs about 1024. Times are of the
processor on a software driver, and of the wall clock on a GPU.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volprep.library.scans import read_scan
from volprep.pipeline.build import build
from volprep.render.gl_records import TargetFormat
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.truth.camera import standard_views
from volprep.truth.path_traced import LitVolume, TracedPicture, traced_picture
from volprep_formats.arrays import Float64Array
from volprep_formats.package.parts.light.model import LightChannels, LightModel
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

from .waking import is_software, wake

VIEWS = ("anterior", "anterior-left", "superior")
PIXELS = 64
PATHS = 256
_ROUNDS = 3
_LAMP = "light_mm = [-150.0, -220.0, 180.0]\n"
_SCENE = """name = "s"
profile = "{profile}"
crop = "none"
[source]
path = "scan.raw"
raw = {{ shape_zyx = {shape}, dtype = "{dtype}", spacing_mm_zyx = {spacing} }}
[pyramid]
coarsest_longest_axis = 4096
[render]
step_voxels = {step_voxels}
{render}
[lighting]
{lighting}
[[transfer]]
{transfer}
"""
WAYS = {
    "unlit": ('lighting = "none"', ""),
    "headlight": ('lighting = "headlight"', ""),
    "Phong, shadow rays": ('lighting = "phong"', _LAMP + 'shadows = "rays"'),
    "Phong, half-angle slices": ('lighting = "phong"\ntechnique = "view-slices"', _LAMP + 'shadows = "half-angle"'),
    "baked occlusion, 1/2": ("", 'baked = "occlusion"\nresolution = 2'),
    "baked scattering, 1/4": ("", 'baked = "scattering"\nresolution = 4'),
    "baked scattering, 1/2": ("", 'baked = "scattering"\nresolution = 2'),
    "baked scattering in colour, 1/2": ("", 'baked = "scattering"\nresolution = 2\nchannels = "rgb"'),
    "baked scattering that turns, 1/2": ("", 'baked = "scattering"\nresolution = 2\nturnable = true'),
}
"""Settings of [render] and of [lighting]."""


@dataclass(frozen=True)
class Made:
    """A package of one way, and what it took."""

    way: str
    package: Package
    seconds: float

    @property
    def megabytes(self) -> float:
        """Bytes of its textures."""
        manifest = self.package.manifest
        return sum(len(self.package.read_bytes(each.file)) for each in manifest.textures) / 1e6


def make(
    folder: Path,
    way: str,
    voxels: np.ndarray,
    spacing_mm_zyx: Sequence[float],
    transfer: str,
    *,
    profile: str = "gles3",
    step_voxels: float = 0.5,
) -> Made:
    """Build the package of a way; `transfer` is the transfer function in TOML."""
    folder.mkdir()
    voxels.tofile(folder / "scan.raw")
    render, lighting = WAYS[way]
    scene = _SCENE.format(
        shape=list(voxels.shape),
        dtype=voxels.dtype.name,
        spacing=list(spacing_mm_zyx),
        render=render,
        lighting=lighting,
        transfer=transfer,
        profile=profile,
        step_voxels=step_voxels,
    )
    (folder / "s.toml").write_text(scene, encoding="utf-8")
    # Without light that is computed once the plan tries nothing: the difference is what this light takes.
    start = time.process_time()
    build(load_request(folder / "s.toml"), folder / "s.volpkg", Silent())
    return Made(way, Package.open(folder / "s.volpkg"), time.process_time() - start)


def truths(
    made: Made,
    voxels: np.ndarray,
    views: Sequence[str] = VIEWS,
    pixels: int = PIXELS,
    *,
    channels: LightChannels = "luminance",
) -> dict[str, TracedPicture]:
    """Path trace multiple scattering under a white sky, as a brightness or in colour."""
    manifest = made.package.manifest
    info, grid = manifest.channels[0].source.info, manifest.levels[0].grid
    model = LightModel(kind="scattering", channels=channels)
    lit = LitVolume(voxels, grid, info.slope, info.intercept, manifest.transfer_functions[0], model)
    return {
        name: traced_picture(lit, standard_views(grid)[name].box_from_clip(grid, 1.0), (pixels, pixels), PATHS)
        for name in views
    }


def draw(made: Made, views: Sequence[str] = VIEWS, pixels: int = PIXELS) -> list[Float64Array]:
    """Draw all views."""
    grid = made.package.manifest.levels[0].grid
    cameras = [standard_views(grid)[name].box_from_clip(grid, 1.0) for name in views]
    with _renderer(made) as renderer:
        return [renderer.render(camera, (pixels, pixels)).astype(np.float64) for camera in cameras]


def drawing_ms(made: Sequence[Made], pixels: int, rounds: int = _ROUNDS) -> Float64Array:
    """Return the milliseconds of a picture, [round, way]: means over the views, with all ways in turn in each round."""
    grid = made[0].package.manifest.levels[0].grid
    cameras = [standard_views(grid)[name].box_from_clip(grid, 1.0) for name in VIEWS]
    found = np.zeros((rounds, len(made)))
    with ExitStack() as stack:
        renderers = [stack.enter_context(_renderer(each)) for each in made]
        driver = renderers[0].driver.renderer
        clock = time.process_time if is_software(driver) else time.perf_counter
        wake(driver, lambda: renderers[0].time_ms(cameras[0], (pixels, pixels), clock=clock))
        for row, way in np.ndindex(found.shape):
            times = [renderers[way].time_ms(camera, (pixels, pixels), repeats=3, clock=clock) for camera in cameras]
            found[row, way] = np.mean(times)
    return found


def _renderer(made: Made) -> Renderer:
    target: TargetFormat = "rgba8" if made.package.manifest.profile.dialect == "es100" else "rgba32f"
    return Renderer(made.package, level=0, target=target)


def decibels(pictures: Sequence[Float64Array], traced: Sequence[TracedPicture]) -> tuple[float, float]:
    """Return decibels over seen pixels beyond the noise of the truth, and the factor of brightness that suits best."""
    ours = np.concatenate([each[truth.rgba[..., 3] > 0, :3] for each, truth in zip(pictures, traced, strict=True)])
    true = np.concatenate([truth.rgba[truth.rgba[..., 3] > 0, :3] for truth in traced])
    noise = np.concatenate([truth.variance[truth.rgba[..., 3] > 0, :3] for truth in traced])
    factor = float((ours * true).sum() / (ours**2).sum())
    beyond = float(((factor * ours - true) ** 2 - noise).mean())
    return -10 * np.log10(max(beyond, 1e-8)), factor


def main() -> None:
    """Measure all ways, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scan", type=Path)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--preset", default="mr-head")
    parser.add_argument("--profile", default="gles3")
    parser.add_argument("--ways", default="")
    parser.add_argument("--timed-pixels", type=int, default=PIXELS)
    asked = parser.parse_args()
    ways = [way for number, way in enumerate(WAYS) if number == 0 or asked.ways in way]
    found = read_scan(asked.scan)
    n = asked.every
    voxels = np.ascontiguousarray(found.stored[::n, ::n, ::n])
    spacing = [n * h for h in found.grid.spacing_mm_zyx]
    transfer = f'preset = "{asked.preset}"'
    with tempfile.TemporaryDirectory() as folder:
        made = [
            make(Path(folder) / str(i), way, voxels, spacing, transfer, profile=asked.profile)
            for i, way in enumerate(ways)
        ]
        grey = list(truths(made[0], voxels).values())
        colour = list(truths(made[0], voxels, channels="rgb").values())
        drawn = [draw(each) for each in made]
        ms = drawing_ms(made, asked.timed_pixels)
        megabytes = [each.megabytes for each in made]
    write = sys.stdout.write
    write(f"{asked.scan.name}, {'×'.join(map(str, voxels.shape))} voxels, preset {asked.preset}, {asked.profile}\n\n")
    write(
        "| way | dB | brightness | MB | preparation, processor s | ms | times unlit |\n|---|---|---|---|---|---|---|\n"
    )
    for i, (each, pictures) in enumerate(zip(made, drawn, strict=True)):
        times = float(np.median(ms[:, i] / ms[:, 0]))
        db, factor = decibels(pictures, colour if "colour" in each.way else grey)
        drawing = f"{np.median(ms[:, i]):.2f} | {times:.2f}"
        cells = f"{db:.1f} | {factor:.2f} | {megabytes[i]:.2f} | {each.seconds:.1f} | {drawing}"
        write(f"| {each.way} | {cells} |\n")


if __name__ == "__main__":
    main()
