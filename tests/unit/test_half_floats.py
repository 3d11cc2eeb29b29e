"""Shaders whose every operation is rounded to 16-bit floats: the text, and what it computes."""

import numpy as np
import pytest

from volprep.shading.half_floats import in_half_floats, with_half_coordinates

HEAD = "#version 300 es\nprecision highp float;\n"


def body(text: str, of=in_half_floats) -> str:
    """What becomes of the statements of a main function."""
    return of(f"{HEAD}void main() {{ {text} }}").split("void main() { ")[1].removesuffix(" }")


@pytest.mark.parametrize(
    ("text", "rounded"),
    [
        ("float a = b + c * d;", "float a = half_float(b + half_float(c * d));"),
        ("a = (b - c) / d;", "a = half_float((half_float(b - c)) / d);"),
        ("a -= b;", "a = half_float(a - (b));"),
        ("a.rgb *= exp(-b);", "a.rgb = half_float(a.rgb * (half_float(exp(-b))));"),
        ("return b > c + d ? e * f : -g;", "return b > half_float(c + d) ? half_float(e * f) : -g;"),
        (
            "vec2 a = m[2].xy + clamp(b, 0.5, c - 1.0);",
            "vec2 a = half_float(m[2].xy + clamp(b, 0.5, half_float(c - 1.0)));",
        ),
        (
            "for (float i = 0.5; i < n + 1.0; i++) { a += i; }",
            "for (float i = 0.5; i < n + 1.0; i++) { a = half_float(a + (i)); }",
        ),
        ("if (a + b > c) { break; } else { a++; }", "if (half_float(a + b) > c) { break; } else { a++; }"),
        ("const float a = 1.0 / 3.0;", "const float a = 1.0 / 3.0;"),
        ("// a + b\n  float c;", "// a + b\n  float c;"),
    ],
)
def test_each_operation_is_rounded(text, rounded):
    assert body(text) == rounded


def test_only_coordinates_are_rounded_where_that_is_asked():
    assert body("a = b * texture(t, c + d);", with_half_coordinates) == "a = b * texture(t, half_float(c + d));"


def test_a_shader_without_highp_is_none_of_ours():
    with pytest.raises(ValueError, match="highp"):
        in_half_floats("#version 100\nprecision mediump float;\nvoid main() {}\n")


@pytest.mark.parametrize("number", [0.1, 1 / 3, 1000.3, 65504.0, 6e-8, 3.1e-5, -7.77, 0.0, 2049.0])
def test_the_formula_of_the_rounding_is_that_of_half_floats(number):
    # What the shader computes, in float64; numbers halfway between two are rounded up, not to even.
    unit = 2.0 ** (np.floor(np.log2(np.clip(abs(number), 2.0**-14, 65504.0))) - 10)
    rounded = np.floor(number / unit + 0.5) * unit
    assert rounded == pytest.approx(float(np.float16(number)), abs=unit if number == 2049.0 else 0.0)
