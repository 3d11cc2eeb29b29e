"""Draws a package with the shaders that begin and end rays at its proxy geometry."""

from contextlib import ExitStack
from dataclasses import replace
from typing import Self

import numpy as np

from volprep.render.gl_records import TargetFormat
from volprep.render.inputs import Inputs, level_inputs
from volprep.render.layers import clip_from_box_of
from volprep.render.limits import check_program
from volprep.render.ready import Ready
from volprep.render.renderer import Renderer
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import Primitive, read_glb
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.proxy.record import UNITS, ProxyMeshFile
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.reader import Package

_MARGIN = float(UNITS)
"""Distance, one voxel in units, that the vertex shader moves vertices on the volume's border."""


class ProxyRenderer(Renderer):
    """Draws one level with one transfer function, whose rays begin and end at a mesh. Use it as a context manager.

    Where the near or the far plane cuts the volume, faces beyond it would be missing: such pictures are drawn without.
    """

    def __init__(
        self, package: Package, *, level: int | None = None, transfer: str | None = None, target: TargetFormat = "rgba8"
    ) -> None:
        """Choose what to draw, as `Renderer` does. Also raises VP5018 if the package has no mesh for it."""
        super().__init__(package, level=level, transfer=transfer, target=target)
        found = _found(self._package.manifest, self._inputs)
        if found is None:
            fields = {"level": self._level.index, "transfer": self._program.transfer, "known": "no mesh for them"}
            raise VolprepError("VP5018", package=self._package.path, **fields)
        self._mesh, self._from_mesh = found
        # Values that no pass of another program reads.
        values = {**self._inputs.values, "box_from_mesh": self._mesh.box_from_mesh_mm_xyz}
        self._inputs = replace(self._inputs, values=values)
        # The same textures; a program for diagnostic pictures may read fewer.
        read = dict(zip(self._program.samplers, self._textures, strict=True))
        self._mesh_textures = [read[name] for name in self._from_mesh.samplers]
        check_program(self._from_mesh, self._mesh_textures, self._package.manifest)

    def __enter__(self) -> Self:
        """Open a context and upload everything; raises the errors of `Renderer`, and VP4039 for a broken mesh."""
        super().__enter__()
        with ExitStack() as undo:
            undo.callback(self._stack.close)
            self._at_mesh = self._linked(self._stack, self._from_mesh, self._mesh_textures)
            self._at_mesh.mesh = [
                self._stack.enter_context(self._gl.mesh(part.positions_xyz, part.triangles))
                for part in _primitives(self._package, self._mesh)
            ]
            self._programs.append(self._at_mesh)
            undo.pop_all()
        return self

    @property
    def name(self) -> str:
        """Description of the renderer."""
        return f"program {self._from_mesh.name}"

    @property
    def program(self) -> PictureProgram:
        """The program that draws."""
        return self._from_mesh

    def _ready_for(self, box_from_clip: Float64Array) -> Ready:
        cut = _planes_cut(
            clip_from_box_of(box_from_clip), self._mesh, self._package.manifest.levels[0].grid.extent_mm_zyx
        )
        return self._ready if cut else self._at_mesh


def _planes_cut(clip_from_box: Float64Array, mesh: ProxyMeshFile, extent_mm_zyx: tuple[float, float, float]) -> bool:
    """Return whether part of the volume, with the vertex shader's margin, is beyond the near or the far plane."""
    margin = _MARGIN * np.array(mesh.box_from_mesh_mm_xyz)
    # The last voxel of a coarse level may reach beyond the true extent, by less than its size.
    ends = np.stack([-margin, np.array(extent_mm_zyx[::-1]) + 2 * margin])
    corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2], 1.0] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    clip = corners @ clip_from_box.T
    return bool((np.abs(clip[:, 2]) > clip[:, 3]).any())


def has_mesh(package: Package, level: int | None, transfer: str | None) -> bool:
    """Return whether the rays of `Renderer` may begin at a mesh. Raises VP5018 if it draws nothing."""
    package = package_of_transfer(package, transfer)
    return _found(package.manifest, level_inputs(package, level, transfer)) is not None


def _found(manifest: Manifest, inputs: Inputs) -> tuple[ProxyMeshFile, PictureProgram] | None:
    shown, at_mesh = manifest.picture(inputs.program.transfer), inputs.at_mesh
    if shown is None or at_mesh is None or manifest.proxy is None:
        return None
    mesh = next(mesh for mesh in manifest.proxy.meshes if mesh.name == at_mesh.mesh)
    return mesh, manifest.picture_program(at_mesh.program, shown)


def _primitives(package: Package, mesh: ProxyMeshFile) -> tuple[Primitive, ...]:
    if mesh.file is None:
        return ()
    return read_glb(package.read_bytes(mesh.file), mesh.file).primitives
