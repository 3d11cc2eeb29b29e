"""Scenes, profiles, and what does not fit: VP3xxx."""

from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus

ENTRIES: dict[str, Diagnostic] = {
    "VP3001": Diagnostic(ExitStatus.SCENE, "{path}: cannot read the scene: {error}", "Check the path."),
    "VP3002": Diagnostic(ExitStatus.SCENE, "{path}: not a TOML file: {error}", "Mend the line that the message names."),
    "VP3003": Diagnostic(
        ExitStatus.SCENE,
        "{path}: {problems}",
        "Mend these keys; sample_specs holds scenes to start from, and its README.md lists all keys.",
    ),
    "VP3004": Diagnostic(
        ExitStatus.SCENE,
        "{path}: this is no scene, whose scan --source could replace",
        "Name a scene before --source, a TOML file that says how to draw a scan: README.md has one. Or the scan alone.",
    ),
    "VP3010": Diagnostic(
        ExitStatus.SCENE,
        "there is no profile {name}",
        "Name one of: {known}; or give the path of a profile file that ends in .toml.",
    ),
    "VP3011": Diagnostic(ExitStatus.SCENE, "{path}: cannot read the profile: {error}", "Check the path and the file."),
    "VP3012": Diagnostic(
        ExitStatus.SCENE, "{path}: {problems}", "Mend these keys; volprep/profiles holds profiles to start from."
    ),
    "VP3020": Diagnostic(
        ExitStatus.SCENE,
        "profile {profile} has no texture format for stored values of {bits} bits, only {formats}",
        "Set quantize.bits of the scene, or take another profile.",
    ),
    "VP3021": Diagnostic(
        ExitStatus.SCENE,
        "the window from {low} to {high} has no width",
        "Set quantize.window to two values, the smaller one first, or to auto.",
    ),
    "VP3022": Diagnostic(
        ExitStatus.SCENE,
        "profile {profile} holds no level of this volume, not even level {level}: {reason}",
        "Take a profile with larger limits, or a smaller pyramid.coarsest_longest_axis.",
    ),
    "VP3023": Diagnostic(
        ExitStatus.SCENE,
        "a package of this scene for profile {profile} has no stage {stage}, only {needed}",
        "Leave the stage out; volprep plan tells why.",
    ),
    "VP3024": Diagnostic(
        ExitStatus.SCENE,
        "filter {filter} makes values that lie between labels, and so are other labels",
        "Set pyramid.filter to auto or to one of {possible}; or leave source.labels out, if voxels are no labels.",
    ),
    "VP3025": Diagnostic(
        ExitStatus.SCENE,
        "labels are whole numbers from 0 to 255, and become codes as they are: {problem}",
        "Renumber the labels and leave quantize at auto; or leave source.labels out, if voxels are no labels.",
    ),
    "VP3030": Diagnostic(
        ExitStatus.SCENE,
        "profile {profile} cannot hold sub-volumes of {size} voxels along an axis: {reason}",
        "Set a smaller grid.size in the scene, take a profile with 3D textures, or leave [grid] out.",
    ),
    "VP3031": Diagnostic(
        ExitStatus.SCENE,
        "bricks of {size} cells are smaller than the reach of the filter, {reach} voxels: one of {texels} texels along "
        "an edge would hold voxels from beyond its neighbours",
        "Set bricks.size to {reach} at least; 32 is usual.",
    ),
    "VP3032": Diagnostic(
        ExitStatus.SCENE,
        "bricks need 3D textures and RGBA8, and profile {profile} has not both",
        "Choose a profile with 3D textures, or leave the table [bricks] out.",
    ),
    "VP3040": Diagnostic(
        ExitStatus.SCENE,
        "classification {classification} needs more than OpenGL ES {api} of profile {profile} has",
        "Choose another render.classification, or a profile of OpenGL ES 3.0.",
    ),
    "VP3041": Diagnostic(
        ExitStatus.SCENE,
        "a package of classified voxels cannot have {what}",
        "Leave that out, or choose another render.classification: voxels are colours of one transfer function.",
    ),
    "VP3042": Diagnostic(
        ExitStatus.SCENE,
        "{path}: no transfer function: {problem}",
        "Give a file of 3D Slicer (.vp), ParaView (.json, with opacities, in RGB) or ITK-SNAP (labels, .txt).",
    ),
    "VP3043": Diagnostic(
        ExitStatus.SCENE,
        "labels would get colours of other labels: {problem}",
        "Set render.classification to lookup, or render.palette_entries to 256.",
    ),
    "VP3044": Diagnostic(
        ExitStatus.SCENE,
        "filter transmittance averages the light of classified voxels, and voxels of this scene are values",
        "Choose another pyramid.filter, or set render.classification to preclassified.",
    ),
    "VP3045": Diagnostic(
        ExitStatus.SCENE,
        "render.compositing {compositing} does not go with {what}",
        "Set render.compositing to emission-absorption, or leave the other out.",
    ),
    "VP3050": Diagnostic(
        ExitStatus.SCENE,
        "normals of code {coded} need textures of format {needed}; profile {profile} has {known}",
        "Choose another normals.code, or leave normals.magnitude out.",
    ),
    "VP3060": Diagnostic(
        ExitStatus.SCENE,
        "stacks of slices and the rest of the scene do not go together: {problem}",
        "Take a profile of OpenGL ES 1.1 for slices, and another one for what needs shaders.",
    ),
    "VP3070": Diagnostic(
        ExitStatus.SCENE,
        "textures.compression {wanted} needs textures of format {format}; profile {profile} has {known}",
        "Choose another textures.compression, or a profile that has the format.",
    ),
    "VP3071": Diagnostic(
        ExitStatus.SCENE,
        "textures.mipmaps needs 3D textures, and profile {profile} has none",
        "Choose a profile with 3D textures, or leave textures.mipmaps out: levels are mosaics of their own then.",
    ),
    "VP3080": Diagnostic(
        ExitStatus.SCENE,
        "transfer functions cannot be editable with {what}, which depends on what they are now",
        "Leave that out, or editable.",
    ),
}
