"""Defects of volprep, and invalid calls of its functions: VP9xxx."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP9001 INTERNAL internal error: {error}
    This is a defect in volprep. Run again with VOLPREP_TRACEBACK=1 and report the output.
VP9010 USAGE the selection from the source is invalid: {problems}
    Give the keys and values of [source] in a scene; sample_specs/README.md lists them.
VP9011 MACHINE the volume needs {size} bytes of memory at once, more than is free
    Read a coarser level, or build a package, which takes the scan slab by slab.
""")
