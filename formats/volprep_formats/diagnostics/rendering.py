"""Rendering: VP5xxx."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP5001 MACHINE no EGL or OpenGL ES library can be loaded: {error}
    Install libegl1, libgles2, libgles1 (for OpenGL ES 1.1) and libegl-mesa0 (Debian, Ubuntu), or mesa-libEGL and
    mesa-libGLES (Fedora).
VP5002 MACHINE no EGL display can be opened: {error}
    Set EGL_PLATFORM=surfaceless to use Mesa's software driver (libegl-mesa0 and libgl1-mesa-dri on Debian).
VP5003 MACHINE the driver {driver} cannot make a context of OpenGL ES {api}: {error}
    Use a driver that has this version. Mesa's llvmpipe (EGL_PLATFORM=surfaceless) has 2.0 to 3.2, and often 1.1.
VP5004 INTERNAL OpenGL was started before this process was forked, so the child cannot use it
    Start worker processes with the method spawn, not fork.
VP5005 RENDER {path}: the driver {driver} does not compile this shader:{log}
    Rebuild the package; if the shaders are unchanged, report the log and the driver.
VP5006 RENDER program {name} ({paths}): the driver {driver} does not link it:{log}
    Rebuild the package; if the shaders are unchanged, report the log and the driver.
VP5007 RENDER OpenGL ES failed with {error} in {operation} on the driver {driver}
    If this is GL_OUT_OF_MEMORY, draw a smaller picture or a coarser level; otherwise report it.
VP5008 RENDER the driver {driver} cannot draw into a target of format {target}
    Draw into a target of format rgba8, or use a driver that has {needs}.
VP5009 RENDER the driver {driver} cannot draw a picture of {width}×{height} pixels: each side must have 1 to {limit}
    Ask for another size.
VP5010 RENDER texture {name}: {axis} {size} is more than the {limit_name} of profile {profile}, {limit}
    Build the package for this profile, or draw it with the profile that it was built for.
VP5011 RENDER texture {name}: profile {profile} does not have the format {format}, only {known}
    Build the package for this profile.
VP5012 RENDER texture {name} is three-dimensional, but profile {profile} has no 3D textures
    Build the package for this profile. It will then hold a mosaic.
VP5013 RENDER program {name} reads {count} textures, but profile {profile} has {limit} texture units
    Build the package for this profile.
VP5014 RENDER the textures of program {name} take {size} bytes, but profile {profile} allows {limit}
    Draw a coarser level, or build the package for this profile.
VP5015 RENDER {path}: this shader needs a later version of OpenGL ES than profile {profile} has, which is {api}
    Build the package for this profile.
VP5016 PACKAGE {path}: the file holds {found}, but the manifest says {named}
    The package is damaged: build it again.
VP5017 PACKAGE program {name}: the manifest names {named}, but the shaders use {found}
    Build the package again.
VP5018 PACKAGE {package}: the package cannot draw {level} with {transfer}. It can draw {known}
    Name one of these. Of a draft, run the stage shaders first.
VP5019 RENDER a step of {step_mm} mm is not possible here: {reason}
    Ask for another step.
VP5020 RENDER no camera can be made from {what}
    Give an eye as three numbers, away from the middle of the volume.
VP5021 OUTPUT {path}: cannot write the picture: {error}
    Name a file that ends in .png, in a folder that exists and can be written.
VP5022 USAGE there is no view {name}
    Name one of: {known}; or use --eye.
VP5023 PACKAGE {path}: the transfer functions of this package are not editable
    Build it from a scene with editable = true.
VP5024 RENDER a step of {step_mm} mm takes up to {turns} turns of the shader's loops, and {driver} ends them after \
{made}: the voxels behind would be missing
    Choose a step of {possible} mm or more; in a scene, a larger render.step_voxels.
VP5025 USAGE there is no background {name}
    Name one of: {known}.
VP5026 OUTPUT {path}: this film cannot be made: {problem}
    Films are .mp4 and .webp files, or folders of PNG files: a name without an ending. --turntable turns any package,
    --frames plays a time series; both draw levels, so --memory, --point and --frame do not go with them.
VP5040 RENDER the light at {light} (box millimetres) is inside the volume: no view of it holds the volume for a shadow \
map
    Move the light out of the volume, or build the package with lighting.shadows = rays.
VP5041 RENDER a program of technique {technique} does not draw its picture part by part
    Build the package with render.technique = ray-casting or tiles, and without a shadow map.
VP5042 RENDER the driver {driver} has lost the OpenGL context in {operation}: the GPU was reset, and nothing is drawn \
any more
    Draw again. If it happens each time, a draw takes too long for the driver: choose technique slabs or tiles, a longer
    step or a smaller picture.
VP5043 RENDER {path}: the brick x {x}, y {y}, z {z} of level {level}, from byte {begin} of {file} on, is damaged: \
{error}
    It is drawn from the next coarser level. Get the package again from where it came, or build it again.
VP5050 USAGE the opacity of the volume cannot be estimated by {source} here: its picture has alpha, which is exact
    Leave out --opacity; estimates are for packages for OpenGL ES 1.1.
VP5051 TOLERANCE {failed} of {count} pictures of the walk are farther from what the package holds than the scene \
allows: the worst is {file}, RMSE {rmse}, largest error {maximum}
    Draw with a finer step (render.step_voxels), or allow more in [tolerance]; walk.json has all errors.
""")
