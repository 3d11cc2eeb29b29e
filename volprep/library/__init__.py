"""volprep as a library: the functions that `import volprep` gives to a program or a notebook."""
