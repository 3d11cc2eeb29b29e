"""The reference renderer: draws a package with OpenGL ES, and reads nothing but the package.

It runs the text of the package's shaders, so that exactly the shipped shaders are validated. It obeys the profile of
the package, even if the driver at hand allows more.
"""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from volprep.render.block_inputs import block_inputs
from volprep.render.box_lines import BoxLines
from volprep.render.egl import Context, GlDriver
from volprep.render.faces import face_corners
from volprep.render.gl import TRIANGLE, Gl
from volprep.render.gl_records import (
    Bindings,
    Corners,
    LinkedProgram,
    PicturePart,
    PictureTarget,
    ShaderText,
    TargetFormat,
)
from volprep.render.gpu_clock import gpu_clock
from volprep.render.half_angle import corners_of_layers, half_angle_layers
from volprep.render.inputs import Edit, level_inputs
from volprep.render.layers import clip_from_box_of, layer_corners, layers_of
from volprep.render.limits import check_program, check_shader
from volprep.render.overlay import Overlay, overlay
from volprep.render.ready import Ready
from volprep.render.timing import Clock, Spread, gpu_times, median_ms
from volprep.render.turns import LoopLimit, step_mm_of_turns, turns_of_rays
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import Level
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.program import Geometry, LightPass, Pass, PictureProgram, Uniform
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2
from volprep_formats.textures.texel_formats import Dimension

_DIMENSIONS: dict[Dimension, int] = {"2d": 2, "3d": 3}
_STEP_CODES = ("VP5019", "VP5024")
_FINER: tuple[TargetFormat, ...] = ("rgba8", "rgba16f", "rgba32f")
_INVOCATIONS = 64
"""Invocations in a group of a compute shader."""
_SAMPLERS: dict[Dimension, str] = {"2d": "sampler2D", "3d": "sampler3D"}


