"""Decode a package as an app does: the values of a level, and the transfer function of a lookup table.

Everything comes from the texture files, nothing from the scan, so that the oracle can separate the error of the data
and of the table from the renderer's.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from volprep.truth.lit import BakedField, Lit, Normals, ShaderSlopes
from volprep.truth.normal_codes import interpolated
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float32Array, Float64Array, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import Quantization
from volprep_formats.package.integral_table import IntegralTable
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.palette import Palette
from volprep_formats.package.parts.light.environment import environment_of, shares_of, turned
from volprep_formats.package.parts.light.record import form_of, two_colours
from volprep_formats.package.parts.normals.record import SOFT_SLOPE, GradientKernel, halved_axes
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package
from volprep_formats.package.tables import table_for
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.textures import ktx2
from volprep_formats.textures.mosaic import slices_of_mosaic

_ROOT_STEP = 0.002


def light_of_scan(manifest: Manifest) -> Normals:
    """Return the scan's lighting to match the programs: unquantised gradients; None if they are unlit."""
    lit = next((program for program in manifest.programs if program.lighting != "none"), None)
    return None if lit is None else light_of_program(manifest, lit)


def light_of_program(manifest: Manifest, lit: Program) -> Normals:
    """Return the scan's lighting to match one program."""
    if lit.normals_from == "volume":
        kernel = _kernel(manifest)
        return kernel if lit.light is None else Lit(kernel, lit.light, lit.lighting == "blinn-phong")
    return _slopes(manifest, lit)


def _kernel(manifest: Manifest) -> GradientKernel:
    """Return the gradient kernel of the normals. Raises VP4072 for one that this volprep does not know."""
    word = next(texture.normals.kernel for texture in manifest.textures if texture.normals is not None)
    known: tuple[GradientKernel, ...] = get_args(GradientKernel)
    found = next((kernel for kernel in known if kernel == word), None)
    if found is None:
        raise VolprepError("VP4072", path=manifest.name, what="gradient kernel", word=word, known=", ".join(known))
    return found


def _slopes(manifest: Manifest, lit: Program) -> Lit:
    if manifest.quantization is None or manifest.grid is None or lit.normals_from == "volume":
        msg = "a shader takes gradients of codes on a grid"
        raise ValueError(msg)
    low, high = manifest.quantization.window
    soft_per_mm = SOFT_SLOPE * abs(high - low) / min(manifest.grid.spacing_mm_zyx)
    return Lit(ShaderSlopes(lit.normals_from, soft_per_mm, abs(high - low)), lit.light, lit.lighting == "blinn-phong")


def light_at_level(manifest: Manifest, light: Normals, factors_zyx: tuple[int, int, int]) -> Normals:
    """Return the scan's lighting as programs of the package take it at a level with these factors."""
    slopes = light.normals if isinstance(light, Lit) else None
    if not isinstance(light, Lit) or not isinstance(slopes, ShaderSlopes) or slopes.kernel != "central":
        return light
    if manifest.segments is not None:
        return light
    return replace(light, normals=replace(slopes, halved_zyx=halved_axes(factors_zyx)))


def level_volume(package: Package, level: int) -> Volume:
    """Decode the texture of `level`: slices taken out of their mosaic, stored values as the manifest maps them."""
    manifest = package.manifest
    texels = level_texels(package, level)
    quantization = _quantization(package)
    grid = manifest.level(level).grid
    # Half floats hold normalised stored values; integers hold the stored values themselves.
    scale = _largest_code(quantization) if texels.dtype.kind == "f" else 1.0
    stored = texels.astype(np.float32) if texels.dtype.kind == "f" else texels
    return Volume(
        np.ascontiguousarray(stored),
        grid,
        quantization.slope * scale,
        quantization.intercept,
        manifest.holds_labels,
        _light_of_level(package, level),
    )


def _light_of_level(package: Package, level: int) -> Normals:
    """Return the lighting of a level: its own normals, or the scan's lighting if the shader computes normals."""
    scan = light_of_scan(package.manifest)
    if scan is None or (isinstance(scan, Lit) and isinstance(scan.normals, ShaderSlopes)):
        factors_zyx = package.manifest.level(level).factors_zyx
        return light_at_level(package.manifest, scan, factors_zyx)
    held = _level_normals(package, level)
    return replace(scan, normals=held) if isinstance(scan, Lit) else held


