"""Inputs of a program: its textures, and the values of its uniforms that do not change from picture to picture."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from volprep.render.light_view import light_from_box
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import Level
from volprep_formats.package.parts.light.environment import environment_of, environment_uniform
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package
from volprep_formats.package.sampled import sampled_textures
from volprep_formats.package.texture import Texture


@dataclass(frozen=True)
class Inputs:
    """A program with all of its inputs."""

    program: Program
    """The program."""
    level: Level
    """The level that it draws."""
    textures: list[Texture]
    """Textures in the order of the program's samplers."""
    values: Mapping[str, ArrayLike]
    """Values by the `source` of a uniform."""
    texels: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    """Texels by the name of a texture, for textures that are not read from the package."""


Edit = Callable[[Package, Inputs], Inputs]
"""Changes the inputs of a program for a user's edit of a transfer function."""


def level_inputs(package: Package, level: int | None, transfer: str | None) -> Inputs:
    """Choose what to draw: the finest level and the first transfer function unless others are named.

    Raises VP5018 if the package cannot draw that.
    """
    program = _find_program(package, level, transfer)
    found = _find_level(package, program, level)
    textures = find_textures(package, program, found.index)
    values: dict[str, ArrayLike] = {
        "texture_from_box": found.texture_from_box_per_mm_xyz,
        "blocks_from_box": _blocks_from_box(package, program, found.index),
        **light_values(program, found),
        **environment_values(textures),
        "mipmap": next((texture.mipmap for texture in textures if texture.mipmap is not None), 0),
    }
    return Inputs(program, found, textures, values)


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


def find_textures(package: Package, program: Program, level: int) -> list[Texture]:
    """Textures in the order of the program's samplers. Raises VP5018 if one is missing."""
    found = [texture for texture in sampled_textures(package.manifest, program, level) if texture is not None]
    if len(found) < len(program.samplers):
        raise undrawable(package, f"level {level}", program.transfer, "nothing: a texture is missing")
    return found


def undrawable(package: Package, wanted: str, transfer: str | None, known: str) -> VolprepError:
    """Return VP5018: a package that cannot draw `wanted`, with the choices that it has."""
    by = "any transfer function" if transfer is None else f"the transfer function {transfer}"
    return VolprepError("VP5018", package=package.path, level=wanted, transfer=by, known=known)


def _find_program(package: Package, level: int | None, transfer: str | None) -> Program:
    manifest = package.manifest
    for program in manifest.programs:
        if transfer in (None, program.transfer) and (level is None or level in program.levels):
            return program
    known = "; ".join(
        f"level {', '.join(str(each) for each in program.levels)} with {program.transfer}"
        for program in manifest.programs
    )
    raise undrawable(package, "any level" if level is None else f"level {level}", transfer, known or "nothing")


def _find_level(package: Package, program: Program, level: int | None) -> Level:
    index = min(program.levels, default=None) if level is None else level
    found = next((each for each in package.manifest.levels if each.index == index), None)
    if found is None:
        raise undrawable(package, f"level {index}", program.transfer, "nothing: the level is missing")
    return found


def _blocks_from_box(package: Package, program: Program, level: int) -> tuple[float, float, float]:
    tables = package.manifest.skipping.tables if package.manifest.skipping else ()
    table = next((each for each in tables if (each.transfer, each.level) == (program.transfer, level)), None)
    # Only a program that skips asks for it, and check_uniforms has checked whether it does.
    return (0.0, 0.0, 0.0) if table is None else table.blocks_from_box_per_mm_xyz
