"""Draws a volume with VTK's ray caster, in a process of its own: VTK closes the EGL display that we would share.

python vtk_views.py TASK.npz PICTURES.npy
"""

import sys

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy


def main(task_path: str, pictures_path: str) -> None:
    task = np.load(task_path)
    size = int(task["picture_size"])
    window, renderer = new_window(size)
    renderer.AddVolume(new_volume(task))
    pictures = []
    for eye, forward, up, height in zip(
        task["eye_mm_xyz"], task["forward"], task["up"], task["height_mm"], strict=True
    ):
        look(renderer.GetActiveCamera(), eye, forward, up, float(height))
        pictures.append(draw(window, size))
    np.save(pictures_path, np.stack(pictures))


def new_volume(task) -> vtk.vtkVolume:
    """The voxels at world positions, white, with an opacity for each millimetre at each integer value."""
    stored = np.ascontiguousarray(task["stored"])
    image = vtk.vtkImageData()
    image.SetDimensions(*stored.shape[::-1])
    image.SetSpacing(*task["spacing_mm_zyx"][::-1])
    image.GetPointData().SetScalars(numpy_to_vtk(stored.ravel()))
    # Not vtkFixedPointVolumeRayCastMapper: its opacities are 2 % too large here.
    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.SetSampleDistance(float(task["step_mm"]))
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetImageSampleDistance(1.0)
    mapper.UseJitteringOff()
    opacity = vtk.vtkPiecewiseFunction()
    for value, per_mm in enumerate(task["extinction_per_mm_by_value"]):
        opacity.AddPoint(value, 1.0 - np.exp(-per_mm))
    white = vtk.vtkColorTransferFunction()
    white.AddRGBPoint(0.0, 1.0, 1.0, 1.0)
    properties = vtk.vtkVolumeProperty()
    properties.SetInterpolationTypeToLinear()
    properties.SetScalarOpacityUnitDistance(1.0)
    properties.SetScalarOpacity(opacity)
    properties.SetColor(white)
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(properties)
    world_from_voxel0 = vtk.vtkMatrix4x4()
    for row in range(3):
        for column in range(3):
            world_from_voxel0.SetElement(row, column, task["direction"][row, column])
        world_from_voxel0.SetElement(row, 3, task["origin_mm_xyz"][row])
    volume.SetUserMatrix(world_from_voxel0)
    return volume


def new_window(size: int) -> tuple[vtk.vtkRenderWindow, vtk.vtkRenderer]:
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(0.0, 0.0, 0.0)
    window = vtk.vtkRenderWindow()
    window.OffScreenRenderingOn()
    window.SetMultiSamples(0)
    window.SetSize(size, size)
    window.AddRenderer(renderer)
    return window, renderer


def look(camera: vtk.vtkCamera, eye, forward, up, height: float) -> None:
    """Place a parallel camera whose picture is `height` millimetres high, as far from the middle as it is high."""
    camera.ParallelProjectionOn()
    camera.SetPosition(*eye)
    camera.SetFocalPoint(*(eye + forward / np.linalg.norm(forward) * height))
    camera.SetViewUp(*up)
    camera.SetParallelScale(height / 2)
    camera.SetClippingRange(1.0, 2 * height)


def draw(window: vtk.vtkRenderWindow, size: int) -> np.ndarray:
    """Opacity [H, W] from 0 to 1, row 0 on top: the volume is white on black."""
    window.Render()
    reader = vtk.vtkWindowToImageFilter()
    reader.SetInput(window)
    reader.ReadFrontBufferOff()
    reader.Update()
    pixels = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).reshape(size, size, -1)
    return pixels[::-1, :, 0] / 255.0


if __name__ == "__main__":
    main(*sys.argv[1:])
