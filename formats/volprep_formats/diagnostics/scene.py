"""Scenes, profiles, and what does not fit: VP3xxx."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP3001 SCENE {path}: cannot read the file: {error}
    Check the path.
VP3002 SCENE {path}: not a TOML file: {error}
    Correct the line that the message names.
VP3003 SCENE {path}: {problems}
    Correct these keys. sample_specs holds scenes to start from, and its README.md lists every key.
VP3004 SCENE {path}: this is not a scene, so --source has no path to replace
    Name a scene, which is a TOML file that says how to draw a scan (README.md shows one), or leave --source out.
VP3005 SCENE there is no preset {name}
    Name one of: {names}. volprep presets shows them.
VP3010 SCENE there is no profile {name}
    Name one of: {known}; or give the path of a profile file that ends in .toml.
VP3011 SCENE {path}: cannot read the profile: {error}
    Check the path and the file.
VP3012 SCENE {path}: {problems}
    Correct these keys. volprep/scene/profiles holds profiles to start from.
VP3020 SCENE profile {profile} has no texture format for stored values of {bits} bits, only {formats}
    Set quantize.bits in the scene, or choose another profile.
VP3021 SCENE the window from {low} to {high} has no width
    Set quantize.window to two different values, the smaller one first, or to auto.
VP3022 SCENE profile {profile} cannot hold any level of this volume, not even level {level}: {reason}
    Choose a profile with larger limits, or set a smaller pyramid.coarsest_longest_axis.
VP3023 SCENE this scene with profile {profile} does not need the stage {stage}, only {needed}
    Leave the stage out. volprep plan says why.
VP3024 SCENE filter {filter} makes values between labels, and these would be other labels
    Set pyramid.filter to auto or to one of {possible}. If voxels are not labels, leave source.labels out.
VP3025 SCENE labels must be whole numbers from 0 on, because they become codes unchanged: {problem}
    Renumber the labels and leave quantize at auto. If voxels are not labels, give --no-labels, or leave source.labels
    out.
VP3026 SCENE the source has {count} labels, from {low} to {high}; a package {profile} holds {most} of them
    {how}
VP3027 SCENE the table of labels {table} would not be used: the values of the scan are not recognised as labels
    Give --labels, or source.labels = true, if they are labels; else leave the table out.
VP3030 SCENE profile {profile} cannot hold sub-volumes of {size} voxels along an axis: {reason}
    Set a smaller grid.size, choose a profile with 3D textures or more texture units, or leave the table [grid] out.
VP3031 SCENE bricks of {size} cells are smaller than the reach of the filter, {reach} voxels: a brick would need \
{texels} texels along an edge, with voxels from beyond its neighbours
    Set bricks.size to at least {reach}; 32 is usual.
VP3032 SCENE bricks need the texture format rgba8unorm, which profile {profile} does not have
    Choose a profile with rgba8unorm, or leave the table [bricks] out.
VP3033 SCENE baked light goes with bricks in 3D textures only, and profile {profile} has none
    Choose a profile with 3D textures, or leave the table [bricks] or lighting.baked out.
VP3034 SCENE bricks on demand cannot be combined with {what}
    Leave out one of the two. Bricks on demand are for one volume of values, drawn by rays with emission and absorption,
    unlit or with a headlight by differences of values, in OpenGL ES 3.0 or WebGL 2.
VP3041 SCENE a package of classified voxels cannot have {what}
    Leave that out, or choose another render.classification. Classified voxels are colours of one transfer function.
VP3042 SCENE {path}: not a transfer function: {problem}
    Use a file of 3D Slicer (.vp), ParaView (.json, with opacities, in RGB) or ITK-SNAP (labels, .txt), or a record of
    looks, as volprep export PACKAGE looks.json writes it.
VP3043 SCENE labels would get colours of other labels: {problem}
    Set render.classification to lookup, or lab.render.palette_entries to 256.
VP3044 SCENE filter transmittance averages the light of classified voxels, but the voxels of this scene are values
    Choose another pyramid.filter, or set render.classification to preclassified.
VP3045 SCENE render.compositing {compositing} cannot be combined with {what}
    Set render.compositing to emission-absorption, or leave the other out.
VP3046 SCENE a volume in colour cannot have {what}
    Leave that out, or leave [colour] out and set source.rgb: the voxels are then values.
VP3050 SCENE normals of code {coded} need textures of format {needed}, but profile {profile} has only {known}
    Choose another normals.code.
VP3060 SCENE stacks of slices cannot be combined with the rest of the scene: {problem}
    Use a profile of OpenGL ES 1.1 for slices, and another profile for everything that needs shaders.
VP3070 SCENE textures.compression {wanted} needs textures of format {format}, but profile {profile} has only {known}
    Choose another textures.compression, or a profile that has the format.
VP3071 SCENE textures.mipmaps needs 3D textures, but profile {profile} has none
    Choose a profile with 3D textures, or leave textures.mipmaps out; each level is then a mosaic.
VP3073 SCENE frames of a time series cannot be combined with {what}
    Leave out one of them, or choose one volume with --volume N or source.volume.
VP3078 SCENE {path}: a second scan is drawn over a scan alone, not over a scene, a preset, segments or a time series
    List both files in [[source.channels]] of a scene with [together], which may have all transfer functions.
VP3080 SCENE transfer functions cannot be editable together with {what}, which depends on the current functions
    Leave out either that or editable.
VP3115 SCENE render.compositing {compositing} shows a surface, but transfer function {transfer} has no isovalue
    Give the [[transfer]] an isovalue, or choose another render.compositing.
VP3116 SCENE transfer function {transfer} has the isovalue {isovalue:g}, but the values of the scan go from {low:g} to \
{high:g}: there is no surface
    Choose an isovalue between these.
VP3117 SCENE transfer function {transfer} shows nothing at its isovalue {isovalue:g}: its surface would be invisible
    Give it an opacity there, or choose another isovalue.
VP3118 SCENE render.compositing mida needs a range of intensities, but that of transfer function {transfer} goes from \
{low:g} to {high:g}
    Give the [[transfer]] intensities = [low, high], or points at several values.
VP3119 SCENE render.lighting {lighting} needs a light with a place, but the scene has no lighting.light_mm
    Add [lighting] with light_mm = [x, y, z] in the patient's space, or set render.lighting to headlight.
VP3120 SCENE lighting.normals {normals} are differences of values, but with render.classification preclassified the \
voxels are colours
    Set lighting.normals to volume, or choose another render.classification.
VP3130 SCENE render.technique {technique} cannot be combined with {what}
    Set render.technique to ray-casting, or leave the other out.
VP3160 SCENE lighting.shadows {shadows} needs a light with a place, but render.lighting is {lighting}
    Set render.lighting to phong or blinn-phong and lighting.light_mm, or lighting.shadows to none.
VP3161 SCENE lighting.shadows {shadows} needs OpenGL ES 3.0, but profile {profile} has {api}
    Choose a profile of OpenGL ES 3.0, or set lighting.shadows to none.
VP3162 SCENE lighting.shadows {shadows} cannot be combined with {what}
    Leave out one of the two; the guide lists valid combinations under Lighting.
VP3163 SCENE lighting.shadows {shadows} needs a light outside the volume, but that at {light} is inside
    Set lighting.shadows to rays, or move lighting.light_mm out of the volume.
VP3164 SCENE render.technique {technique} needs 3D textures and OpenGL ES 3.1, but profile {profile} has {problem}
    Choose a profile with 3D textures, or another technique.
VP3165 SCENE lighting.normals {normals} reads one voxel beside a sample, but lab.bricks.reach is {reach}: the next \
brick may not be stored
    Set lab.bricks.reach to 2.
VP3166 SCENE lab.hybrid.opacity {opacity} is for buffers without alpha, but pictures of profile {profile}, which has \
shaders, have it
    Leave lab.hybrid.opacity out, or choose a profile of OpenGL ES 1.1.
VP3180 SCENE {path}: {problems}
    Correct these keys of the walk; docs/GUIDE.md lists them under Scans larger than a device.
VP3181 SCENE step {number} of the walk cannot be made: {problem}
    Zoom in until the sub-volumes are shown before moving, and cut a box before showing it.
VP3285 SCENE filter {filter} moves the values of coarser levels to one side, which would make them worse than means
    Set pyramid.filter to auto. Greatest values suit compositing maximum, least values minimum; emission-absorption
    takes both with classifications lookup and preintegrated, whose tables make up for them, without segments and baked
    light.
VP3286 SCENE render.lighting {lighting} lights labels, which are constant in their voxels, only with {missing}
    Set this, or render.lighting to none. If the labels belong to a scan, name them as the [segments] of this scan:
    segments are lit in every way.
""")
