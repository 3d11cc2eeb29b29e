"""How the papers' tables are measured: packages of volumes, the truth, times and errors.

Packages and truths are made once for all papers of a run. Times are those of the whole picture; errors, of the same
picture with fewer pixels, because the truth in double precision takes much longer than any picture.
"""

import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from tests.benchmarks.drawing_time import best_ms, honest_clock, picture_ms
from tests.benchmarks.waking import is_software
from volprep.compositing import COMPOSITINGS
from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.render.slices import SliceRenderer
from volprep.scene.request import load_request
from volprep.techniques import TECHNIQUES
from volprep.truth.camera import Camera
from volprep.truth.decoded import light_of_scan
from volprep.truth.volume import Medium
from volprep.truth.volume import Volume as Field
from volprep.validation.timing.empty_space import counting
from volprep_formats.arrays import Float64Array, FloatArray
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.program import TechniqueName
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

from .record import Measured
from .volumes import Volume

Kept = TypeVar("Kept")
ALONE = "[pyramid]\ncoarsest_longest_axis = 100000\n"
"""A package of one level."""
TRUTH_PIXELS = 128
_ROUNDS = 2


@dataclass(frozen=True)
class View:
    """A camera, and the pixels of its picture."""

    camera: Camera
    """Where the viewer is."""
    shape_hw: tuple[int, int]
    """Height and width of the picture."""

    @property
    def aspect(self) -> float:
        """Width over height."""
        return self.shape_hw[1] / self.shape_hw[0]

    @property
    def small_hw(self) -> tuple[int, int]:
        """Height and width of the picture whose error is measured."""
        height, width = self.shape_hw
        share = min(1.0, TRUTH_PIXELS / max(height, width))
        return max(16, round(height * share)), max(16, round(width * share))


class Bench:
    """Makes packages and truths, and remembers them."""

    def __init__(self, folder: Path, *, quick: bool, driver: str = "", views: int = 0) -> None:
        """Keep files in `folder`; with `quick` each paper takes fewer and smaller pictures.

        Means are over so many `views` around a volume, or over the few of a whole run if that is 0.
        """
        self.quick = quick
        self.driver = driver
        self.views = views
        self._folder = folder
        self._truths: dict[str, Float64Array] = {}

    @property
    def software(self) -> bool:
        """Whether the driver draws with the processor."""
        return is_software(self.driver)

    def remembered(self, what: str, make: Callable[[], Kept]) -> Kept:
        """Return what an earlier run has made under these words, or make it and keep it for the next one."""
        path = self._folder / f"made-{_digest(what)}.pickle"
        if path.exists():
            kept: Kept = pickle.loads(path.read_bytes())  # noqa: S301 - our own, of the same code
            return kept
        made = make()
        path.with_suffix(".part").write_bytes(pickle.dumps(made))
        path.with_suffix(".part").rename(path)
        return made

    def package(
        self, volume: Volume, transfer: str, *, profile: str = "gles3", head: str = "", render: str = "", more: str = ""
    ) -> Package:
        """Build the package of a volume once; `transfer` is a preset or the rest of a [[transfer]] table.

        `head` are keys of the scene, `render` those of [render], `more` are tables.
        """
        look = transfer if "\n" in transfer or "=" in transfer else f'preset = "{transfer}"'
        text = (
            f'name = "paper"\nprofile = "{profile}"\n{head}\n[source]\npath = "{self._file(volume).name}"\n'
            f'[render]\n{render}\n{more}\n[[transfer]]\nname = "look"\n{look}\n[tolerance]\nrmse = 1.0\nmaximum = 1.0\n'
        )
        key = _digest(text)
        target = self._folder / f"{key}.volpkg"
        if not target.exists():
            scene = self._folder / f"{key}.toml"
            scene.write_text(text, encoding="utf-8")
            build(load_request(scene), target, Silent())
        return Package.open(target)

    def truth(self, package: Package, volume: Volume, view: View) -> Float64Array:
        """Return what a package of a volume should show, with few pixels."""
        manifest = package.manifest
        function, light = manifest.transfer_functions[0], light_of_scan(manifest)
        compositing = COMPOSITINGS[
            manifest.level_programs[0].compositing if manifest.programs else "emission-absorption"
        ]
        key = _digest(f"{volume.name} {function} {light} {compositing.name} {view}")
        path = self._folder / f"truth-{key}.npy"
        if key not in self._truths and path.exists():
            self._truths[key] = np.load(path)
        if key not in self._truths:
            grid = volume.info.grid
            field = Field(volume.stored, grid, volume.info.slope, volume.info.intercept, normals=light)
            camera = view.camera.box_from_clip(grid, view.aspect)
            self._truths[key] = compositing.oracle([Medium(field, function)], camera, view.small_hw).rgba
            np.save(path.with_suffix(".part.npy"), self._truths[key])
            path.with_suffix(".part.npy").rename(path)
        return self._truths[key]

    @contextmanager
    def renderer(self, package: Package, level: int = 0) -> Iterator[Renderer]:
        """Open the renderer of a level, and note the driver."""
        with ray_caster_of(package, level, None)(package, level=level) as renderer:
            self.driver = str(renderer.driver)
            yield renderer

    def measured(
        self, renderer: Renderer, package: Package, volume: Volume, view: View, step_mm: float | None = None
    ) -> Measured:
        """Time a picture and compare it with the truth of the volume."""
        camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
        ms = picture_ms(renderer, camera, view.shape_hw, step_mm, _ROUNDS)
        picture = renderer.render(camera, view.small_hw, step_mm)
        return Measured(ms, rmse(picture, self.truth(package, volume, view)))

    def slices(self, renderer: SliceRenderer, view: View, truth: Float64Array) -> Measured:
        """Time a picture of OpenGL ES 1.1 and compare it."""
        self.driver = str(renderer.driver)
        camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
        name = renderer.driver.renderer
        clock = honest_clock(name)
        ms = best_ms(name, lambda n: renderer.time_ms(camera, view.shape_hw, repeats=n, clock=clock), rounds=_ROUNDS)
        return Measured(ms, rmse(renderer.render(camera, view.small_hw), truth))

    def samples(self, renderer: Renderer, package: Package, view: View, step_mm: float | None = None) -> float:
        """Return how many samples a pixel takes on the average."""
        counted = counting(package, renderer.program)
        camera = view.camera.box_from_clip(renderer.level.grid, view.aspect)
        with type(renderer)(counted, level=renderer.level.index, target="rgba32f") as counter:
            return float(np.rint(counter.render(camera, view.small_hw, step_mm)[..., 0]).mean())

    def _file(self, volume: Volume) -> Path:
        path = self._folder / f"{_digest(volume.name)}.nrrd"
        if not path.exists():
            volume.write(path)
        return path


def techniques_of(sampling: str) -> tuple[TechniqueName, ...]:
    """Return every registered technique that reads the volume from this and blends or adds up light."""
    return tuple(
        each.name
        for each in TECHNIQUES.values()
        if sampling in each.samplings and "emission-absorption" in each.compositings
    )


def rmse(picture: FloatArray, truth: FloatArray) -> float:
    """Root mean square over all pixels and the four channels, premultiplied linear."""
    return float(np.sqrt(np.mean((picture.astype(np.float64) - truth) ** 2)))


def reason(error: VolprepError) -> str:
    """Say in a cell why there is no number."""
    return f"{error.code}"


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
