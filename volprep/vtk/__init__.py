"""Drawing with VTK through pyvista, in processes of their own: VTK closes the EGL display that it would share."""
