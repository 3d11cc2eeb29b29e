"""Steps of an app after its user has edited a transfer function: make new tables from data in the package.

The page spec/editing.md as code. The picture with the new tables is that of a package built
with the edited function.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.joint_histogram import level_table
from volprep.parts.mosaic.packing import pack_mosaic
from volprep.parts.skip.occupancy import occupied_blocks, threshold_per_mm
from volprep.parts.skip.tables import skip_table
from volprep.parts.skip.visible import entry_extinctions, entry_table
from volprep.render.inputs import Inputs
from volprep.scan.block_ranges import BlockRanges
from volprep.transfer.lookup import lookup_table, lookup_texels
from volprep.transfer.texel_forms import opaque_per_mm
from volprep_formats.arrays import Float64Array, Texels
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.parts.editing.record import decode_histogram
from volprep_formats.package.parts.light.environment import WHITE, environment_uniform
from volprep_formats.package.parts.light.record import StoredLight, form_of
from volprep_formats.package.parts.skip.record import Skipping
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.textures import ktx2
from volprep_formats.textures.mosaic import slices_of_mosaic


@dataclass(frozen=True)
class FunctionEdit:
    """The edit that draws a transfer function in place of the one of a program."""

    function: TransferFunction
    """The function."""

    def __call__(self, package: Package, inputs: Inputs) -> Inputs:
        """Return the inputs of the program after the edit."""
        return edited_inputs(package, inputs, self.function)


def edited_inputs(package: Package, inputs: Inputs, function: TransferFunction) -> Inputs:
    """Return the inputs of a program after an edit: `function` replaces the one that it draws.

    Raises VP5023 for a package whose transfer functions are not editable.
    """
    if package.manifest.editing is None:
        raise VolprepError("VP5023", path=package.path)
    compositing = COMPOSITINGS[inputs.program.compositing]
    if compositing.fixed_path:
        replaced = package.manifest.function(inputs.program.transfer)
        function = _of_path(function, replaced)
    textures = {texture.role: texture for texture in inputs.textures}
    table, skipping, lit = textures["transfer"], textures.get("skip"), textures.get("light")
    texels = {table.name: _table_texels(package, table, inputs.level.index, function)}
    if skipping is not None:
        entries = entry_table(entry_extinctions(table, texels[table.name][0]), _window(package), function)
        texels[skipping.name] = _skip_texels(package, skipping, compositing.visible(entries))
    if lit is not None and lit.light is not None:
        texels[lit.name] = _no_light(lit, lit.light)
    values = {**inputs.values}
    if "environment" in values:
        # The texels then hold a light of 1 from all sides.
        values["environment"] = environment_uniform(WHITE)
    return replace(inputs, texels={**inputs.texels, **texels}, values=values)


def _of_path(function: TransferFunction, replaced: TransferFunction) -> TransferFunction:
    """Return the function with the same opacities along the path that the shader knows, and the shader's isovalue."""
    ratio = function.reference_mm / replaced.reference_mm
    points = tuple(
        TransferPoint(value=point.value, colour=point.colour, extinction_per_mm=point.extinction_per_mm * ratio)
        for point in function.points
    )
    return TransferFunction(
        name=function.name, points=points, reference_mm=replaced.reference_mm, isovalue=replaced.isovalue
    )


def _window(package: Package) -> tuple[float, float]:
    if package.manifest.quantization is None:
        raise VolprepError("VP5023", path=package.path)
    return package.manifest.quantization.window


def _table_texels(package: Package, texture: Texture, level: int, function: TransferFunction) -> Texels:
    manifest = package.manifest
    if manifest.editing is None or manifest.step_mm is None or manifest.grid is None:
        raise VolprepError("VP5023", path=package.path)
    table = lookup_table(function, _window(package), texture.shape_zyx[2])
    for histogram in manifest.editing.histograms:
        if histogram.level == level:
            shares = decode_histogram(package.read_bytes(histogram.file), histogram.file)
            table = level_table(shares, table, histogram.reference_mm)
    if texture.max_extinction_per_mm is None:
        largest_per_mm = opaque_per_mm(manifest.step_mm, manifest.grid.extent_mm_zyx)
        return lookup_texels(table, "rgba16float", largest_per_mm).texels
    return lookup_texels(table, "rgba8unorm", texture.max_extinction_per_mm).texels


def _skip_texels(package: Package, texture: Texture, extinction_per_mm: Float64Array) -> Texels:
    skipping, grid = package.manifest.skipping or Skipping(), package.manifest.grid
    record = next(table for table in skipping.tables if table.texture == texture.name)
    found = next(
        (found for found in skipping.ranges if (found.level, found.block) == (record.level, record.block)), None
    )
    if found is None or grid is None:
        raise VolprepError("VP5023", path=package.path)
    ends = _slices(package, next(texture for texture in package.manifest.textures if texture.name == found.texture))
    low, high = np.split(ends.astype(np.float32) if ends.dtype == np.float16 else ends, 2)
    occupied = occupied_blocks(BlockRanges(low, high, found.block), extinction_per_mm, _threshold(skipping, grid))
    entries = skip_table(occupied, record.kind)
    if texture.mosaic is None:
        return entries
    strips = list(pack_mosaic(lambda z0, z1: entries[z0:z1], texture.mosaic))
    return np.concatenate(strips).reshape(texture.shape_zyx)


def _no_light(texture: Texture, light: StoredLight) -> Texels:
    """Return texels of a light of 1 everywhere: the light of the package is of another function."""
    code = min(round(255.0 * (1.0 + light.subtracted) / light.largest), 255)
    return np.full((*texture.shape_zyx, form_of(light.model).components), code, np.uint8)


def _threshold(skipping: Skipping, grid: Grid) -> float:
    return threshold_per_mm(skipping.epsilon, math.hypot(*grid.extent_mm_zyx))


def _slices(package: Package, texture: Texture) -> Texels:
    texels = ktx2.decode(package.read_bytes(texture.file), texture.file).data
    return texels if texture.mosaic is None else slices_of_mosaic([texels[0]], texture.mosaic)
