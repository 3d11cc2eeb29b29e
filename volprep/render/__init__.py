"""The reference renderer: off-screen OpenGL ES that runs the shaders of a package."""
