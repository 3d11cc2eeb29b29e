"""Coarse levels of a package against box means, drawn by a foreign ray caster: VTK's fixed-point mapper on the CPU.

    volprep export PACKAGE scan.ome.zarr
    python -m tests.benchmarks.bench_foreign_levels PACKAGE scan.ome.zarr

VTK draws level 0, a coarse level of the store and the box mean of level 0 at the same places with the package's first
transfer function. Printed is the RMSE of RGB to VTK's picture of level 0 over the pixels that show something in it.
"""

import math
import sys
from pathlib import Path

import numpy as np
import vtk
import zarr
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from volprep_formats.package.reader import Package

SIZE = 256
VIEWS = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.6, -0.6, 0.5))


def box_mean(values, factors):
    """Mean of the voxels that each coarse voxel covers; the last ones of an odd axis cover fewer."""
    padding = [(0, -n % f) for n, f in zip(values.shape, factors, strict=True)]
    padded = np.pad(values.astype(np.float64), padding, constant_values=np.nan)
    z, y, x = (n // f for n, f in zip(padded.shape, factors, strict=True))
    return np.nanmean(padded.reshape(z, factors[0], y, factors[1], x, factors[2]), axis=(1, 3, 5))


def volume(values, scale, translation, function):
    image = vtk.vtkImageData()
    image.SetDimensions(*values.shape[::-1])
    image.SetSpacing(*scale[::-1])
    image.SetOrigin(*translation[::-1])
    image.GetPointData().SetScalars(numpy_to_vtk(values.astype(np.float32).ravel(), deep=True))
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetSampleDistance(0.5)
    colours, opacities = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    for point in function.points:
        colours.AddRGBPoint(point.value, *point.colour)
        opacities.AddPoint(point.value, 1.0 - math.exp(-point.extinction_per_mm))
    drawn = vtk.vtkVolume()
    drawn.SetMapper(mapper)
    drawn.GetProperty().SetColor(colours)
    drawn.GetProperty().SetScalarOpacity(opacities)
    drawn.GetProperty().SetScalarOpacityUnitDistance(1.0)
    drawn.GetProperty().SetInterpolationTypeToLinear()
    return drawn


def picture(drawn, centre, extent, view):
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(SIZE, SIZE)
    window.AddRenderer(renderer)
    renderer.AddVolume(drawn)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetParallelScale(0.6 * extent)
    camera.SetFocalPoint(*centre)
    camera.SetPosition(*(centre + 3.0 * extent * np.array(view)))
    camera.SetViewUp(0.0, 0.0, 1.0)
    renderer.ResetCameraClippingRange()
    window.Render()
    grabber = vtk.vtkWindowToImageFilter()
    grabber.SetInput(window)
    grabber.ReadFrontBufferOff()
    grabber.Update()
    return vtk_to_numpy(grabber.GetOutput().GetPointData().GetScalars())[:, :3] / 255.0


def main(package, store):
    function = Package.open(Path(package)).manifest.transfer_functions[0]
    group = zarr.open_group(store, mode="r")
    levels = []
    for told in group.attrs["ome"]["multiscales"][0]["datasets"]:
        scale, translation = told["coordinateTransformations"]
        levels.append((told["path"], group[told["path"]][...], scale["scale"], translation["translation"]))
    _, finest, spacing, origin = levels[0]
    lengths = np.array(finest.shape) * spacing
    centre, extent = (np.array(origin) + lengths / 2)[::-1], float(lengths.max())
    truth = [picture(volume(finest, spacing, origin, function), centre, extent, view) for view in VIEWS]
    for name, values, scale, translation in levels[1:]:
        factors = [round(a / b) for a, b in zip(scale, spacing, strict=True)]
        for kind, voxels in (("package", values), ("box mean", box_mean(finest, factors))):
            drawn = volume(voxels, scale, translation, function)
            errors = []
            for view, expected in zip(VIEWS, truth, strict=True):
                seen = expected.any(axis=1)
                found = picture(drawn, centre, extent, view)
                errors.append(math.sqrt(np.mean((found - expected)[seen] ** 2)))
            print(f"level {name}, {kind}: RMSE {' '.join(f'{error:.4f}' for error in errors)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