def _level_normals(package: Package, level: int) -> Float32Array:
    """Decode the normals of `level`, as long as their codes make them."""
    textures = package.manifest.textures_of("normals", level=level)
    code = next(texture.normals.code for texture in textures if texture.normals is not None)
    octets = np.asarray(level_texels(package, level, "normals"), np.uint8)
    return np.ascontiguousarray(interpolated(octets, code))


def baked_fields(package: Package, turn: Float64Array | None = None, *, cut: bool = False) -> dict[str, BakedField]:
    """Decode the precomputed light, by the name of its transfer function: of the whole volume, or of the `cut` one.

    The rotation `turn` [3, 3] of the patient's space turns light that apps may turn.
    """
    return {
        transfer: _baked_field(package, texture, turn)
        for transfer, texture in package.manifest.lights(cut=cut).items()
        if transfer is not None
    }


def _baked_field(package: Package, texture: Texture, turn: Float64Array | None) -> BakedField:
    light = texture.light
    grid = package.manifest.grid
    if light is None or grid is None:
        raise VolprepError("VP4011", path=package.path, problem="a sealed package without a grid, or light without one")
    halves = form_of(light.model).ends
    ends = light.largest * _light_codes(package, texture, halves).astype(np.float64) / 255.0 - light.subtracted
    if light.model.turnable:
        environment = environment_of(light.model)
        ends = ends @ shares_of(environment if turn is None else turned(environment, turn))
    elif light.first_colour is not None:
        ends = ends @ two_colours(light.first_colour)
    texels = np.stack([ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]], axis=-2)
    quantization = _quantization(package)
    scale = quantization.slope * _largest_code(quantization)
    curve = np.array([[scale * value + quantization.intercept for value in light.stored_values], [0.0, 1.0]])
    slices_xyz = (*texels.shape[2:0:-1], texels.shape[0] * halves)
    x, y, z = (per * n for per, n in zip(light.texture_from_box_per_mm_xyz, slices_xyz, strict=True))
    left, back, head = grid.corner_mm_xyz.tolist()
    return BakedField(np.ascontiguousarray(texels, np.float32), curve, (x, y, z), (left, back, head))


def _light_codes(package: Package, texture: Texture, halves: int) -> UInt8Array:
    """Return the codes of a light [z, y, x, 2, numbers], of both ends."""
    texels = ktx2.decode(package.read_bytes(texture.file), texture.file).data
    slices = np.asarray(texels if texture.mosaic is None else slices_of_mosaic([texels[0]], texture.mosaic), np.uint8)
    if halves > 1:
        return np.stack(np.split(slices, halves), axis=3)
    return slices.reshape(*slices.shape[:3], 2, -1)


def own_table(package: Package, transfer: str, level: int) -> bool:
    """Return whether `level` has a table of its own for `transfer`."""
    return any(
        texture is not None and texture.level is not None
        for role in ("transfer", "preintegrated")
        for texture in [table_for(package.manifest.textures, role, transfer, level)]
    )


def table_function(
    package: Package, transfer: str, level: int = 0, edited: Mapping[str, NDArray[np.generic]] | None = None
) -> TransferFunction:
    """Return the transfer function that the lookup table or palette of `transfer` represents, tables filtered linearly.

    `level` may have a table of its own. Texels of an `edited` table, by its name, replace the package's. A
    pre-integrated table represents the function itself; a level's own one represents the means between its entries,
    with a jump at each.

    8-bit tables hold the square root of the extinction, so that it is a parabola between two entries. Here it is cut
    into straight pieces that miss it by at most a millionth of the largest extinction.
    """
    manifest = package.manifest
    function = manifest.function(transfer)
    palette = manifest.palette_of.get(transfer)
    if palette is not None:
        return _palette_function(palette, _quantization(package).window, function)
    texture = table_for(manifest.textures, "transfer", transfer, level)
    integrals = table_for(manifest.textures, "preintegrated", transfer, level)
    if integrals is not None and integrals.level is not None:
        texture = integrals
    if texture is None:
        return function
    texels = (edited or {}).get(texture.name)
    if texels is None:
        texels = ktx2.decode(package.read_bytes(texture.file), texture.file).data
    quantization = _quantization(package)
    if texture.role == "preintegrated":
        scale = quantization.slope * _largest_code(quantization)
        low, high = (scale * value + quantization.intercept for value in texture.stored_range or (0.0, 1.0))
        table = IntegralTable.of_texels(texels, (low, high), texture.max_extinction_per_mm or 0.0)
        return _function(function, *table.steps)
    entries = texels.reshape(texture.shape_zyx[2], 4)
    if entries.dtype.kind != "f":
        values, colours, extinctions = _from_roots(entries, texture)
    else:
        media = entries.astype(np.float64)
        _check_entries(package, texture, media)
        values = np.linspace(0.0, 1.0, len(entries))
        colours, extinctions = media[:, :3], media[:, 3]
    physical = quantization.slope * values * _largest_code(quantization) + quantization.intercept
    return _function(function, physical, colours, extinctions)


