"""volprep shaders: the shaders that this package needs."""

from volprep_cli.stage import Draft, run_stage


def shaders(package: Draft) -> None:
    """Write the shaders of the package, specialised for it."""
    run_stage(package, "shaders")