class Renderer:
    """Draws one level of a package with one of its transfer functions. Use it as a context manager."""

    def __init__(
        self,
        package: Package,
        *,
        level: int | None = None,
        transfer: str | None = None,
        target: TargetFormat = "rgba8",
        point: int | None = None,
        edit: Edit | None = None,
    ) -> None:
        """Choose what to draw: the finest level and the first transfer function unless others are named.

        `target` is the format of the picture, unless that of the program is finer.
        `point` draws the sub-volumes around this point of the grid; `edit` changes the inputs as a user's edit does.
        Raises VP5018 if the package cannot draw that, VP5023 if it cannot be edited, VP5010 to VP5015 if it
        breaks a limit of its profile.
        """
        package = package_of_transfer(package, transfer)
        self._package = package
        inputs = level_inputs(package, level, transfer) if point is None else block_inputs(package, point, transfer)
        if edit is not None:
            inputs = edit(package, inputs)
        check_program(inputs.program, inputs.textures, package.manifest)
        self._inputs = inputs
        self._program, self._level, self._textures = inputs.program, inputs.level, inputs.textures
        self._target_format = max(target, inputs.program.target, key=_FINER.index)
        self._stack = ExitStack()
        self._overlay: Overlay | None = None
        self._last: tuple[bytes, tuple[int, int], float | None] | None = None

    def __enter__(self) -> Self:
        """Open a context and upload everything.

        Raises VP5001 to VP5008 if the driver cannot do it, VP5016 and VP5017 for a package that contradicts itself.
        """
        with ExitStack() as stack:
            context = stack.enter_context(Context(self._package.manifest.profile.api))
            self._gl = Gl(context)
            stack.callback(self._gl.close)
            self._loop_limit = LoopLimit(self._gl)
            self._ready = self._linked(stack, self._program, self._textures)
            self._programs = [self._ready]
            self._overlay = None
            self._sorters: dict[str, LinkedProgram] = {}
            self._handles = {
                name: (texture.dimension, stack.enter_context(self._gl.texture(texture, *self._read_texture(texture))))
                for name, texture in zip(self._program.samplers, self._textures, strict=True)
            }
            self._triangle = stack.enter_context(self._gl.triangle())
            self._corners = stack.enter_context(self._gl.corners())
            self._target_stack = stack.enter_context(ExitStack())
            self._target: PictureTarget | None = None
            self._map_step_mm: float | None = None
            self._part_of: tuple[tuple[bytes, float], dict[str, ArrayLike]] | None = None
            self._stack = stack.pop_all()
        return self

    def _linked(self, stack: ExitStack, program: PictureProgram, textures: list[Texture]) -> Ready:
        """Link a program and its passes, until `stack` ends. Raises VP5005, VP5006, VP5015 and VP5017."""
        linked = stack.enter_context(self._gl.program(program.name, *self._shaders(program)))
        check_uniforms(program, textures, linked)
        return Ready(program, linked, [stack.enter_context(self._linked_pass(pass_)) for pass_ in program.passes])

    def _ready_for(self, box_from_clip: Float64Array) -> Ready:  # noqa: ARG002 - for renderers with several programs
        """Return the program that draws a view."""
        return self._ready

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Release everything."""
        self._stack.__exit__(kind, error, trace)

    @property
    def driver(self) -> GlDriver:
        """The driver that draws."""
        return self._gl.driver

    @property
    def package(self) -> Package:
        """The package, as one channel sees it."""
        return self._package

    @property
    def level(self) -> Level:
        """The level that is drawn."""
        return self._level

    @property
    def name(self) -> str:
        """Description of the renderer."""
        return f"program {self._program.name}"

    @property
    def program(self) -> PictureProgram:
        """The program that draws."""
        return self._program

    @property
    def uploaded_bytes(self) -> int:
        """Bytes of textures and meshes that were handed to the driver."""
        return self._gl.uploaded_bytes

    def render(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None = None
    ) -> Float32Array:
        """Draw a picture as [H, W, 4], row 0 on top, premultiplied linear RGB and opacity.

        `box_from_clip` is 4×4, from homogeneous clip coordinates to box millimetres. `step_mm` is the distance of the
        samples; that of the level if absent. Raises VP5009 for an impossible size, VP5019 for an impossible step,
        VP5024 for one that takes more turns of a loop than the driver makes.
        """
        target = self._draw(box_from_clip, shape_hw, step_mm)
        return self._gl.read(target)

    def render_with_lines(
        self,
        box_from_clip: Float64Array,
        shape_hw: tuple[int, int],
        small_hw: tuple[int, int],
        lines: Sequence[BoxLines],
        step_mm: float | None = None,
    ) -> Float32Array:
        """Draw lines at full size around a smaller picture: some lines behind the volume, others in front of it.

        Raises the errors of `render`.
        """
        small = self._draw(box_from_clip, small_hw, step_mm)
        if self._overlay is None:
            self._overlay = self._stack.enter_context(overlay(self._gl, self._package))
        with self._gl.target("rgba8", shape_hw) as target:
            self._overlay.draw(small, target, box_from_clip, lines)
            return self._gl.read(target)

    def time_ms(
        self,
        box_from_clip: Float64Array,
        shape_hw: tuple[int, int],
        step_mm: float | None = None,
        repeats: int = 5,
        clock: Clock = time.perf_counter,
        *,
        warm: bool = True,
    ) -> float:
        """Median of the milliseconds that drawing takes, over `repeats` pictures after one that is not counted.

        None is left out if the same picture was drawn last, or without `warm`. `clock` returns the time in seconds.

        Drawing only: no upload, no reading back.
        """
        has_drawn = not warm or self._last == (box_from_clip.tobytes(), shape_hw, step_mm)
        return median_ms(
            lambda: self._draw(box_from_clip, shape_hw, step_mm),
            self._gl.finish,
            repeats,
            has_drawn=has_drawn,
            clock=clock,
        )

    def gpu_times(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float, count: int
    ) -> Spread | None:
        """Return a timer that uses the driver's clock; None if it has none."""
        self._gl.finish()  # the clock belongs to this context, and another one may be current
        return gpu_times(lambda: self._draw(box_from_clip, shape_hw, step_mm), gpu_clock(self.driver), count)

    def _draw(self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None) -> PictureTarget:
        step = self._step(step_mm)
        target = self._target_of(shape_hw)
        ready = self._ready_for(box_from_clip)
        program = ready.program
        values = self._begun(ready, box_from_clip, step)
        self._last = box_from_clip.tobytes(), shape_hw, step_mm
        if program.slab_samples is not None:
            for _ in self._slabs(ready, target, values, step, program.slab_samples):
                pass
            return target
        if program.light_pass is not None:
            self._draw_half_angle(target, values, box_from_clip, step, program.light_pass)
            return target
        if program.geometry == "triangle":
            self._gl.draw(ready.linked, self._bindings(ready, program.uniforms, values), target, self._triangle)
            return target
        if program.blend is None:
            corners = self._faces(program.geometry, box_from_clip)
        else:
            layers = layers_of(program.geometry, self._extent_mm_xyz, box_from_clip, step)
            values |= {"box_from_slices": layers.box_from_slices, "slices": layers.count}
            in_order = program.blend.order == "front-to-back"
            places = layer_corners(program.geometry, layers, box_from_clip, front_to_back=in_order)
            corners = Corners(places, program.blend)
        bindings = self._bindings(ready, program.uniforms, values)
        self._gl.draw_corners(ready.linked, bindings, target, self._corners, corners)
        return target

    def _begun(self, ready: Ready, box_from_clip: Float64Array, step_mm: float) -> dict[str, ArrayLike]:
        """Draw the passes of a program, and return the values of its uniforms by their sources."""
        self._part_of = None
        values: dict[str, ArrayLike] = {"box_from_clip": box_from_clip, "step_mm": step_mm, **self._inputs.values}
        values["clip_from_box"] = clip_from_box_of(box_from_clip)
        for ready_pass, linked, drawn in zip(ready.program.before, ready.passes, ready.targets, strict=False):
            bindings = self._bindings(ready, ready_pass.uniforms, values).without(ready_pass.sampler)
            if ready_pass.geometry == "mesh":
                self._gl.draw_mesh(linked, bindings, drawn, ready.mesh)
            elif ready_pass.size is None:
                self._gl.draw_corners(
                    linked, bindings, drawn, self._corners, self._faces(ready_pass.geometry, box_from_clip)
                )
            elif self._map_step_mm != step_mm:
                # A shadow map is the same for every view.
                self._gl.draw(linked, bindings, drawn, self._triangle)
                self._map_step_mm = step_mm
        return values

    def _draw_half_angle(
        self,
        target: PictureTarget,
        values: Mapping[str, ArrayLike],
        box_from_clip: Float64Array,
        step_mm: float,
        light_pass: LightPass,
    ) -> None:
        """Draw each layer for the viewer, then for the light."""
        light_mm = np.asarray(values["light_mm"], np.float64)
        layers, behind = half_angle_layers(self._extent_mm_xyz, box_from_clip, light_mm, step_mm)
        seen = corners_of_layers(layers, box_from_clip)
        lit = corners_of_layers(layers, np.asarray(values["box_from_light"], np.float64))
        values = {**values, "box_from_slices": layers.box_from_slices, "slices": layers.count}
        ready = self._ready
        drawn, light = ready.targets[-1], ready.passes[-1]
        bindings = self._bindings(ready, ready.program.uniforms, values)
        # A pass must not read its own target.
        from_light = self._bindings(ready, light_pass.uniforms, values).without(light_pass.sampler)
        blend = light_pass.behind if behind else self._program.blend
        for number in range(layers.count):
            corners = Corners(seen[number], blend, clears=number == 0)
            if number == 0:
                nothing = Corners(lit[number][:0], light_pass.blend)
                self._gl.draw_corners(light, from_light, drawn, self._corners, nothing)
            self._gl.draw_corners(ready.linked, bindings, target, self._corners, corners)
            towards = Corners(lit[number], light_pass.blend, clears=False)
            self._gl.draw_corners(light, from_light, drawn, self._corners, towards)

    def draw(self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None = None) -> None:
        """Start drawing a picture, which `drawn` returns. Errors as `render`."""
        self._draw(box_from_clip, shape_hw, step_mm)

    def draw_part(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None, part: PicturePart
    ) -> None:
        """Draw a part of a picture, and keep the rest. Errors as `render`; VP5041 for a program with several draws.

        A pass over proxy geometry is drawn with the first part of a view.
        """
        step, target = self._step(step_mm), self._target_of(shape_hw)
        ready = self._ready_for(box_from_clip)
        program = ready.program
        over_mesh = [pass_.geometry == "mesh" for pass_ in program.passes]
        if program.geometry != "triangle" or program.slab_samples is not None or not all(over_mesh):
            raise VolprepError("VP5041", technique=program.technique)
        self._last = None
        view = box_from_clip.tobytes(), step
        if self._part_of is None or self._part_of[0] != view:
            self._part_of = view, self._begun(ready, box_from_clip, step)
        bindings = self._bindings(ready, program.uniforms, self._part_of[1])
        self._gl.draw(ready.linked, bindings, target, self._triangle, part)

    def drawn(self, shape_hw: tuple[int, int]) -> Float32Array:
        """Return the current state of the picture of this size."""
        return self._gl.read(self._target_of(shape_hw))

    def finish(self) -> None:
        """Wait until all drawing is finished."""
        self._gl.finish()

    @contextmanager
    def in_order(self, share: Float32Array) -> Iterator[None]:
        """Define the parts of a picture: the pixels of `share` [H, W] with the same number, from 0 to 1."""
        height, width = share.shape
        with self._gl.orders(self._target_of((height, width)), share):
            yield

    def sorted_tiles(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None
    ) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
        """Return the numbers of the tiles of a picture, cheapest first, and their costs. Rows begin at the lower left.

        In the order of their numbers without OpenGL ES 3.1, with equal costs.
        """
        tiles = self._program.tiles
        if tiles is None:
            raise VolprepError("VP5041", technique=self._program.technique)
        count = math.prod(-(-size // tiles.size) for size in shape_hw)
        if self.driver.version_number < (3, 1):
            return np.arange(count, dtype=np.uint32), np.zeros(count, np.uint32)
        height, width = shape_hw
        self._target_of(shape_hw)
        ready = self._ready_for(box_from_clip)
        tiles = ready.program.tiles or tiles
        values = self._begun(ready, box_from_clip, self._step(step_mm))
        values |= {"picture_width": width, "picture_height": height}
        paths = (tiles.cost, tiles.offsets, tiles.place)
        bindings = self._bindings(ready, tiles.uniforms, values)
        runs = -(-count // _INVOCATIONS)
        with ExitStack() as stack:
            buffers = [stack.enter_context(self._gl.numbers(size)) for size in (count, tiles.groups, count)]
            for path, groups in zip(paths, (runs, 1, runs), strict=True):
                self._gl.dispatch(self._sorter(path), bindings, buffers, groups)
            groups_of, found = (self._gl.read_numbers(buffer, count) for buffer in (buffers[0], buffers[2]))
        return found, groups_of[found]

    def _sorter(self, path: str) -> LinkedProgram:
        """Return a compute shader, linked once."""
        if path not in self._sorters:
            text = ShaderText(path, self._package.read_text(path))
            self._sorters[path] = self._stack.enter_context(self._gl.compute(path, text))
        return self._sorters[path]

    def draw_slabs(
        self,
        box_from_clip: Float64Array,
        shape_hw: tuple[int, int],
        step_mm: float | None = None,
        *,
        first_sample: float = 0.0,
    ) -> Iterator[float]:
        """Draw a picture slab by slab; yield the finished part after each, 1 at the end. `drawn` has the picture.

        Rays begin `first_sample` steps behind the face of the box that they enter. Errors as `render`; VP5041 for a
        program without slabs.
        """
        slab = self._program.slab_samples
        if slab is None:
            raise VolprepError("VP5041", technique=self._program.technique)
        step = self._step(step_mm)
        target = self._target_of(shape_hw)
        ready = self._ready_for(box_from_clip)
        values = self._begun(ready, box_from_clip, step)
        yield from self._slabs(ready, target, values, step, slab, first_sample)

    def _slabs(  # noqa: PLR0917 - a picture, and the part of it
        self,
        ready: Ready,
        target: PictureTarget,
        values: Mapping[str, ArrayLike],
        step_mm: float,
        slab: int,
        first_sample: float = 0.0,
    ) -> Iterator[float]:
        """Draw one slab after the other; yield the finished part of the whole."""
        samples = max(1, math.ceil(self.samples(step_mm) - first_sample))
        for first in range(0, samples, slab):
            program = ready.program
            bindings = self._bindings(ready, program.uniforms, {**values, "first_sample": first_sample + first})
            corners = Corners(TRIANGLE, program.blend, clears=first == 0)
            self._gl.draw_corners(ready.linked, bindings, target, self._corners, corners)
            yield min(1.0, (first + slab) / samples)

    @property
    def nominal_mm(self) -> float:
        """Distance of samples that the package asks for."""
        return self._inputs.step_mm

    def samples(self, step_mm: float) -> int:
        """Return the number of samples along the diagonal of the box: no ray takes more."""
        return math.ceil(float(np.linalg.norm(self._extent_mm_xyz)) / step_mm)

    def _faces(self, geometry: Geometry, box_from_clip: Float64Array) -> Corners:
        return Corners(face_corners(box_from_clip, self._extent_mm_xyz, front=geometry == "front-faces"))

    def _bindings(self, ready: Ready, uniforms: Sequence[Uniform], values: Mapping[str, ArrayLike]) -> Bindings:
        given = {uniform.name: np.asarray(values[uniform.source], dtype=np.float32) for uniform in uniforms}
        return Bindings({**self._handles, **ready.read}, given)

    @property
    def _extent_mm_xyz(self) -> Float64Array:
        return np.array(self._package.manifest.box.extent_mm_zyx[::-1])

    def draws_step(self, step_mm: float) -> bool:
        """Return whether rays can take samples so far apart. Call it in an open renderer."""
        try:
            self._step(step_mm)
        except VolprepError as error:
            if error.code not in _STEP_CODES:
                raise
            return False
        return True

    def _step(self, step_mm: float | None) -> float:
        manifest, program, level = self._package.manifest, self.program, self._level.index
        step_mm = self._inputs.step_mm if step_mm is None else step_mm
        if not 0.0 < step_mm < float("inf"):
            raise VolprepError("VP5019", step_mm=step_mm, reason="it must be a positive number")
        finest = program.step_mm_min
        if finest is not None and step_mm < finest:
            reason = f"the program draws {finest} mm and more"
            raise VolprepError("VP5019", step_mm=step_mm, reason=reason)
        turns = turns_of_rays(manifest, program, level, step_mm)
        made = self._loop_limit.made(turns)
        if made < turns:
            possible = step_mm_of_turns(manifest, program, level, made)
            fields = {"turns": f"{turns:.3g}", "made": made, "driver": self.driver, "possible": f"{possible:.3g}"}
            raise VolprepError("VP5024", step_mm=step_mm, **fields)
        return step_mm

    def _target_of(self, shape_hw: tuple[int, int]) -> PictureTarget:
        if self._target is None or self._target.shape_hw != shape_hw:
            self._target_stack.close()
            self._target = None
            self._target = self._target_stack.enter_context(
                self._gl.target(self._target_format, shape_hw, linear=self._target_format != "rgba32f")
            )
            self._map_step_mm = self._part_of = None
            for ready in self._programs:
                ready.targets = [self._pass_target(ready_pass, shape_hw) for ready_pass in ready.program.passes]
        return self._target

    def _pass_target(self, drawn: Pass, shape_hw: tuple[int, int]) -> PictureTarget:
        shape = shape_hw if drawn.size is None else (drawn.size, drawn.size)
        depth, linear = drawn.geometry == "mesh", isinstance(drawn, LightPass)
        return self._target_stack.enter_context(self._gl.target(drawn.target, shape, depth=depth, linear=linear))

    @contextmanager
    def _linked_pass(self, drawn: Pass) -> Iterator[LinkedProgram]:
        """Compile a pass that comes first. Raises VP5017 if its uniforms differ from the ones that it names."""
        with self._gl.program(drawn.fragment, *self._shaders(drawn)) as linked:
            named: dict[str, str] = {uniform.name: uniform.type for uniform in drawn.uniforms}
            read = zip(self._program.samplers, self._textures, strict=True)
            named |= {name: _SAMPLERS[texture.dimension] for name, texture in read if name in drawn.reads}
            _require_named(drawn.fragment, named, linked)
            yield linked

    def _shaders(self, program: PictureProgram | Pass) -> tuple[ShaderText, ShaderText]:
        profile = self._package.manifest.profile
        vertex, fragment = (
            ShaderText(path, self._package.read_text(path)) for path in (program.vertex, program.fragment)
        )
        for shader in (vertex, fragment):
            check_shader(shader.path, shader.text, profile)
        return vertex, fragment

    def _read_texture(self, texture: Texture) -> tuple[NDArray[np.generic], ...]:
        """Texels of all levels of the file, the finest first: one, unless it holds mipmaps."""
        if texture.name in self._inputs.texels:
            return (self._inputs.texels[texture.name],)
        image = ktx2.decode(self._package.read_bytes(texture.file), texture.file)
        shape_zyx = ktx2.mipmap_shape(image.shape_zyx, texture.mipmap or 0)
        found = (image.format, shape_zyx, image.dimensions)
        named = (texture.format, texture.shape_zyx, _DIMENSIONS[texture.dimension])
        if found != named or (texture.mipmap or 0) >= len(image.levels):
            raise VolprepError("VP5016", path=texture.file, found=found, named=named)
        return image.levels


def check_uniforms(program: PictureProgram, textures: list[Texture], linked: LinkedProgram) -> None:
    """Raise VP5017 unless the manifest names exactly the program's active uniforms, with their types."""
    named: dict[str, str] = {uniform.name: uniform.type for uniform in program.uniforms}
    for name, texture in zip(program.samplers, textures, strict=True):
        named[name] = _SAMPLERS[texture.dimension]
    named |= {pass_.sampler: "sampler2D" for pass_ in program.passes}
    _require_named(program.name, named, linked)


def _require_named(name: str, named: Mapping[str, str], linked: LinkedProgram) -> None:
    if linked.uniforms != named:
        raise VolprepError("VP5017", name=name, named=_listed(named), found=_listed(linked.uniforms))


def _listed(uniforms: Mapping[str, str]) -> str:
    return ", ".join(f"{kind} {name}" for name, kind in sorted(uniforms.items()))
