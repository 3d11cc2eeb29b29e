"""Draw panels of shapes with pyvista: python -m volprep.vtk.figure_pictures PANELS.npz RESULT.npy.

The result is a picture [H, W, RGB] in sRGB, the panels side by side, each `PIXELS` wide and high.
"""

import sys
from pathlib import Path

import numpy as np
import pyvista

from volprep.vtk.shapes import Panel, Points, Shape, Slice, Strokes, Surface, load_panels

PIXELS = 560
_FROM = np.array([0.75, -1.0, 0.45])
"""Position of the viewer, relative to the middle, in the patient's space: in front, to the left, above."""
_INK = "#22262b"


def main(task_path: str, result_path: str) -> None:
    """Draw all panels into one picture."""
    panels = load_panels(Path(task_path))
    plotter = pyvista.Plotter(
        shape=(1, len(panels)), off_screen=True, window_size=[PIXELS * len(panels), PIXELS], border=False
    )
    plotter.set_background("white")  # type: ignore[arg-type]  # its wrapper hides the types
    plotter.enable_anti_aliasing("ssaa")
    for number, panel in enumerate(panels):
        plotter.subplot(0, number)
        draw_panel(plotter, panel)
    np.save(result_path, np.asarray(plotter.screenshot(return_img=True), np.uint8)[..., :3])


def draw_panel(plotter: pyvista.Plotter, panel: Panel) -> None:
    """Add all shapes, and look at them from the patient's front, left and above."""
    for shape in panel.shapes:
        draw_shape(plotter, shape)
    plotter.add_text(panel.title, position="upper_edge", font_size=10, color=_INK)
    plotter.enable_parallel_projection()  # type: ignore[call-arg]  # its wrapper hides the types
    middle = np.array(panel.extent_mm_xyz) / 2
    diagonal = float(np.linalg.norm(panel.extent_mm_xyz))
    away = np.array(panel.direction).T @ (_FROM / np.linalg.norm(_FROM))
    plotter.camera.position = middle + away * 3 * diagonal
    plotter.camera.focal_point = middle
    plotter.camera.up = panel.direction[2]
    plotter.camera.parallel_scale = 0.56 * diagonal
    plotter.camera.clipping_range = (diagonal, 5 * diagonal)


def draw_shape(plotter: pyvista.Plotter, shape: Shape) -> None:
    """Add one shape."""
    if isinstance(shape, Surface):
        faces = np.insert(shape.faces, 0, shape.faces.shape[1], axis=1)
        mesh = pyvista.PolyData(shape.points_mm_xyz, faces.ravel())
        plotter.add_mesh(
            mesh,
            color=shape.colour,
            opacity=shape.opacity,
            ambient=0.4,
            show_edges=True,
            edge_color=_INK,
            line_width=0.6,
        )
    elif isinstance(shape, Strokes):
        segments = pyvista.line_segments_from_points(shape.ends_mm_xyz.reshape(-1, 3))
        plotter.add_mesh(segments, color=shape.colour, line_width=shape.width, render_lines_as_tubes=shape.width >= 4)
    elif isinstance(shape, Points):
        plotter.add_mesh(
            pyvista.PolyData(shape.points_mm_xyz),
            color=shape.colour,
            point_size=shape.size,
            render_points_as_spheres=True,
        )
    else:
        draw_slice(plotter, shape)


def draw_slice(plotter: pyvista.Plotter, shape: Slice) -> None:
    """Add a rectangle with the texels on it."""
    origin, row_end, column_end = shape.corners_mm_xyz
    points = np.array([origin, row_end, row_end + column_end - origin, column_end])
    mesh = pyvista.PolyData(points, np.array([4, 0, 1, 2, 3]))
    mesh.active_texture_coordinates = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    # VTK's textures begin at the lower left corner, pyvista's arrays on top.
    texture = pyvista.Texture(np.ascontiguousarray(shape.texels[::-1]))  # type: ignore[no-untyped-call]
    plotter.add_mesh(mesh, texture=texture, lighting=False)
    plotter.add_mesh(mesh, style="wireframe", color="#9aa0a6", line_width=0.8)


if __name__ == "__main__":
    main(*sys.argv[1:])
