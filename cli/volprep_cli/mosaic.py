"""volprep mosaic: levels as mosaics, for devices without 3D textures."""

from volprep_cli.stage import Draft, run_stage


def mosaic(package: Draft) -> None:
    """Write the mosaics of the levels, for a profile without 3D textures."""
    run_stage(package, "mosaic")