def _function(
    function: TransferFunction, values: Float64Array, colours: Float64Array, extinctions: Float64Array
) -> TransferFunction:
    """Return a transfer function with other points."""
    points = zip(values.tolist(), colours.tolist(), extinctions.tolist(), strict=True)
    return TransferFunction(
        name=function.name,
        reference_mm=function.reference_mm,
        isovalue=function.isovalue,
        intensities=function.intensity_range,
        points=tuple(
            TransferPoint(value=value, colour=(red, green, blue), extinction_per_mm=extinction)
            for value, (red, green, blue), extinction in points
        ),
    )


def _check_entries(package: Package, texture: Texture, media: Float64Array) -> None:
    """Raise VP4011 for entries of a table of floats that are no colour and no extinction."""
    wrong = ~np.isfinite(media) | (media < 0.0)
    wrong[..., :3] |= media[..., :3] > 1.0
    if wrong.any():
        entry = int(np.argwhere(wrong)[0][0])
        shown = ", ".join(f"{number:.6g}" for number in media[entry])
        problem = f"entry {entry} of {texture.file} is {shown}: no colour from 0 to 1, or no extinction"
        raise VolprepError("VP4011", path=package.path, problem=problem)


def _palette_function(palette: Palette, window: tuple[float, float], whole: TransferFunction) -> TransferFunction:
    """Steps of the function `whole`: each entry is for the values nearest to it."""
    low, high = window
    last = len(palette.entries) - 1
    points = []
    for index, entry in enumerate(palette.entries):
        ends = [low + (index + side) / last * (high - low) for side in (-0.5, 0.5)]
        points += [
            TransferPoint(value=value, colour=entry.colour, extinction_per_mm=entry.extinction_per_mm) for value in ends
        ]
    return TransferFunction(
        name=palette.transfer,
        reference_mm=whole.reference_mm,
        isovalue=whole.isovalue,
        intensities=whole.intensity_range,
        points=tuple(points),
    )


def _from_roots(entries: NDArray[np.generic], texture: Texture) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return normalised values, colours and extinctions at the entries, and between them where the roots differ."""
    colours_and_roots = entries.astype(np.float64) / 255.0
    at_entries = np.linspace(0.0, 1.0, len(entries))
    # A chord of the square of a root that changes by d misses it by d²/4 at most: 0.002 gives a millionth.
    pieces = np.maximum(np.ceil(np.abs(np.diff(colours_and_roots[:, 3])) / _ROOT_STEP), 1).astype(int)
    between = [
        np.linspace(low, high, n, endpoint=False) for (low, high), n in zip(pairwise(at_entries), pieces, strict=True)
    ]
    values = np.concatenate([*between, at_entries[-1:]])
    fine = np.column_stack([np.interp(values, at_entries, channel) for channel in colours_and_roots.T])
    return values, fine[:, :3], (texture.max_extinction_per_mm or 0.0) * fine[:, 3] ** 2


def _quantization(package: Package) -> Quantization:
    quantization = package.manifest.quantization
    if quantization is None:
        raise VolprepError("VP4011", path=package.path, problem="a sealed package without a quantization")
    return quantization


def _largest_code(quantization: Quantization) -> float:
    return float(2**quantization.bits - 1)
