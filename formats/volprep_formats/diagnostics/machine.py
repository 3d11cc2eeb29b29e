"""Missing features of the machine: VP7xxx; VP7010 to VP7059, of browsers and devices, from the reader in formats/js."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP7001 MACHINE this machine cannot build and draw packages. Missing: {missing}
    Each line marked missing says how to get that part.
VP7002 MACHINE the folder that this command runs in no longer exists
    Change to a folder that exists, and run it there.
VP7003 MACHINE {path}: the system refuses it: {error}
    Change the permissions of this path and of the folders above it, or name another.
VP7004 MACHINE the limit of memory (ulimit -v), {limit_mb:.0f} MB, is too low: {needed_mb:.0f} MB or more are needed
    Raise the limit, or the memory that is requested from the scheduler, to {needed_mb:.0f} MB.
VP7005 MACHINE {purpose} needs the Python module {module}, which is not installed
    It is in the extra {extra}: {how}.
VP7010 RENDER the package needs {needed}, but this page has {found}
    Use another browser or device, or build the package for the profile gles2-2048.
VP7011 RENDER texture {name}: {axis} {size} is more than this device takes, {limit}
    Draw a coarser level, or build the package for a profile with smaller textures.
VP7012 RENDER program {name} reads {count} textures, but this device reads {limit} in one program
    Build the package for a profile with fewer texture units.
VP7013 RENDER the textures of level {level} take {size} bytes, but {limit} are allowed here
    Draw a coarser level, or raise maxTextureBytes.
VP7014 RENDER this device draws textures of {format} wrongly: a few texels that must give {expected} give {found}
    Draw a level of another format, or build the package for a profile without this format.
VP7015 PACKAGE {url}: the server answers {answer}
    Check the address and the server.
VP7016 PACKAGE {url}: nothing has arrived for {seconds} s
    Check the connection and try again.
VP7017 USAGE a package cannot be opened from {what}
    Give openPackage the address of a folder or .volpkg.zip, a File, a Blob or an ArrayBuffer; await it.
VP7018 USAGE this renderer cannot draw: {problem}
    Make a new renderer, or wait until the context is there again.
VP7019 USAGE the picture cannot be clipped by {what}
    Give box as [[x, y, z], [x, y, z]] in millimetres, and planes of four numbers: at most {limit}, a box being six.
VP7020 USAGE these points are not a transfer function: {problem}
    Give points in ascending order of value, with colour and extinction_per_mm.
VP7021 PACKAGE program {name} draws {technique}, which is not possible here: {problem}
    Use a browser and a device that have it, or build the package with another technique.
VP7030 PACKAGE {path}: profile {profile} is for OpenGL ES 1.1, and its slices have no palettes: the page draws \
paletted ones
    Build the scene with lab.slices.form = "palette", or for a profile of OpenGL ES 2 or 3, such as gles2-2048.
VP7031 MACHINE cannot serve at {address}, port {port}: {error}
    Name another port with --port, or leave --port out: a free one is taken then.
VP7032 MACHINE this machine has no address in a local network
    Connect it to the network of the other device, or leave out --lan.
VP7033 OUTPUT {path}: not replaced: {problem}
    Choose another name, or move the existing one. --force replaces an older page, and nothing else.
VP7034 PACKAGE {path}: {size} bytes are too much for one page, which holds at most {limit}
    Write a folder (-o FOLDER), or build the package for a profile with smaller textures.
VP7035 MACHINE this installation lacks {path}, a file of the page
    Install volprep again.
VP7036 USAGE {path}: not a measurement of a device: {problem}
    Name a file that the page of volprep view has saved or sent, or a folder of such files.
VP7037 USAGE {path}: the device measured another package, {name} ({found}), and not this one ({expected})
    Name a measurement of this package, or measure it on the device.
VP7038 TOLERANCE {gpu} draws nothing of {transfer} in {frame_ms:g} ms: the fastest that was measured, level {level} \
with a step of {step_mm:.3g} mm, takes up to {fastest:.5g} ms
    Allow a longer frame, draw fewer pixels, or build the package with coarser levels.
VP7039 USAGE {path}: the report is not of this package
    Name another report with --report, or validate the package.
VP7040 OUTPUT {path}: the folder already has {count} measurements, the most that are allowed
    Move them to another folder, or name another with --devices.
VP7041 MACHINE this browser cannot draw with WebGL: {reason}
    Use a browser with WebGL, and allow it graphics acceleration.
VP7042 INTERNAL the page failed: {reason}
    Load it again; if that does not help, report the browser and these words.
VP7043 MACHINE the measurements did not arrive: {reason}
    Save it as a file, and put the file into the folder of measurements.
VP7044 USAGE {text} is not the size of a canvas
    Give width and height in pixels of the screen, each from 1 to {limit}, as in --canvas 1170x2532.
VP7045 USAGE {path}: none of its {count} measurements is of this scan ({scans})
    Measure a package of the scan with volprep view PACKAGE --devices FOLDER, or name another folder.
VP7046 TOLERANCE {missed} of {count} devices draw no measured package within RMSE {rmse:g} in {frame_ms:g} ms
    Allow a longer frame, a larger error or a smaller canvas, or measure packages for other profiles on them.
VP7060 RENDER {driver} draws {capability} wrong: pixel {pixel} of {pixels} is {found} instead of {expected}
    Pictures of packages that have it are wrong on this driver. Update it, or take Mesa's software driver, with
    EGL_PLATFORM=surfaceless LIBGL_ALWAYS_SOFTWARE=1 in the environment.
VP7061 RENDER this driver does not take {capability}: {error}
    Packages that have it cannot be drawn or validated on this driver. Build for a profile without it, or take Mesa's
    software driver, with EGL_PLATFORM=surfaceless LIBGL_ALWAYS_SOFTWARE=1 in the environment.
VP7062 PACKAGE {path}: its texels are Zstandard frames, and the app gave formats/c/volpkg.h no function that unpacks \
them
    Give volpkg_open_input such a function, or run volprep zip --texels plain: it makes a package that is used in place.
VP7063 RENDER the light cannot be changed: {problem}
    Give x, y and z in millimetres for lighting phong or blinn-phong, or the light around for turnable = true.
VP7064 RENDER {file}: the mesh is compressed with Draco, and the app gives no decoder; rays begin at the box, and the \
picture is the same
    For the speed of a mesh give createRenderer a decodeDraco, or build the package with draco = "none" in [proxy].
VP7070 MACHINE {path}: not decoded, because the process for its decoder cannot be limited: {error}
    Run volprep where processes may lower their own limits (setrlimit).
VP7071 MACHINE {path}: its decoder reached this machine's limit of {what}, which is lower than what a valid file may \
need
    Raise the limit ({option}, or the request to the scheduler). The file may be sound.
VP7072 MACHINE this device has sent {count} measurements, and no more are taken from one device
    Start volprep view again to take more.
VP7080 RENDER nothing can be picked at {what}: {reason}
    Draw first, and give a pixel of the picture and an opacity between 0 and 1.
VP7081 RENDER the attribute {name} cannot be {value}: {reason}
    Give another value; README.md of volpkg lists what the attributes of volume-viewer take.
VP7082 RENDER there is no slice {what}: {reason}
    Give a plane, a position from 0 to 1, and a size in pixels.
VP7083 RENDER the segment {name} cannot be changed: {problem}
    Take names from renderer.segments; a look has visible, tint (three numbers) and opacity, from 0 to 1.
VP7084 RENDER the medium {transfer} cannot have the opacity {opacity}
    Name a transfer function of a picture whose channels lie on several grids, and give a number from 0 on.
VP7085 RENDER these points cannot be read: {problem}
    Give a file that Save points has written.
VP7090 MACHINE notebooks need the Python module {module}, which is not installed
    It is in the extra notebook: {how}.
VP7091 PACKAGE {path}: {size} bytes are too much for a notebook, which holds at most {limit}
    Build the package for a profile with smaller textures, or show a coarser level of the scan.
VP7092 USAGE {what} cannot be shown: {reason}
    Give an array [z, y, x], the path of a scan, scene or package, a package, a pyvista.ImageData or a SimpleITK.Image.
VP7093 USAGE the plotter's volume cannot be taken: {reason}
    Add one ImageData with add_volume and its default blending, or say which one with volume=NUMBER.
VP7094 OUTPUT --json has nowhere to print its result: standard output is closed
    Leave standard output open, or leave --json out.
""")
