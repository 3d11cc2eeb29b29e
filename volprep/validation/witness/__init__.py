"""A second renderer that shares no code with ours: VTK's, drawing the scan itself."""
