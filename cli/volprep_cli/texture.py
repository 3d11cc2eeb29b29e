"""volprep texture: levels as 3D textures."""

from volprep_cli.stage import Draft, run_stage


def texture(package: Draft) -> None:
    """Write each level as a 3D texture, for a profile that has them."""
    run_stage(package, "texture")
