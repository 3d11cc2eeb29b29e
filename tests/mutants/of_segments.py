"""Bugs of what segments mean: styles, tints, visibility, volumes and numbers of labels."""

from .mutant import Mutant

_LOOKS = "volprep/parts/segments/looks.py"
_SOURCES = "formats/volprep_formats/segmentations"
_AGREES = ("tests/validation/test_segment_witness.py::test_product_and_witness_read_the_same_looks",)

OF_SEGMENTS = (
    Mutant(
        "style-function",
        "the function of a style is ignored",
        _LOOKS,
        "transfer=style.transfer or inside,",
        "transfer=inside,",
        "styles",
        _AGREES,
    ),
    Mutant(
        "tint-channels",
        "channels of tints are rotated",
        _LOOKS,
        "tint=(red, green, blue),",
        "tint=(green, blue, red),",
        "styles",
        _AGREES,
    ),
    Mutant(
        "tint-decoded-twice",
        "tints are decoded from sRGB twice",
        _LOOKS,
        "(linear_of_srgb(part) for part in colour)",
        "(linear_of_srgb(linear_of_srgb(part)) for part in colour)",
        "styles",
        _AGREES,
    ),
    Mutant(
        "hidden-segments",
        "visible = false is ignored",
        _LOOKS,
        "visible=style.visible,",
        "visible=True,",
        "styles",
        _AGREES,
    ),
    Mutant(
        "labels-of-styles",
        "labels of two functions are numbered in the wrong direction",
        _LOOKS,
        "tuple(order.index(label) for label in range(len(order)))",
        "tuple(order)",
        "styles",
        _AGREES,
    ),
    Mutant(
        "millilitres",
        "volumes of segments are ten times too large",
        "volprep/scan/segments/fitted.py",
        "return z * y * x / 1000.0",
        "return z * y * x / 100.0",
        "styles",
        ("tests/unit/test_segment_volumes.py::test_contours_have_the_volume_of_their_planes",),
    ),
    Mutant(
        "looks-linear",
        "the table of looks has no square roots",
        "formats/volprep_formats/package/parts/segments/texels.py",
        "roots[: len(looks)] = np.sqrt(looks)",
        "roots[: len(looks)] = looks",
        "styles",
        ("tests/validation/test_segment_witness.py::test_it_agrees_with_what_is_right",),
    ),
    Mutant(
        "seg-bits",
        "bits of a DICOM segmentation are read from the highest on",
        f"{_SOURCES}/dicom_seg.py",
        'bits = np.unpackbits(octets, bitorder="little")[first',
        'bits = np.unpackbits(octets, bitorder="big")[first',
        "dicom_seg",
        (
            "tests/unit/test_segmentations.py::test_frames_in_any_order_with_gaps_and_an_oblique_plane_find_their_slices",
        ),
    ),
    Mutant(
        "seg-order",
        "frames of a DICOM segmentation lie in the order of the file",
        f"{_SOURCES}/dicom_seg.py",
        "return exact, steps.astype(int).tolist()",
        "return exact, sorted(steps.astype(int).tolist())",
        "dicom_seg",
        (
            "tests/unit/test_segmentations.py::test_frames_in_any_order_with_gaps_and_an_oblique_plane_find_their_slices",
        ),
    ),
    Mutant(
        "slicer-layers",
        "all segments of 3D Slicer are looked for in the first layer",
        f"{_SOURCES}/seg_nrrd.py",
        'field.get("Layer", "0")',
        '"0"',
        "slicer",
        ("tests/unit/test_segmentations.py::test_layers_of_slicer_overlap_and_keep_their_names",),
    ),
    Mutant(
        "slicer-labels",
        "label values of 3D Slicer are ignored",
        f"{_SOURCES}/seg_nrrd.py",
        'field.get("LabelValue", str(number + 1))',
        "str(number + 1)",
        "slicer",
        ("tests/unit/test_segmentations.py::test_layers_of_slicer_overlap_and_keep_their_names",),
    ),
)
