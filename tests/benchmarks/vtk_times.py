"""How long VTK's GPU ray caster takes, and what it draws: python -m tests.benchmarks.vtk_times TASK.npz RESULT.npz.

It runs in a process of its own, as VTK closes the EGL display that it would share. The task is that of
volprep.vtk.volume_pictures, and has

- lit: 0 or 1; light comes from the viewer, all of it diffuse, with the gradient's direction as the normal
- rounds: how often each picture is drawn again, for its time; 0 for pictures alone

The result has pictures, uint8 [step, camera, H, W, 4], premultiplied linear, wall_ms and cpu_ms [step, camera], the
best of the rounds, and driver and version as there. VTK ends its rays early, at an opacity of 254/255. Voxels keep
their type: as bytes they are no slower than as floats.
"""

import sys
import time

import numpy as np
import pyvista
import vtkmodules.all as vtk

from volprep.vtk.volume_pictures import Task, draw_camera, driver_of, new_plotter, new_volume, window_of

from .waking import wake


def main(task_path: str, result_path: str) -> None:
    with np.load(task_path) as task:
        image = _image(task)
        pictures, walls, cpus = [], [], []
        for step_mm, entries in zip(task["steps_mm"], task["entries"], strict=True):
            plotter = new_plotter(int(task["picture_size"]))
            volume = new_volume(task, image, float(step_mm), int(entries))
            if int(task["lit"]):
                _light(plotter, volume)
            plotter.renderer.AddVolume(volume)
            cameras = range(len(task["height_mm"]))
            pictures.append([draw_camera(plotter, task, number) for number in cameras])
            times = [_times(plotter, task, number) for number in cameras]
            walls.append([wall for wall, _ in times])
            cpus.append([cpu for _, cpu in times])
            driver = driver_of(plotter)
            plotter.close()
    version = f"VTK {vtk.vtkVersion.GetVTKVersion()} through pyvista {pyvista.__version__}"
    np.savez(
        result_path, pictures=np.array(pictures), wall_ms=walls, cpu_ms=cpus, driver=np.array(driver), version=version
    )


def _image(task: Task) -> pyvista.ImageData:
    stored = np.load(str(task["scan"]))
    image = pyvista.ImageData(dimensions=np.add(stored.shape[::-1], 1), spacing=task["spacing_mm_zyx"][::-1])
    image.cell_data["value"] = stored.ravel()
    return image


def _light(plotter: pyvista.Plotter, volume: vtk.vtkVolume) -> None:
    properties = volume.GetProperty()
    properties.ShadeOn()
    properties.SetAmbient(0.0)
    properties.SetDiffuse(1.0)
    properties.SetSpecular(0.0)
    plotter.add_light(pyvista.Light(light_type="headlight"))


def _times(plotter: pyvista.Plotter, task: Task, number: int) -> tuple[float, float]:
    if not int(task["rounds"]):
        return 0.0, 0.0
    draw_camera(plotter, task, number)
    window = window_of(plotter)
    wake(driver_of(plotter)[1], lambda: (window.Render(), window.WaitForCompletion()))
    walls, cpus = [], []
    for _ in range(int(task["rounds"])):
        wall, cpu = time.perf_counter(), time.process_time()
        window.Render()
        window.WaitForCompletion()
        walls.append((time.perf_counter() - wall) * 1000)
        cpus.append((time.process_time() - cpu) * 1000)
    return min(walls), min(cpus)


if __name__ == "__main__":
    main(*sys.argv[1:])
