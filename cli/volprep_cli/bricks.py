"""volprep bricks: levels as bricks with ghost voxels."""

from volprep_cli.stage import Draft, run_stage


def bricks(package: Draft) -> None:
    """Write each level as bricks in one texture, without empty bricks, if the scene has a table [bricks]."""
    run_stage(package, "bricks")
