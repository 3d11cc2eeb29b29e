"""Draw a volume with VTK's GPU ray caster, through pyvista: python -m volprep.vtk.volume_pictures TASK.npz RESULT.npz.

The task has

- scan: path of an .npy file, [z, y, x]; slope, intercept: physical = slope · stored + intercept
- spacing_mm_zyx, corner_mm_xyz, direction: box space to the world
- values, colours, extinctions_per_mm: the transfer function at ascending physical values, linear light
- blend: "composite" or "maximum"; reference_mm: length of the path whose opacity a maximum has
- steps_mm: distances of samples; entries: number of the function's samples for each of them
- eye_mm_xyz, forward, up, height_mm, focus_mm: the cameras, of shape [n] or [n, 3]; perspective: 0 or 1
- picture_size: width and height

The result has pictures, uint8 [step, camera, H, W, 4], premultiplied linear, row 0 on top, and driver: three strings,
and version: the versions of pyvista and VTK.

Voxels are VTK's cells, not its points: the volume is then the box of n voxels, with values at their centres, constant
in the outer half voxel, as in our conventions.
"""

import sys
from typing import Any

import numpy as np
import pyvista
import vtkmodules.all as vtk
from numpy.typing import NDArray

Task = Any  # numpy's archive has no type of its own


def main(task_path: str, result_path: str) -> None:
    """Draw all cameras with all steps."""
    with np.load(task_path) as task:
        image = new_image(task)
        pictures = []
        for step_mm, entries in zip(task["steps_mm"], task["entries"], strict=True):
            plotter = new_plotter(int(task["picture_size"]))
            plotter.renderer.AddVolume(new_volume(task, image, float(step_mm), int(entries)))
            pictures.append([draw_camera(plotter, task, number) for number in range(len(task["height_mm"]))])
            driver = driver_of(plotter)
            plotter.close()
    version = f"VTK {vtk.vtkVersion.GetVTKVersion()} through pyvista {pyvista.__version__}"
    np.savez(result_path, pictures=np.array(pictures), driver=driver, version=version)


def new_image(task: Task) -> pyvista.ImageData:
    """Make the image in box space, with physical values in float32."""
    stored = np.load(str(task["scan"]), mmap_mode="r")
    image = pyvista.ImageData(dimensions=np.add(stored.shape[::-1], 1), spacing=task["spacing_mm_zyx"][::-1])
    physical = np.empty(stored.shape, np.float32)
    for z, plane in enumerate(stored):
        physical[z] = float(task["slope"]) * plane.astype(np.float64) + float(task["intercept"])
    image.cell_data["value"] = physical.ravel()
    return image


def new_volume(task: Task, image: pyvista.ImageData, step_mm: float, entries: int) -> vtk.vtkVolume:
    """Make the volume in the world, with the transfer function at `entries` values."""
    # Not vtkFixedPointVolumeRayCastMapper: its opacities are 2 % too large here.
    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetSampleDistance(step_mm)
    mapper.SetImageSampleDistance(1.0)
    mapper.UseJitteringOff()
    maximum = str(task["blend"]) == "maximum"
    if maximum:
        mapper.SetBlendModeToMaximumIntensity()
    else:
        mapper.SetBlendModeToComposite()
    low, high = image.get_data_range("value")
    # Of a micrometre of a dense medium float32 tells the opacity, of a millimetre it rounds it to 1.
    path_mm = float(task["reference_mm"]) if maximum else step_mm
    colour, opacity = new_functions(task, np.linspace(low, max(high, np.nextafter(low, np.inf)), entries), path_mm)
    properties = vtk.vtkVolumeProperty()
    properties.SetInterpolationTypeToLinear()
    properties.SetScalarOpacityUnitDistance(step_mm)
    properties.SetScalarOpacity(opacity)
    properties.SetColor(colour)
    properties.ShadeOff()
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(properties)
    world_from_box = np.eye(4)
    world_from_box[:3, :3] = task["direction"]
    world_from_box[:3, 3] = task["corner_mm_xyz"]
    volume.SetUserMatrix(pyvista.vtkmatrix_from_array(world_from_box))
    return volume


def new_functions(
    task: Task, values: NDArray[np.float64], path_mm: float
) -> tuple[vtk.vtkColorTransferFunction, vtk.vtkPiecewiseFunction]:
    """Sample colours, and opacities of a path.

    Extinction is linear between control points, opacity is not: so many samples, not the control points alone.
    """
    opacities = -np.expm1(-np.interp(values, task["values"], task["extinctions_per_mm"]) * path_mm)
    colours = [np.interp(values, task["values"], channel) for channel in task["colours"].T]
    colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    opacity.BuildFunctionFromTable(values[0], values[-1], len(values), opacities.tolist())
    colour.BuildFunctionFromTable(values[0], values[-1], len(values), np.column_stack(colours).ravel().tolist())
    return colour, opacity


def new_plotter(size: int) -> pyvista.Plotter:
    """Open an off-screen window, with a transparent black background and no more than one sample for a pixel."""
    plotter = pyvista.Plotter(off_screen=True, window_size=[size, size], lighting="none")
    window_of(plotter).SetMultiSamples(0)
    window_of(plotter).SetAlphaBitPlanes(1)
    plotter.renderer.SetBackground(0.0, 0.0, 0.0)
    plotter.renderer.SetBackgroundAlpha(0.0)
    return plotter


def window_of(plotter: pyvista.Plotter) -> vtk.vtkRenderWindow:
    """Return the open window of a plotter."""
    window: vtk.vtkRenderWindow | None = plotter.render_window
    if window is None:
        msg = "the window is closed"
        raise RuntimeError(msg)
    return window


def draw_camera(plotter: pyvista.Plotter, task: Task, number: int) -> NDArray[np.uint8]:
    """Draw one picture [H, W, 4]."""
    eye, forward, up = (task[name][number] for name in ("eye_mm_xyz", "forward", "up"))
    height, focus = float(task["height_mm"][number]), float(task["focus_mm"][number])
    camera = plotter.renderer.GetActiveCamera()
    camera.SetPosition(*eye)
    camera.SetFocalPoint(*(eye + forward / np.linalg.norm(forward) * focus))
    camera.SetViewUp(*up)
    if int(task["perspective"]):
        camera.ParallelProjectionOff()
        camera.SetViewAngle(float(np.degrees(2 * np.arctan(height / 2 / focus))))
        camera.SetClippingRange(focus / 100, 2 * focus)
    else:
        camera.ParallelProjectionOn()
        camera.SetParallelScale(height / 2)
        camera.SetClippingRange(1e-6 * focus, 2 * focus)
    window_of(plotter).Render()
    reader = vtk.vtkWindowToImageFilter()
    reader.SetInput(window_of(plotter))
    reader.SetInputBufferTypeToRGBA()
    reader.ReadFrontBufferOff()
    reader.Update()
    size = int(task["picture_size"])
    pixels = np.asarray(pyvista.wrap(reader.GetOutput()).active_scalars).reshape(size, size, 4)
    return np.array(pixels[::-1], np.uint8)


def driver_of(plotter: pyvista.Plotter) -> list[str]:
    """Return vendor, renderer and version of the OpenGL that draws."""
    lines = dict(line.split(":", 1) for line in window_of(plotter).ReportCapabilities().splitlines() if ":" in line)
    return [lines.get(f"OpenGL {name} string", "").strip() for name in ("vendor", "renderer", "version")]


if __name__ == "__main__":
    main(*sys.argv[1:])
