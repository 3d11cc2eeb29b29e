"""Bugs of the oracle: the truth itself is wrong."""

from .mutant import Mutant

_ORACLE = "volprep/native/include/volprep/oracle"

OF_TRUTH = (
    Mutant(
        "mida-turns",
        "a rise to a maximum within a cell is left out where no control point lies in it",
        "volprep/native/src/oracle_refined.cpp",
        "        visit_monotone(path, parts.cuts, visit);",
        "        visit_media(path, parts.cuts, visit);",
        "mida",
        ("tests/truth/test_mida_picture.py::test_a_rise_counts_where_no_control_point_lies_in_its_cell",),
    ),
    Mutant(
        "cubic-term",
        "the field along a ray in a cell is a parabola",
        f"{_ORACLE}/walk.hpp",
        "plane[0][2] + step2 * middle[2] + step1 * half[2], step2 * half[2]};",
        "plane[0][2] + step2 * middle[2] + step1 * half[2], 0.0};",
        "nifti",
        ("tests/truth/test_oracle_twin.py::test_random_rays_agree_within_the_bound",),
    ),
    Mutant(
        "pixel-corner",
        "rays of the truth go through corners of pixels",
        f"{_ORACLE}/frame.hpp",
        "static_cast<long double>(2 * column + 1)",
        "static_cast<long double>(2 * column)",
        "nifti",
        ("tests/truth/test_oracle_picture.py::test_pixels_are_sampled_at_their_centres",),
    ),
    Mutant(
        "outer-half",
        "the truth has no outer half voxel",
        f"{_ORACLE}/walk.hpp",
        "ray.origin_mm[axis] / spacing - (field.nearest ? 1.0 : 0.5)",
        "ray.origin_mm[axis] / spacing - (field.nearest ? 1.0 : 0.0)",
        "nifti",
        ("tests/truth/test_oracle_twin.py",),
    ),
    Mutant(
        "minimum-sign",
        "the truth of a minimum is the maximum of the scan",
        "volprep/truth/projection.py",
        'sign = -1.0 if projection == "minimum" else 1.0',
        "sign = 1.0",
        "minimum",
        ("tests/truth/test_minimum_picture.py",),
    ),
    Mutant(
        "reference-of-value",
        "the opacity of a value in the truth is that of half its length",
        "volprep/truth/shown.py",
        "self._depths = extinctions * reference_mm",
        "self._depths = extinctions * reference_mm * 0.5",
        "maximum",
        ("tests/truth/test_maximum_picture.py",),
    ),
    Mutant(
        "hidden-light",
        "a light with a place shines through from behind in the truth of surfaces",
        "volprep/truth/surface.py",
        "diffuse = light.ambient + light.diffuse * np.maximum(facing, 0.0) * reaching",
        "diffuse = light.ambient + light.diffuse * np.abs(facing) * reaching",
        "surface",
        (
            "tests/validation/test_second_reading.py::test_the_integrator_agrees_with_every_oracle_and_not_with_a_fainter_picture",
        ),
    ),
)
