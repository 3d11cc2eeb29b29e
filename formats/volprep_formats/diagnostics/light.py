"""Diagnostics VP3240 to VP3249: light that is computed once."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP3240 SCENE lighting.baked = "{baked}" cannot be combined with {what}
    Leave out one of the two. Baked light works with ray casting (also with technique two-pass or slabs), the
    compositings emission-absorption and back-to-front, and the classifications lookup, palette and control-points. A
    preset with baked light goes with the same; labels are drawn without it, or with --no-labels as values.
VP3241 SCENE lighting.baked = "shadow" needs the place of the light
    Set lighting.light_mm to x, y and z in the patient's space (LPS), in millimetres.
VP3242 TOLERANCE {path}: baked light of {programs} is off by RMSE {rmse:.3g} from path tracing, allowed is {allowed:.3g}
    volprep inspect has the errors of small pictures at each resolution that the build tried: set lighting.resolution to
    a better one, or allow more with tolerance.rmse. {report} shows the pictures.
VP3243 SCENE lighting.clip_aware needs the planes of the cut
    Set lighting.clip_planes, or leave out clip_aware.
""")
