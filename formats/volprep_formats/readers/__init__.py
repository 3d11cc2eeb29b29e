"""Source formats, one file each. `open_source` finds the reader."""
