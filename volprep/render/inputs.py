"""Inputs of a program: its textures, and the values of its uniforms that do not change from picture to picture."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import Level
from volprep_formats.package.parts.light.environment import environment_of, environment_uniform
from volprep_formats.package.picture import AtMesh
from volprep_formats.package.program import PictureProgram, Program
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture

_WIDER = 1.01
"""Width of the view over the width of the volume, so that everything at the volume's border is in it."""


def light_from_box(light_mm: Float64Array, extent_mm_xyz: Float64Array) -> Float64Array:
    """Return the 4×4 matrix from box space to clip coordinates of a light's view that just holds the volume.

    The view looks at the place of the volume that is nearest to the light: all of the volume is then in front of it.
    Raises VP5040 for a light in the volume.
    """
    nearest = np.clip(light_mm, 0.0, extent_mm_xyz)
    distance = float(np.linalg.norm(nearest - light_mm))
    if not distance > 1e-6 * np.linalg.norm(extent_mm_xyz):
        raise VolprepError("VP5040", light=tuple(light_mm.round(3).tolist()))
    forward = (nearest - light_mm) / distance
    right = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(right, forward), forward])
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * extent_mm_xyz
    across = (corners - light_mm) @ rotation.T
    places = across[:, :2] / across[:, 2:]
    middle, half = (places.max(axis=0) + places.min(axis=0)) / 2, np.ptp(places, axis=0) / 2 * _WIDER
    near, far = distance / _WIDER, across[:, 2].max() * _WIDER
    depth = np.array([far + near, -2 * far * near]) / (far - near)
    seen = np.array(
        [
            [1 / half[0], 0.0, -middle[0] / half[0], 0.0],
            [0.0, 1 / half[1], -middle[1] / half[1], 0.0],
            [0.0, 0.0, *depth],
            [0.0, 0.0, 1.0, 0.0],
        ]
    )
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = rotation, -rotation @ light_mm
    return seen @ moved


@dataclass(frozen=True)
class Inputs:
    """A program with all of its inputs."""

    program: PictureProgram
    """The program, with its picture."""
    level: Level
    """The level that it draws."""
    textures: list[Texture]
    """Textures in the order of the program's samplers."""
    values: Mapping[str, ArrayLike]
    """Values by the `source` of a uniform."""
    step_mm: float
    """Nominal distance of the samples along a ray."""
    texels: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    """Texels by the name of a texture, for textures that are not read from the package."""
    at_mesh: AtMesh | None = None
    """The program whose rays begin at a mesh, and the mesh."""


Edit = Callable[[Package, Inputs], Inputs]
"""Changes the inputs of a program for a user's edit of a transfer function."""


def level_inputs(package: Package, level: int | None, picture: str | None) -> Inputs:
    """Choose what to draw: the finest level and the first picture unless others are named.

    Raises VP5018 if the package cannot draw that.
    """
    manifest = package.manifest
    found = next(
        (
            (one, drawing)
            for one, drawing in manifest.drawings
            if picture in {None, one.name} and level in {None, drawing.level} and drawing.program is not None
        ),
        None,
    )
    if found is None:
        known = "; ".join(f"level {', '.join(str(drawing.level) for drawing in one.drawings)} with {one.name}"
                          for one in manifest.pictures)  # fmt: skip
        raise undrawable(package, "any level" if level is None else f"level {level}", picture, known or "nothing")
    shown, drawing = found
    by_name = {texture.name: texture for texture in manifest.textures}
    drawn = next((level for level in manifest.levels if level.index == drawing.level), None)
    is_whole = by_name.keys() >= set(drawing.textures) and drawing.program in {
        program.name for program in manifest.programs
    }
    if drawing.program is None or drawing.step_mm is None or drawn is None or not is_whole:
        raise undrawable(package, f"level {drawing.level}", shown.name, "nothing: its program or a texture is missing")
    program = manifest.picture_program(drawing.program, shown)
    textures = [by_name[name] for name in drawing.textures]
    values: dict[str, ArrayLike] = {
        **{value.source: _number(value.numbers) for value in drawing.values},
        **light_values(program, drawn),
        **environment_values(textures),
    }
    return Inputs(program, drawn, textures, values, drawing.step_mm, at_mesh=drawing.at_mesh)


def _number(numbers: Sequence[float]) -> ArrayLike:
    """Return the value of a uniform: a number, a vector, or a matrix that is listed column by column."""
    if len(numbers) == 16:
        return np.array(numbers).reshape(4, 4).T
    return numbers if len(numbers) > 1 else numbers[0]


def light_values(program: Program, level: Level) -> dict[str, ArrayLike]:
    """Return the place of the program's light in box space, and its view; only a program with them asks for them."""
    if program.light is None:
        return {}
    grid = level.grid
    place = (np.linalg.inv(grid.world_from_box) @ [*program.light.place_mm_xyz, 1.0])[:3]
    if program.light.shadows not in {"map", "half-angle"}:
        return {"light_mm": place}
    seen = light_from_box(place, np.array(grid.extent_mm_zyx[::-1]))
    return {"light_mm": place, "light_from_box": seen, "box_from_light": np.linalg.inv(seen)}


def environment_values(textures: Sequence[Texture]) -> dict[str, ArrayLike]:
    """Return the light around the volume where an app may turn it; only a program with such light asks for it."""
    light = next((texture.light for texture in textures if texture.light is not None), None)
    if light is None or not light.model.turnable:
        return {}
    return {"environment": environment_uniform(environment_of(light.model))}


def undrawable(package: Package, wanted: str, transfer: str | None, known: str) -> VolprepError:
    """Return VP5018: a package that cannot draw `wanted`, with the choices that it has."""
    by = "any transfer function" if transfer is None else f"the transfer function {transfer}"
    return VolprepError("VP5018", package=package.path, level=wanted, transfer=by, known=known)
