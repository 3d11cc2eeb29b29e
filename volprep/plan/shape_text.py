"""Shapes as text."""


def shape_text(shape_zyx: tuple[int, int, int]) -> str:
    """Write a shape in x, y, z order, for example "256×256×128"."""
    return "×".join(str(n) for n in reversed(shape_zyx))
