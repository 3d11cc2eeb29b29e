"""The reference renderer: draws a package with OpenGL ES, and reads nothing but the package.

What it runs is the text of the package's shaders, so that what is validated is what ships. It obeys the profile of the
package, whatever the driver at hand allows.
"""

from contextlib import ExitStack
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from volprep.render.block_inputs import block_inputs
from volprep.render.egl import Context, GlDriver
from volprep.render.gl import Bindings, Gl, LinkedProgram, PictureTarget, ShaderText, TargetFormat
from volprep.render.inputs import Edit, level_inputs
from volprep.render.limits import check_program, check_shader
from volprep.render.timing import median_ms
from volprep.render.turns import LoopLimit, step_mm_of_turns, turns_of_rays
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import Level
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2
from volprep_formats.textures.gl_formats import KTX2_FORMAT, texture_format

_DIMENSIONS = {"TEXTURE_2D": 2, "TEXTURE_3D": 3}
_STEP_CODES = ("VP5019", "VP5024")
_SAMPLERS = {"TEXTURE_2D": "sampler2D", "TEXTURE_3D": "sampler3D"}


class Renderer:
    """Draws one level of a package with one of its transfer functions. Use it as a context manager."""

    _has_depth = False

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

        `point` draws the sub-volumes around this point of the grid; `edit` changes the inputs as a user's edit does.
        Raises VP5018 where the package cannot draw that, VP5023 where it cannot be edited, VP5010 to VP5015 where it
        breaks a limit of its profile.
        """
        package = package_of_transfer(package, transfer)
        self._package = package
        self._target_format = target
        inputs = level_inputs(package, level, transfer) if point is None else block_inputs(package, point, transfer)
        if edit is not None:
            inputs = edit(package, inputs)
        check_program(inputs.program, inputs.textures, package.manifest)
        self._inputs = inputs
        self._program, self._level, self._textures = inputs.program, inputs.level, inputs.textures
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        """Open a context and upload everything.

        Raises VP5001 to VP5008 where the driver cannot do it, VP5016 and VP5017 for a package that contradicts itself.
        """
        with ExitStack() as stack:
            context = stack.enter_context(Context(self._package.manifest.profile.api))
            self._gl = Gl(context)
            stack.callback(self._gl.close)
            self._loop_limit = LoopLimit(self._gl)
            self._linked = stack.enter_context(self._gl.program(self._program.name, *self._shaders()))
            check_uniforms(self._program, self._textures, self._linked)
            self._handles = {
                sampler.name: (
                    texture.gl.target,
                    stack.enter_context(self._gl.texture(texture, *self._read_texture(texture))),
                )
                for sampler, texture in zip(self._program.samplers, self._textures, strict=True)
            }
            self._triangle = stack.enter_context(self._gl.triangle())
            self._target_stack = stack.enter_context(ExitStack())
            self._target: PictureTarget | None = None
            self._stack = stack.pop_all()
        return self

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
    def level(self) -> Level:
        """The level that is drawn."""
        return self._level

    @property
    def name(self) -> str:
        """What draws, in words."""
        return f"program {self._program.name}"

    @property
    def program(self) -> Program:
        """The program that draws."""
        return self._program

    def render(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None = None
    ) -> Float32Array:
        """Draw a picture as [H, W, 4], row 0 on top, premultiplied linear RGB and opacity.

        `box_from_clip` is 4×4, from homogeneous clip coordinates to box millimetres. `step_mm` is the distance of the
        samples; the package's own if absent. Raises VP5009 for an impossible size, VP5019 for an impossible step,
        VP5024 for one that takes more turns of a loop than the driver makes.
        """
        target = self._draw(box_from_clip, shape_hw, step_mm)
        return self._gl.read(target)

    def time_ms(
        self,
        box_from_clip: Float64Array,
        shape_hw: tuple[int, int],
        step_mm: float | None = None,
        repeats: int = 5,
    ) -> float:
        """Median of the milliseconds that drawing takes, over `repeats` pictures after one that is not counted.

        Drawing only: no upload, no reading back.
        """
        return median_ms(lambda: self._draw(box_from_clip, shape_hw, step_mm), self._gl.finish, repeats)

    def _draw(self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None) -> PictureTarget:
        step = self._step(step_mm)
        target = self._target_of(shape_hw)
        values = {
            "box_from_clip": box_from_clip,
            "step_mm": step,
            **self._inputs.values,
        }
        uniforms = {each.name: np.asarray(values[each.source], dtype=np.float32) for each in self._program.uniforms}
        self._gl.draw(self._linked, Bindings(self._handles, uniforms), target, self._triangle)
        return target

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
        if step_mm is None and manifest.render is not None:
            step_mm = manifest.render.step_mm
        if step_mm is None or not 0.0 < step_mm < float("inf"):
            raise VolprepError("VP5019", step_mm=step_mm, reason="it must be a positive number")
        finest = program.step_mm_min
        if finest is not None and step_mm < finest:
            reason = f"the shader's loop is long enough for {finest} mm and more"
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
                self._gl.target(self._target_format, shape_hw, depth=self._has_depth)
            )
        return self._target

    def _shaders(self) -> tuple[ShaderText, ShaderText]:
        profile = self._package.manifest.profile
        vertex, fragment = (
            ShaderText(path, self._package.read_text(path)) for path in (self._program.vertex, self._program.fragment)
        )
        for shader in (vertex, fragment):
            check_shader(shader.path, shader.text, profile)
        return vertex, fragment

    def _read_texture(self, texture: Texture) -> tuple[NDArray[np.generic], ...]:
        """Texels of all levels of the file, the finest first: one, unless it holds mipmaps."""
        if texture.name in self._inputs.texels:
            return (self._inputs.texels[texture.name],)
        image = ktx2.decode(self._package.read_bytes(texture.file), texture.file)
        name = texture_format(texture.gl, self._package.manifest.profile.api)
        shape_zyx = ktx2.mipmap_shape(image.shape_zyx, texture.mipmap or 0)
        found = (image.format, shape_zyx, image.dimensions)
        named = (name and KTX2_FORMAT[name], texture.shape_zyx, _DIMENSIONS[texture.gl.target])
        if found != named or (texture.mipmap or 0) >= len(image.levels):
            raise VolprepError("VP5016", path=texture.file, found=found, named=named)
        return image.levels


def check_uniforms(program: Program, textures: list[Texture], linked: LinkedProgram) -> None:
    """Raise VP5017 unless the manifest names exactly what is active in the program, with its types."""
    named: dict[str, str] = {uniform.name: uniform.type for uniform in program.uniforms}
    for sampler, texture in zip(program.samplers, textures, strict=True):
        named[sampler.name] = _SAMPLERS[texture.gl.target]
    if linked.uniforms != named:
        raise VolprepError("VP5017", name=program.name, named=_listed(named), found=_listed(linked.uniforms))


def _listed(uniforms: dict[str, str]) -> str:
    return ", ".join(f"{kind} {name}" for name, kind in sorted(uniforms.items()))
