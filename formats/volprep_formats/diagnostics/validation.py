"""Validation and its report: VP6xxx."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP6001 SOURCE voxel [z {z}, y {y}, x {x}] is {value}, so the field around it is not defined, and there is no true \
picture
    Replace values that are not finite before you convert the volume.
VP6010 PACKAGE {path}: the package is not sound: {findings}
    {remedy}
VP6011 TOLERANCE {path}: {failed} of {views} views are beyond the tolerance; the worst is {view} of program {program}: \
over seen pixels RMSE {rmse:.4g} (limit {rmse_allowed:g}), largest error {maximum:.4g} (limit {maximum_allowed:g}), \
FLIP {flip:.3g} (limit {flip_allowed:g}); thin and small structures keep {kept} of their light (limit \
{kept_allowed:g}). RMSE {data:.2g} comes from the data, {drawing:.2g} from drawing
    See {report}. To reduce the error of the data: a profile that holds a finer level, or quantize.bits = 16 if the
    package has 8. To reduce the error of drawing: render.classification lookup or preintegrated, a smaller
    render.step_voxels, or a larger render.opacity_cutoff. Or allow more in [tolerance].
VP6012 SOURCE {path}: the scene that the package was made from is not known: {path}.origin.json is missing
    Name the scene with --source; a package cannot be judged by its own claims.
VP6013 SOURCE {path}: package {package} was made from another scan: the digest here is {found}…, that of the package \
{expected}…
    Name the right scan with --source, or build the package again.
VP6015 TOLERANCE {path}: the skip table or the proxy mesh of {programs} changes a picture, but rays may only leave out \
samples that show nothing
    See {report}. Build the package again. If that does not help, this is a defect in volprep: report it, and build
    without both (skip.kind none, no [proxy]).
VP6016 TOLERANCE {path}: {failed} of {views} views are beyond the tolerance; the worst is {view} of {program}: over \
seen pixels RMSE {rmse:.4g} (limit {rmse_allowed:g}), largest error {maximum:.4g} (limit {maximum_allowed:g}), FLIP \
{flip:.3g} (limit {flip_allowed:g}); thin and small structures keep {kept} of their light (limit {kept_allowed:g}). \
Slices are classified before they are filtered, and have no step to refine. In view {part_view} the error of their \
texels alone is {texels:.2g}; the angle adds {angle:.2g}, and 8 bits add {target:.2g}
    See {report}. A transfer function with softer edges gives a smaller error; steep edges need shaders. Set in
    [tolerance] the errors that such devices may have.
VP6017 SCENE profile {profile} has no shaders, and stacks of slices have neither a step nor a float target to test
    Choose a profile of OpenGL ES 2 or 3 with --profile.
VP6018 TOLERANCE {failed} of {cases} cases are not drawn as expected; the first is {case}: {problem}
    See {report}. This driver, or volprep, computes numerically hard cases wrongly.
VP6020 OUTPUT {path}: the report cannot replace this folder: {problem}
    Name another folder with --report, or move the existing one.
VP6021 OUTPUT {path}: cannot write the report: {error}
    Free disk space, or name another folder with --report.
VP6030 TOLERANCE {path}: {count} items do not follow from the scan: {listed}
    The package was changed after it was built, or the machine made an error. Build it again.
VP6031 TOLERANCE {path}: the manifest contradicts its scene: {listed}
    Build the package again from this scene, or name the scene that it was built from with --source.
VP6032 TOLERANCE {path}: not proved: no picture has judged these parts of the package: {listed}
    Leave these out of the scene, or accept them without proof: their texels and texts follow from the scan.
VP6033 TOLERANCE {path}: not proved: {listed}
    Build the package again with this version, or validate it with the version that built it.
VP6034 TOLERANCE {path}: {listed}
    Build the package again; the preview is drawn from its finest level.
VP6035 TOLERANCE {path}: the finest level is within the tolerance, but these are beyond it where they would be used: \
{listed}
    See {report}. Leave levels out with a larger pyramid.coarsest_longest_axis, try another pyramid.filter, or allow
    more in [tolerance], for levels for previews in [tolerance.levels].
VP6040 MACHINE VTK cannot draw the scan: the Python module {module} is not installed
    It is in the extra witness: {how}.
VP6041 MACHINE VTK cannot draw: {problem}
    VTK needs OpenGL 3.2, through EGL where there is no screen (Debian: libegl1 libgl1-mesa-dri). Leave out --witness or
    --figure where it has none.
VP6042 TOLERANCE {path}: the second witness, VTK, does not agree with the pictures of {programs} within its own error
    See {report}. Both renderers cannot be right: report this as a defect in volprep, with the report.
VP6043 PACKAGE {path}: there is no layout to draw: the package has neither proxy meshes, bricks, sub-volumes nor slices
    Use --picture for the slices of a level.
VP6044 TOLERANCE {path}: the fidelity that the manifest states does not hold in other views: {listed}
    Build the package again. If that does not help, this is a defect in volprep: report it, with the scene.
VP6050 SCENE curves need shaders, and profile {profile} has none
    Measure the curves of a package of the same scan for another profile.
VP6060 TOLERANCE {path}: a second reading with independent libraries does not agree with: {listed}
    See {report}: who read what, and the difference. If the scan, the scene and the package belong together, report this
    as a defect in volprep, with the report.
VP6070 TOLERANCE {path}: these levels are worse than box means of the scan, drawn in double precision: {listed}
    See {report}. Build the package again with another pyramid.filter. If box means themselves are said to be worse,
    this is a defect in volprep: report it, with the scene.
VP6071 TOLERANCE {path}: these levels are shifted against the scan by up to {shift:.2g} of their voxels: {listed}
    See {report}. This is a defect in volprep: report it, with the scene. Leave the levels out with a larger
    pyramid.coarsest_longest_axis.
VP6072 TOLERANCE {count} of {cases} cases were not tried, because --seconds was over: {listed}
    Allow more with --seconds, or try these with --case. Nothing is known of them.
VP6080 SCENE --ablate needs shaders, and profile {profile} has none
    Measure a package of the same scan for another profile.
VP6081 TOLERANCE {path}: measured, decisions of the plan that do not pay ({count}): {listed}
    See {report}. The package is correct, but could be smaller or faster. Set these items in the scene.
VP6082 RENDER program {program} draws {wrong} of {pixels} pixels as NaN or infinite, into a target of {target}
    This driver, or volprep, computes numerically hard cases wrongly: volprep study stress finds them. Report it, with
    the scene and the driver.
VP6085 TOLERANCE {path}: with --strict-levels, coarse levels may be neither beyond their tolerance nor lose anything: \
{listed}
    See {report}. Leave coarse levels out with a larger pyramid.coarsest_longest_axis, allow more in [tolerance.levels],
    or build for a profile that holds finer levels.
""")
