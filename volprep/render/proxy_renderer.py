"""Draws a package with the shaders that begin rays at its proxy geometry."""

from contextlib import ExitStack
from typing import Self

import numpy as np

from volprep.render.gl import Bindings, PictureTarget, ShaderText, TargetFormat
from volprep.render.inputs import find_textures, level_inputs
from volprep.render.layers import clip_from_box_of
from volprep.render.limits import check_program, check_shader
from volprep.render.renderer import Renderer, check_uniforms
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import Primitive, read_glb
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.proxy.record import UNITS, Proxy, ProxyMeshFile
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package

_MARGIN = float(UNITS)
"""Distance, one voxel in units, that the vertex shader moves vertices on the volume's border."""


class ProxyRenderer(Renderer):
    """Draws one level with one transfer function, whose rays begin at a mesh. Use it as a context manager.

    Where the near plane cuts the volume, faces in front of it would be missing: such pictures are drawn without.
    """

    _has_depth = True

    def __init__(
        self,
        package: Package,
        *,
        level: int | None = None,
        transfer: str | None = None,
        target: TargetFormat = "rgba8",
    ) -> None:
        """Choose what to draw, as `Renderer` does. Also raises VP5018 if the package has no mesh for it."""
        super().__init__(package, level=level, transfer=transfer, target=target)
        found = _found(self._package.manifest, self._program.transfer, self._level.index)
        if found is None:
            fields = {"level": self._level.index, "transfer": self._program.transfer, "known": "no mesh for them"}
            raise VolprepError("VP5018", package=self._package.path, **fields)
        self._proxy, self._mesh, self._from_mesh = found
        textures = find_textures(self._package, self._from_mesh, self._level.index)
        check_program(self._from_mesh, textures, self._package.manifest)

    def __enter__(self) -> Self:
        """Open a context and upload everything; raises the errors of `Renderer`, and VP4039 for a broken mesh."""
        super().__enter__()
        with ExitStack() as undo:
            undo.callback(self._stack.close)
            manifest = self._package.manifest
            paths = (self._from_mesh.vertex, self._from_mesh.fragment, self._proxy.depth)
            vertex, fragment, depth = (ShaderText(path, self._package.read_text(path)) for path in paths)
            for shader in (vertex, fragment, depth):
                check_shader(shader.path, shader.text, manifest.profile)
            self._linked_mesh = self._stack.enter_context(self._gl.program(self._from_mesh.name, vertex, fragment))
            textures = find_textures(self._package, self._from_mesh, self._level.index)
            check_uniforms(self._from_mesh, textures, self._linked_mesh)
            self._linked_depth = self._stack.enter_context(self._gl.program("depth", vertex, depth))
            self._parts = [
                self._stack.enter_context(self._gl.mesh(part.positions_xyz, part.triangles))
                for part in _primitives(self._package, self._mesh)
            ]
            undo.pop_all()
        return self

    @property
    def name(self) -> str:
        """Description of the renderer."""
        return f"program {self._from_mesh.name}"

    @property
    def program(self) -> Program:
        """The program that draws."""
        return self._from_mesh

    def _draw(self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None) -> PictureTarget:
        clip_from_box = clip_from_box_of(box_from_clip)
        if _near_plane_cuts(clip_from_box, self._mesh, self._package.manifest.levels[0].grid.extent_mm_zyx):
            return super()._draw(box_from_clip, shape_hw, step_mm)
        target = self._target_of(shape_hw)
        values = {
            "box_from_clip": box_from_clip,
            "clip_from_box": clip_from_box,
            "box_from_mesh": self._mesh.box_from_mesh_mm_xyz,
            "step_mm": self._step(step_mm),
            **self._inputs.values,
        }
        uniforms = {each.name: np.asarray(values[each.source], np.float32) for each in self._from_mesh.uniforms}
        bindings = Bindings(self._handles, uniforms)
        self._gl.draw_mesh(self._linked_depth, self._linked_mesh, bindings, target, self._parts)
        return target


def _near_plane_cuts(
    clip_from_box: Float64Array, mesh: ProxyMeshFile, extent_mm_zyx: tuple[float, float, float]
) -> bool:
    """Return whether part of the volume, with the margin that the vertex shader adds, is in front of the near plane."""
    margin = _MARGIN * np.array(mesh.box_from_mesh_mm_xyz)
    # The last voxel of a coarse level may reach beyond the true extent, by less than its size.
    ends = np.stack([-margin, np.array(extent_mm_zyx[::-1]) + 2 * margin])
    corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2], 1.0] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    clip = corners @ clip_from_box.T
    return bool((clip[:, 2] < -clip[:, 3]).any())


def has_mesh(package: Package, level: int | None, transfer: str | None) -> bool:
    """Return whether the rays of `Renderer` may begin at a mesh. Raises VP5018 if it draws nothing."""
    package = package_of_transfer(package, transfer)
    inputs = level_inputs(package, level, transfer)
    return _found(package.manifest, inputs.program.transfer, inputs.level.index) is not None


def _found(manifest: Manifest, transfer: str, level: int) -> tuple[Proxy, ProxyMeshFile, Program] | None:
    proxy = manifest.proxy
    if proxy is None:
        return None
    meshes = [mesh for mesh in proxy.meshes if (mesh.transfer, mesh.level) == (transfer, level)]
    programs = [each for each in proxy.programs if each.transfer == transfer and level in each.levels]
    return (proxy, meshes[0], programs[0]) if meshes and programs else None


def _primitives(package: Package, mesh: ProxyMeshFile) -> tuple[Primitive, ...]:
    if mesh.file is None:
        return ()
    return read_glb(package.read_bytes(mesh.file), mesh.file).primitives
