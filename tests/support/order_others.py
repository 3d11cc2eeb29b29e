"""Orders of what is no way of its own: what is lit, labels, several channels in one picture, stacks of slices."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scene_builds
from channel_scene import write_channel_scene
from colour_scene import waves, write_colour_scene, write_pictures
from order_bench import BYTES_STEPS_MM, PIXELS, STEPS_MM, Falling, rmse
from order_light import by_cell
from order_scans import TRANSFER, built, camera, field, grid_of
from scene_builds import view_of
from slice_packages import slice_package
from two_grids import write_two_grids
from web_scenes import segments_scene

from volprep.compositing import COMPOSITINGS
from volprep.lab.stress.combinations import Way, in_way
from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.colour import PARTS
from volprep.scene.request import load_request
from volprep.scene.scene import PyramidSettings, QuantizeSettings, Scene
from volprep.techniques import TECHNIQUES
from volprep.truth.camera import standard_views
from volprep.truth.colour import media_of_colour
from volprep.truth.decoded import level_volume, table_function
from volprep.truth.phantoms import sampled
from volprep.truth.stacks import stack_picture
from volprep.truth.volume import Medium, Volume
from volprep.validation.subjects.labelled import LabelledSubject
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.parts.slices.texels import slice_texels
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.textures.texel_formats import SRGB

NOMINAL_VOXELS = 0.0625
_SHADOWS = '[lighting]\nlight_mm = [-60.0, -80.0, 40.0]\nshadows = "rays"\n'
_ONE_HIDDEN = "[[segments.style]]\nlabels = [1]\nvisible = false\n"
EMISSION_ABSORPTION = COMPOSITINGS["emission-absorption"]


@dataclass(frozen=True)
class Other:
    """Something that has an order."""

    name: str
    finer: str
    expected: float
    falling: Callable[[Path], Falling]
    scatter: float = 0.3


@dataclass(frozen=True)
class Drawn:
    """How a picture is drawn."""

    technique: TechniqueName = "ray-casting"
    level: int = 0

    @property
    def pyramid(self) -> PyramidSettings:
        """Settings with this level as the coarsest."""
        return PyramidSettings(coarsest_longest_axis=6 if self.level else 1024)

    def errors(self, package: Package, shown: str, steps_mm: Sequence[float], truth: np.ndarray) -> list[float]:
        """Return the error of each step."""
        program = next(each for each in package.manifest.level_programs if each.transfer == shown)
        way = Way(self.technique, program.compositing, program.classification, program.sampling)
        other = package if self.technique == program.technique else in_way(package, program, way)
        with Renderer(other, level=self.level, transfer=shown, target="rgba32f") as renderer:
            return [rmse(renderer.render(camera(package), truth.shape[:2], step), truth) for step in steps_mm]


USUAL = Drawn()


def _by_step(
    package: Package,
    transfers: Sequence[str],
    shown: str,
    *,
    steps_mm: Sequence[float] = STEPS_MM,
    whole: Callable[[Sequence[Medium]], Sequence[Medium]] = lambda media: media,
    drawn: Drawn = USUAL,
) -> Falling:
    """Errors of ever finer steps, with whatever lights what the package holds; `whole` makes media of its channels."""
    parts = [(package_of_transfer(package, name), name) for name in transfers]
    media = [Medium(level_volume(part, drawn.level), table_function(part, name)) for part, name in parts]
    truth = EMISSION_ABSORPTION.oracle(whole(media), camera(package), (PIXELS, PIXELS)).rgba
    return Falling(steps_mm, drawn.errors(package, shown, steps_mm, truth))


def _lit(lighting: str, sampling: str, normals: str = "volume", drawn: Drawn = USUAL) -> Callable[[Path], Falling]:
    def change(scene: Scene) -> Scene:
        light = scene.lighting.model_copy(update={"normals": normals})
        return scene.model_copy(update={"lighting": light, "pyramid": drawn.pyramid})

    def falling(folder: Path) -> Falling:
        package = built(folder, Way(sampling=sampling), NOMINAL_VOXELS, lighting=lighting, change=change)
        steps_mm = BYTES_STEPS_MM if sampling == "mosaic" else STEPS_MM
        return _by_step(package, [TRANSFER], TRANSFER, steps_mm=steps_mm, drawn=drawn)

    return falling


def _labels(sampling: str) -> Callable[[Path], Falling]:
    def change(scene: Scene) -> Scene:
        source = scene.source.model_copy(update={"labels": True})
        return scene.model_copy(update={"source": source, "quantize": QuantizeSettings()})

    def falling(folder: Path) -> Falling:
        def named(box_mm: np.ndarray) -> np.ndarray:
            return np.rint(field(box_mm) / 50.0) * 50.0

        package = built(folder, Way(sampling=sampling), NOMINAL_VOXELS, values=named, change=change)
        # Longer steps than a voxel are not exact.
        return _by_step(package, [TRANSFER], TRANSFER, steps_mm=STEPS_MM[2:])

    return falling


def _together(profile: str, channels: str, drawn: Drawn = USUAL) -> Callable[[Path], Falling]:
    def falling(folder: Path) -> Falling:
        folder.mkdir(parents=True, exist_ok=True)
        path = write_channel_scene(folder, profile)
        text = path.read_text().replace(
            "[render]", f'[lab.textures]\nchannels = "{channels}"\n[render]\nstep_voxels = 0.1\nopacity_cutoff = 1.0'
        )
        path.write_text(text + '\n[skip]\nkind = "none"\n[together]\nname = "body"\ntransfers = ["white", "red"]\n')
        package = scene_builds.built(path, folder / "tissues.volpkg")
        # A table of bytes has a kink at each entry, and two have two: coarse steps see none of them.
        steps_mm = STEPS_MM[:3] if profile.startswith("gles2") else STEPS_MM
        return _by_step(package, ["white", "red"], "body", steps_mm=steps_mm, drawn=drawn)

    return falling


def _on_two_grids(folder: Path) -> Falling:
    folder.mkdir(parents=True, exist_ok=True)
    path = write_two_grids(folder, more='box = "first"\n[skip]\nkind = "none"')
    render = "[render]\nstep_voxels = 0.05\nopacity_cutoff = 1.0"
    path.write_text(path.read_text().replace("[render]", render))
    package = scene_builds.built(path, folder / "fused.volpkg")
    # Finer steps are off by the rounding of two matrices, 7e-6.
    return _by_step(package, ["body", "hot"], "both", steps_mm=STEPS_MM[:4])


def _colour(profile: str, drawn: Drawn = USUAL) -> Callable[[Path], Falling]:
    def falling(folder: Path) -> Falling:
        folder.mkdir(parents=True, exist_ok=True)
        more = '[render]\nstep_voxels = 0.1\nopacity_cutoff = 1.0\n[skip]\nkind = "none"\n'
        scene = write_colour_scene(folder, profile, tables=more)
        write_pictures(folder / "slices.tif", waves())
        request = load_request(scene)
        # Mesa's software driver decodes sRGB by a polynomial, whose error of 0.0004 would hide that of the steps.
        formats = tuple(each for each in request.profile.texture_formats if each != SRGB)
        linear = replace(request, profile=request.profile.model_copy(update={"texture_formats": formats}))
        build(linear, folder / "ball.volpkg", Silent())
        return _by_step(Package.open(folder / "ball.volpkg"), PARTS, "colour", whole=media_of_colour, drawn=drawn)

    return falling


def _segments(
    border: str, lighting: str = "none", compositing: str = "", light: str = "", drawn: Drawn = USUAL
) -> Callable[[Path], Falling]:
    def falling(folder: Path) -> Falling:
        render = f'[render]\nlighting = "{lighting}"\nopacity_cutoff = 1.0\n'
        more = f'border = "{border}"\n{render}[skip]\nkind = "none"\n{light}'
        folder.mkdir(parents=True, exist_ok=True)
        path = segments_scene("gles3", more)(folder)
        if compositing:
            text = path.read_text().replace("[render]", f'[render]\ncompositing = "{compositing}"')
            surface = "isovalue = 150.0\npoints" if compositing == "first-hit" else "points"
            path.write_text(text.replace("points", surface).replace("[render]", f"{_ONE_HIDDEN}[render]"))
        package = scene_builds.built(path, folder / "segments.volpkg")
        labels = held_labels(package.manifest.textures, 0, package.read_bytes)
        subject = LabelledSubject(package, level_volume(package, 0), PIXELS, labels, package.manifest.segments)
        subject.cameras = standard_views(package.manifest.levels[0].grid, "perspective")
        truth = subject.on_table("segments", "anterior-left", 0).rgba
        # One value of a ray is exact for steps of up to a voxel.
        steps_mm = STEPS_MM[2:] if compositing else STEPS_MM
        if light:
            # Mesa's software driver ends the loops of shadow rays with finer steps.
            steps_mm = tuple(step for step in steps_mm if step > 0.12)
        return Falling(steps_mm, drawn.errors(package, "segments", steps_mm, truth))

    return falling


def _stacks(view: str, layers: int = 1) -> Callable[[Path], Falling]:
    """Stacks of slices have the distance of the voxels: they get finer as the grid does.

    In double precision, from the texels that OpenGL ES 1.1 is given; test_slices.py says that it draws the same.
    """

    def falling(folder: Path) -> Falling:
        shapes = [(2, 5, 6), (4, 10, 12), (6, 15, 18)]
        fine = grid_of((96, 112, 128))
        box_from_clip = view_of(fine, view)
        shape_hw = (PIXELS, PIXELS)
        errors = []
        for shape_zyx in shapes:
            grid = grid_of(shape_zyx)
            package = slice_package(
                folder / str(shape_zyx[0]),
                np.rint(sampled(field, grid)),
                grid.spacing_mm_zyx,
                extra="[pyramid]\ncoarsest_longest_axis = 1024\n",
                slices=f"layers = {layers}",
            )
            (function,) = package.manifest.transfer_functions
            media = [Medium(Volume(sampled(field, fine), fine), function)]
            truth = EMISSION_ABSORPTION.oracle(media, box_from_clip, shape_hw).rgba
            texels = slice_texels(package, "ramp", "z")
            drawn = stack_picture(texels, "z", grid, box_from_clip, shape_hw, "exact", layers)
            errors.append(rmse(drawn, truth))
        return Falling([1 / shape[0] for shape in shapes], errors)

    return falling


def _pictures() -> Iterator[Other]:
    """Pictures of other media, with every technique that converges to the picture of ray casting."""
    others = [each for each in TECHNIQUES.values() if each.order is None]
    for technique in others[1:]:
        drawn = Drawn(technique.name)
        yield Other(f"headlight, {technique.name}", "steps", 2.0, _lit("headlight", "texture3d", drawn=drawn))
        segments = _segments("mixed", "headlight", drawn=drawn)
        yield Other(f"segments, mixed, headlight, {technique.name}", "steps", 1.0, segments, 0.5)
        yield Other(f"two channels, {technique.name}", "steps", 2.0, _together("gles3", "packed", drawn))
        yield Other(f"colour, {technique.name}", "steps", 2.0, _colour("gles3", drawn))
    shaders = _lit("headlight", "texture3d", "central", Drawn(level=1))
    yield Other("headlight, gradients in the shader, level 1", "steps", 2.0, shaders)


OTHERS = (
    Other("headlight, texture3d", "steps", 2.0, _lit("headlight", "texture3d")),
    Other("headlight, mosaic", "steps", 2.0, _lit("headlight", "mosaic"), 0.5),
    Other("headlight, gradients in the shader", "steps", 2.0, _lit("headlight", "texture3d", "central")),
    Other("blinn-phong, texture3d", "steps", 1.0, _lit("blinn-phong", "texture3d")),
    # Segments are split at the faces of voxels: steps of up to a voxel are exact but for rounding.
    Other("labels, texture3d", "steps", 0.0, _labels("texture3d")),
    Other("labels, mosaic", "steps", 0.0, _labels("mosaic")),
    Other("segments, mixed, texture3d", "steps", 2.0, _segments("mixed")),
    Other("segments, crisp, texture3d", "steps", 1.0, _segments("crisp"), 0.5),
    # Normals jump where a cell between voxels of several labels ends.
    Other("segments, mixed, headlight, texture3d", "steps", 1.0, _segments("mixed", "headlight"), 0.5),
    Other("segments, crisp, headlight, texture3d", "steps", 1.0, _segments("crisp", "headlight"), 0.5),
    Other("segments, mixed, shadows, texture3d", "steps", 1.0, _segments("mixed", "phong", light=_SHADOWS), 0.5),
    Other("segments, mixed, maximum, texture3d", "steps", 0.0, _segments("mixed", compositing="maximum")),
    Other("segments, mixed, first-hit, texture3d", "steps", 0.0, _segments("mixed", compositing="first-hit")),
    Other("two channels, packed, texture3d", "steps", 2.0, _together("gles3", "packed")),
    Other("two channels, apart, texture3d", "steps", 2.0, _together("gles3", "apart")),
    Other("two channels, mosaic", "steps", 2.0, _together("gles2-2048", "auto"), 0.5),
    Other("two channels, two grids", "steps", 2.0, _on_two_grids),
    Other("colour, texture3d", "steps", 2.0, _colour("gles3")),
    Other("colour, mosaic", "steps", 2.0, _colour("gles2-2048")),
    Other("baked light", "cells of its field", 2.0, by_cell),
    Other("stacks of slices, along their axis", "grids", 2.0, _stacks("superior"), 0.5),
    Other("stacks of slices, oblique", "grids", 1.0, _stacks("anterior-left")),
    Other("stacks of slices in two layers, along their axis", "grids", 2.0, _stacks("superior", 2), 0.5),
    Other("stacks of slices in two layers, oblique", "grids", 1.0, _stacks("anterior-left", 2)),
    *_pictures(),
)
