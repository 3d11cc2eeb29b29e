"""volprep as a library: the functions that `import volprep` offers to a program or a notebook."""
