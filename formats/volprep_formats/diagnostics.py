"""Every message that volprep can give, in one catalogue: permanent code, exit status, what is wrong, what to do."""

from dataclasses import dataclass
from enum import IntEnum


class ExitStatus(IntEnum):
    """Exit statuses of the command line. They never change their meaning."""

    OK = 0
    """The command did what it was asked to do."""
    TOLERANCE = 1
    """The package is sound, but a picture is further from the truth than the scene allows."""
    USAGE = 2
    """The command line itself is wrong."""
    SOURCE = 3
    """The source cannot be read, or its geometry cannot be trusted."""
    SCENE = 4
    """The scene or the profile is wrong, or the scene does not fit the profile."""
    PACKAGE = 5
    """The package is damaged, of another version, or in the wrong state."""
    OUTPUT = 6
    """The output cannot be written."""
    RENDER = 7
    """OpenGL ES failed, or a limit of the profile would be broken."""
    MACHINE = 8
    """A part that this command needs is missing on this machine."""
    INTERNAL = 70
    """A defect in volprep."""


@dataclass(frozen=True)
class Diagnostic:
    """One entry of the catalogue. `summary` and `remedy` are format strings over the fields of the error."""

    status: ExitStatus
    summary: str
    remedy: str


CATALOGUE: dict[str, Diagnostic] = {
    # VP1xxx sources and readers
    "VP1001": Diagnostic(
        ExitStatus.SOURCE, "{path}: no such file or folder", "Check the path: in [source] of the scene, or of --source."
    ),
    "VP1002": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {problem}",
        "Check that the file is whole. If it is one of these, set source.format in a scene: {known}; a raw file needs "
        "[source.raw] there, too.",
    ),
    "VP1003": Diagnostic(ExitStatus.SOURCE, "{path}: cannot be read: {error}", "Check the file and its permissions."),
    "VP1004": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: source.{key} is set, but the source is read as {format}",
        "Leave source.{key} out, or correct source.format.",
    ),
    "VP1005": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: its compressed data cannot be unpacked: {error}",
        "The file is damaged or incomplete; get it again from where it came.",
    ),
    "VP1006": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the header names the data file {name!r}, which {problem}",
        "Put both files, as they were written, into one folder.",
    ),
    "VP1007": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the data are written as text, and {text!r} in them is no number of type {dtype}",
        "The file is damaged or its header is wrong; get it again from where it came.",
    ),
    "VP1008": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the header declares {expected} bytes of voxels, but the data hold, or can unpack to, {actual}",
        "The file is incomplete or its header is wrong; get it again from where it came.",
    ),
    "VP1010": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: a file without a header says nothing about its shape",
        "Add the table [source.raw] with shape_zyx and dtype to the scene.",
    ),
    "VP1011": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {declared} needs exactly {expected} bytes, but the file has {actual}: {hint}",
        "Correct [source.raw], or get the whole file.",
    ),
    "VP1020": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: not a sound NIfTI file: {error}",
        "Get the file again from where it came. A pair of .hdr and .img must be joined into one .nii first.",
    ),
    "VP1021": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the NIfTI file has {shape} values along x, y, z, ...; one volume is needed",
        "Set source.volume to the number of one, from 1 to {volumes}.",
    ),
    "VP1022": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: voxels of NIfTI type {dtype} cannot be read as one grey value each",
        "Convert the file to an integer or floating-point type.",
    ),
    "VP1030": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: no DICOM images here ({files} other files)",
        "Name the folder that holds the series; or the file itself, if the scan is no DICOM series.",
    ),
    "VP1031": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the DICOM file is cut off: {what}",
        "Copy the series again from where it came. Do not just remove the file: a slice would be missing.",
    ),
    "VP1032": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: begins like a DICOM file, but cannot be parsed ({error})",
        "Copy the series again from where it came. Move the file away only if it belongs to no series here.",
    ),
    "VP1033": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: holds {count} DICOM series, and more than one, or none, could be the volume that is meant",
        "Set source.series, or give import --series, to one of these or to a unique ending of it:{found}",
    ),
    "VP1034": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {fits} here ends with {wanted!r}",
        "Set source.series, or give import --series, to one of these or to a unique ending of it:{found}",
    ),
    "VP1035": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the image is in colour ({kind}); a volume needs one grey value in each pixel",
        "Choose the grey series that this picture was made from. Uncompressed colours become grey with "
        'rgb = "luminance" in [source], or --rgb luminance.',
    ),
    "VP1036": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {keyword} is missing, so the place or the values of this slice are not known",
        "Export the series again with all its attributes, or choose another series.",
    ),
    "VP1037": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the value of {keyword} is not {wanted}",
        "Export the series again, or choose another series.",
    ),
    "VP1038": Diagnostic(
        ExitStatus.MACHINE,
        "{path}: no decoder for the transfer syntax {syntax} ({missing})",
        "Install the decoder, or export the series as Explicit VR Little Endian.",
    ),
    "VP1039": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the pixel data cannot be decoded as {syntax} ({error})",
        "The file is damaged; copy the series again from where it came.",
    ),
    "VP1040": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the header says {columns}×{rows} pixels of {bits} bits, which are {expected} bytes, "
        "but the pixel data has {actual}",
        "The file is damaged; copy the series again from where it came.",
    ),
    "VP1041": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: holds {frames} frames in one file, and {what}",
        "Export the series as single-frame images, or as enhanced multi-frame images with functional groups.",
    ),
    "VP1042": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: is a Siemens mosaic, many slices in one picture, but {what}",
        "Export the series with its private attributes, or as single-frame images.",
    ),
    "VP1043": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {bits} cannot be read; 8, 16 and 32 bits as integers and 32 and 64 bits as floating point can",
        "Export the series with 16-bit pixels.",
    ),
    "VP1044": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the header says {columns}×{rows} pixels, more than the {limit} that any slice may have",
        "The file is damaged or hostile; copy the series again from where it came.",
    ),
    "VP1045": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the header says {frames} frames, which need {expected}, but the pixel data has {actual}",
        "The file is damaged; copy the series again from where it came.",
    ),
    "VP1046": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the header says {columns}×{rows} pixels of 1 value, but the compressed data say {actual}",
        "The file is damaged; copy the series again from where it came.",
    ),
    "VP1080": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: exists already and is not an empty folder",
        "Choose another folder, or remove this one.",
    ),
    "VP1081": Diagnostic(ExitStatus.OUTPUT, "{path}: cannot be written: {error}", "Check the disk and permissions."),
    "VP1082": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: the volume holds values that are not finite, which DICOM cannot store",
        "Replace NaN and infinite values first.",
    ),
    "VP1090": Diagnostic(
        ExitStatus.SOURCE,
        "the source has {count} voxels that are NaN or infinite, the first in slice {z}",
        "Replace them in the source: no colour belongs to them.",
    ),
    "VP1100": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: not a sound NRRD file: {error}",
        "Get the file again from where it came, or mend its header.",
    ),
    "VP1101": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: axis {axis} of the NRRD file (kind {kind}) has {size} values for each voxel; one is needed",
        "Extract one component, or one volume, into a file of its own.",
    ),
    "VP1102": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: NRRD files with {what} cannot be read",
        "Write the volume into one file of numbers, raw, gzipped, bzipped or as text.",
    ),
    "VP1103": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {what} of the NRRD file cannot be turned into positions in the patient",
        "Write the file with space left-posterior-superior, space directions and space origin, in millimetres.",
    ),
    "VP1120": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: not a sound MetaImage file: {error}",
        "Get the file again from where it came, or mend its header.",
    ),
    "VP1121": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the MetaImage file has {what}; one value at each place of a volume is needed",
        "Extract one component, or one volume, into a file of its own.",
    ),
    "VP1122": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: MetaImage files with {what} cannot be read",
        "Write the volume into one file of numbers, with its header or beside it.",
    ),
    "VP1140": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: not a sound VTK file: {error}",
        "Get the file again from where it came, or write it anew.",
    ),
    "VP1141": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the VTK file has {problem}; one number at each point of a volume is needed",
        "Write the array that is meant as the scalars of the points.",
    ),
    "VP1142": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: VTK files with {what} cannot be read",
        "Write one piece of image data with numbers as its scalars, not compressed or with zlib.",
    ),
    "VP1160": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: no pictures here",
        "Point source.path at the folder that holds them itself; files ending in {known} are taken as pictures.",
    ),
    "VP1161": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the names of the pictures do not tell their order: {first} and {other} {how}",
        "Keep the pictures of one volume in the folder, with names that differ in nothing but one number.",
    ),
    "VP1162": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {count} picture(s) missing between {first} and {last}, by their numbers: {missing}",
        'Copy the stack again, whole; or set source.stack.gaps = "ignore" if the numbers mean nothing.',
    ),
    "VP1163": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: pictures differ, {count} of {total} from the rest: {first}, but {other}",
        "Remove pictures that do not belong to the volume, or convert all to one size and type.",
    ),
    "VP1164": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the picture has {what}; a volume needs one grey value in each pixel",
        'Convert the pictures to grey, or write rgb = "luminance" in [source], or give import --rgb luminance.',
    ),
    "VP1165": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: not a sound picture: {error}",
        "The file is damaged or incomplete; get it again from where it came.",
    ),
    "VP1166": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: pictures with {what} cannot be read",
        "Convert them to one file of 8, 16 or floating-point 32 bits for each slice.",
    ),
    "VP1167": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: page {page} says {columns}×{rows} pixels: more than {limit}, or than a file of {size} bytes can hold",
        "The file is damaged or hostile; get it again from where it came.",
    ),
    "VP1168": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: its {pages} page(s) are not the slices of one volume: it says {says}",
        "Write one channel and one time point into a file of its own, with one page for each slice.",
    ),
    "VP1180": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: a mosaic does not say how many tiles it has",
        "Add the table [source.mosaic] with tiles_x, tiles_y and slices to the scene.",
    ),
    "VP1181": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {slices} slices do not fit into {tiles_x}×{tiles_y} tiles of a picture of {columns}×{rows} pixels",
        "Correct [source.mosaic].",
    ),
    "VP1200": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: not a sound OpenVDB file: {error}",
        "Get the file again from where it came, or write it anew with OpenVDB 5 or later.",
    ),
    "VP1201": Diagnostic(
        ExitStatus.MACHINE,
        "{path}: this build of volprep has no OpenVDB ({error})",
        "Install libopenvdb-dev, libtbb-dev and libboost-dev (Debian), then build volprep again.",
    ),
    "VP1202": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: holds {count} OpenVDB grids, and more than one, or none, could be the volume that is meant",
        "Set source.grid to the name of one of floats or doubles:{found}",
    ),
    "VP1203": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the voxels of the grid {grid!r} are of type {kind}, not one float or double each",
        "Set source.grid to a grid of numbers; turn points, vectors and masks into one first.",
    ),
    "VP1204": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the grid {grid!r} has no active voxel, so it has no extent",
        "Set source.grid to another grid.",
    ),
    "VP1205": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the active voxels of the grid {grid!r} span {size}, more than the {limit} that a volume may have",
        "Remove stray voxels, clip the grid, or resample it to larger voxels.",
    ),
    "VP1220": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: not sound as OME-TIFF or OME-Zarr: {error}",
        "Get it again from where it came, or write it anew.",
    ),
    "VP1221": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: holds {count} {kind}s, and nothing says which is meant",
        "Set source.{key} to the name or the number of one:{found}",
    ),
    "VP1222": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: holds no {kind} {wanted}, or several",
        "Set source.{key} to the name or the number of one:{found}",
    ),
    "VP1224": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: holds {what}; that is not read",
        "Write it anew: integers or floating point, in the current version of its format, with ordinary compression.",
    ),
    "VP1225": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: says that it has {size}; more than {limit}",
        "Choose a coarser level with source.level if there is one; else the file is damaged or hostile.",
    ),
    "VP1226": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: names {name!r}, which lies outside of it",
        "Do not trust this file; a sound one names only what is in it or beside it.",
    ),
    "VP1227": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: gives {found} along {axis}, though it gives others",
        "Correct the physical size of its voxels in the program that wrote it.",
    ),
    "VP1240": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: channel {name} is not registered with channel {first}: {difference}",
        "Resample it onto the grid of {first} first; channels of one volume have their voxels in the same places.",
    ),
    "VP1241": Diagnostic(
        ExitStatus.SCENE,
        "{path}: the source has no channel {wanted}, which a transfer function is for",
        "Set transfer.channel to one of: {found}.",
    ),
    "VP1242": Diagnostic(
        ExitStatus.SCENE,
        '{path}: source.channels is "all", but {format} files have one channel',
        "Leave source.channels out, or list the files of the channels in [[source.channels]].",
    ),
    "VP1243": Diagnostic(
        ExitStatus.SCENE,
        "{path}: the scene lists a file for each channel, so one path or setting cannot replace them",
        "Change the scene.",
    ),
    "VP1244": Diagnostic(
        ExitStatus.SCENE,
        "{path}: {what} cannot be made of a volume of several channels",
        "Leave it out, or give the scene transfer functions of one channel only.",
    ),
    "VP1245": Diagnostic(
        ExitStatus.SCENE,
        "{path}: the picture {name} cannot be drawn: {reason}",
        "Leave [together] out, name other transfer functions there, or change what the message names.",
    ),
    "VP1250": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: holds no level {level}; there are: {found}",
        "Choose one of these; volprep inspect shows them.",
    ),
    "VP1251": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: exists already",
        "Choose another name, or replace it with --force; a folder is never replaced.",
    ),
    "VP1252": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: the ending says no format that can be written",
        "Use .nii, .nii.gz, .nrrd, .raw or .vdb; a name without an ending becomes a folder of DICOM files.",
    ),
    "VP1253": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: holds the colours that its transfer functions make of the scan, and no values",
        "Take the scan itself: volprep import makes a draft of it, which volprep export writes. Or build the scene for "
        "a profile with shaders, with classified samples in place of voxels.",
    ),
    "VP1270": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: its decoder crashed ({how}), in a process of its own with {limit_mb:.0f} MB of memory",
        "The file is damaged or hostile; get it again from where it came.",
    ),
    "VP1271": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: its decoder was stopped, because it had not ended after {limit_s:.0f} s",
        "The file is damaged or hostile, get it again from where it came; or this machine is overloaded.",
    ),
    "VP1272": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: its decoder wanted more than the {limit_mb:.0f} MB of memory that a sound file needs",
        "The file is damaged or hostile; get it again from where it came.",
    ),
    "VP1273": Diagnostic(
        ExitStatus.MACHINE,
        "{path}: no process can be started to decode it: {error}",
        "Check how much memory and how many processes this machine allows (ulimit -a).",
    ),
    # VP2xxx geometry
    "VP2001": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: slices differ in size: {first} pixels, {other}",
        "Move the images that do not belong to the volume out of the folder.",
    ),
    "VP2002": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: slices differ in pixel spacing: {first} mm, {other} mm",
        "Move the images that do not belong to the volume out of the folder.",
    ),
    "VP2003": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: {count} of {total} slices lie in another orientation than {first}; {other} is turned by "
        "{angle:.2f}°",
        "Move the images that do not belong to the volume (localisers, reformats) out of the folder.",
    ),
    "VP2004": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: ImageOrientationPatient is not two unit vectors at a right angle: it is off by {deviation:.3g}, and "
        "rounding explains {tolerance:g}",
        "Export the series again, or choose another series.",
    ),
    "VP2005": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: {several} of {places} places hold more than one image (up to {each}); the first are {first} and "
        "{second}, both at ({position}) mm; {differ}",
        "Keep one image at each place.",
    ),
    "VP2006": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: {each} images at each of {places} places, so these are several volumes (echoes, phases, time "
        "points), or copies; the first are {first} and {second}, both at ({position}) mm; {differ}",
        "Set source.volume, or give import --volume, to choose one, if an attribute tells them apart; or keep the "
        "images of one in the folder.",
    ),
    "VP2007": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: gantry tilt of {angles}: the slices lie {pitch_mm:.3f} mm apart along their normal, but "
        "{step_mm:.3f} mm along the line from slice to slice, and have shifted sideways by {total_mm:.2f} mm in all",
        'Set source.repair = ["tilt"], or give import --repair tilt, to shear the tilt away by linear interpolation '
        "within the slices.",
    ),
    "VP2008": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: {name} (slice {slice}) lies {shift_mm:.3f} mm beside the line of the other slices; up to "
        "{tolerance_mm:.3f} mm is taken as rounding",
        "Check whether the patient or table moved, or whether the slice belongs to another series.",
    ),
    "VP2014": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: {missing} missing slice(s) between {below} and {above}: the gap is {gap_mm:.3f} mm, usual is "
        "{usual_mm:.3f} mm; such gaps in all: {holes}",
        'Copy the series again, whole; or set source.repair = ["gaps"], or give import --repair gaps, to interpolate '
        "between the neighbours.",
    ),
    "VP2015": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: uneven slice distances, from {least_mm:.3f} to {gap_mm:.3f} mm, usual {usual_mm:.3f} mm; the "
        "largest is between {below} and {above}; slices lie up to {off_mm:.3f} mm from even places, and up to "
        "{tolerance_mm:.3f} mm is taken as rounding",
        'Set source.repair = ["gaps"], or give import --repair gaps, to interpolate slices at even distances; or leave '
        "out those that are wrong.",
    ),
    "VP2016": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: repaired, the volume would have {size} voxels, more than {growth} times the slices, rows or columns "
        "of the scan",
        "Check the positions of the slices; whole parts of the scan may be missing.",
    ),
    "VP2017": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: there is no volume {volume}; the series holds {count}",
        "Set source.volume to a number from 1 to {count}, or leave it out.",
    ),
    "VP2020": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the volume is sheared: its axes are off right angles by {angle:.3f}°",
        "Resample the volume to a grid with right angles first.",
    ),
    "VP2021": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the {which} of the file gives the voxels no usable place or size",
        "Repair the header, or resample the volume.",
    ),
    # VP3xxx scene, profile, plan
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
    # VP4xxx package
    "VP4001": Diagnostic(ExitStatus.PACKAGE, "{path}: no such package", "Check the path."),
    "VP4002": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: not a volume package: {problem}",
        "Name the folder that volprep build wrote, or the file of volprep zip.",
    ),
    "VP4003": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: the package has version {version} of the format, this volprep reads {known}",
        "Use the volprep that wrote it, or build the package again.",
    ),
    "VP4004": Diagnostic(
        ExitStatus.PACKAGE, "{path}: the manifest breaks the schema: {problems}", "Build the package again."
    ),
    "VP4005": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: the package is a draft, still under construction",
        "Run volprep seal on it: it finishes the package, or names the stage that is missing.",
    ),
    "VP4006": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: the package is sealed and cannot change",
        "Build it again with volprep build, or start a new draft.",
    ),
    "VP4007": Diagnostic(ExitStatus.PACKAGE, "{path}: cannot read {file}: {error}", "Build the package again."),
    "VP4008": Diagnostic(
        ExitStatus.PACKAGE, "{path}: {file} has {size} bytes instead of {expected}", "Build the package again."
    ),
    "VP4009": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: {file} is damaged: its SHA-256 is not the one in the manifest",
        "Copy the package again, or build it again.",
    ),
    "VP4010": Diagnostic(
        ExitStatus.PACKAGE, "{path}: the manifest does not name {file}", "Move the file out of the package."
    ),
    "VP4011": Diagnostic(
        ExitStatus.PACKAGE, "{path}: the package contradicts itself: {problem}", "Build the package again."
    ),
    "VP4012": Diagnostic(
        ExitStatus.PACKAGE, "{path}: another process is working on this draft", "Wait until it has ended."
    ),
    "VP4014": Diagnostic(
        ExitStatus.PACKAGE, "{path}: the package has no file {file}", "volprep inspect lists the files that it has."
    ),
    "VP4020": Diagnostic(
        ExitStatus.OUTPUT, "{path}: cannot write: {error}", "Make room, or name an output that can be written."
    ),
    "VP4021": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: left as it is, because it is no package: {problem}",
        "Name another output, or move what is there.",
    ),
    "VP4022": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: left as it is, because it holds files that are not the package's ({count}, the first is {first})",
        "Move these files, or name another output.",
    ),
    "VP4023": Diagnostic(
        ExitStatus.OUTPUT, "{path}: a new draft needs an empty folder", "Name another output, or move what is there."
    ),
    "VP4030": Diagnostic(
        ExitStatus.PACKAGE, "{name}: not a KTX 2 texture as packages have them: {problem}", "Build the package again."
    ),
    "VP4031": Diagnostic(ExitStatus.PACKAGE, "{path}: not a paletted texture: {problem}", "Build the package again."),
    "VP4032": Diagnostic(ExitStatus.PACKAGE, "{path}: not a joint histogram: {problem}", "Build the package again."),
    "VP4039": Diagnostic(
        ExitStatus.PACKAGE, "{name}: not a mesh as packages have them: {problem}", "Build the package again."
    ),
    "VP4040": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: stage {stage} needs stage {missing}, which has not run since its settings changed",
        "Run volprep {missing} on the draft first.",
    ),
    "VP4041": Diagnostic(
        ExitStatus.OUTPUT, "{path}: another build is making this package", "Wait until it is done, or stop it."
    ),
    "VP4042": Diagnostic(
        ExitStatus.INTERNAL,
        "the package that was built is not sound: {finding}",
        "This is a defect in volprep. Report it with the scene; the older package, if any, is untouched.",
    ),
    "VP4043": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: does not say where the package came from: {problem}",
        "Remove this file and name the source with --source, or build again.",
    ),
    "VP4044": Diagnostic(
        ExitStatus.PACKAGE, "{path}: is one file already", "Copy it, or unzip it to have the folder back."
    ),
    "VP4050": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: the package has no sub-volumes to cut from",
        "Build it from a scene with a table [grid].",
    ),
    "VP4051": Diagnostic(
        ExitStatus.USAGE,
        "{path}: the center {center} lies outside the volume of {shape} voxels, x × y × z",
        "Name a voxel from 0 on; with --world a place in the patient, in millimetres.",
    ),
    # VP5xxx rendering
    "VP5001": Diagnostic(
        ExitStatus.MACHINE,
        "no EGL or OpenGL ES library can be loaded: {error}",
        "Install libegl1, libgles2 and libegl-mesa0 on Debian and Ubuntu, mesa-libEGL and mesa-libGLES on Fedora.",
    ),
    "VP5002": Diagnostic(
        ExitStatus.MACHINE,
        "no EGL display can be opened: {error}",
        "Set EGL_PLATFORM=surfaceless for Mesa's software driver (libegl-mesa0 and libgl1-mesa-dri on Debian).",
    ),
    "VP5003": Diagnostic(
        ExitStatus.MACHINE,
        "the driver {driver} gives no context of OpenGL ES {api}: {error}",
        "Use a driver that has it. Mesa's llvmpipe (EGL_PLATFORM=surfaceless) has 2.0 to 3.2, and often 1.1.",
    ),
    "VP5004": Diagnostic(
        ExitStatus.INTERNAL,
        "OpenGL was started before this process forked, and cannot be used in the child",
        "Start worker processes with the method spawn.",
    ),
    "VP5005": Diagnostic(
        ExitStatus.RENDER,
        "{path}: the driver {driver} does not compile this shader:\n{log}",
        "Rebuild the package; if the shader is unchanged, report the log and the driver.",
    ),
    "VP5006": Diagnostic(
        ExitStatus.RENDER,
        "program {name} ({paths}): the driver {driver} does not link it:\n{log}",
        "Rebuild the package; if the shaders are unchanged, report the log and the driver.",
    ),
    "VP5007": Diagnostic(
        ExitStatus.RENDER,
        "OpenGL ES failed with {error} in {operation} on the driver {driver}",
        "If this is GL_OUT_OF_MEMORY, draw a smaller picture or a coarser level; otherwise report it.",
    ),
    "VP5008": Diagnostic(
        ExitStatus.RENDER,
        "the driver {driver} cannot draw into a target of format {target}",
        "Draw into rgba8, or use a driver that has {needs}.",
    ),
    "VP5009": Diagnostic(
        ExitStatus.RENDER,
        "a picture of {width}×{height} pixels is outside the limits of the driver {driver}: 1 to {limit}",
        "Ask for another size.",
    ),
    "VP5010": Diagnostic(
        ExitStatus.RENDER,
        "texture {name}: {axis} {size} is more than {limit_name} {limit} of the profile {profile}",
        "Build the package for this profile, or render it with the profile that it was built for.",
    ),
    "VP5011": Diagnostic(
        ExitStatus.RENDER,
        "texture {name}: the profile {profile} has no format {format}, only {known}",
        "Build the package for this profile.",
    ),
    "VP5012": Diagnostic(
        ExitStatus.RENDER,
        "texture {name} is three-dimensional, and the profile {profile} has no 3D textures",
        "Build the package for this profile: it will hold a mosaic.",
    ),
    "VP5013": Diagnostic(
        ExitStatus.RENDER,
        "program {name} reads {count} textures, and the profile {profile} has {limit} units",
        "Build the package for this profile.",
    ),
    "VP5014": Diagnostic(
        ExitStatus.RENDER,
        "the textures of program {name} take {size} bytes, and the profile {profile} allows {limit}",
        "Draw a coarser level, or build the package for this profile.",
    ),
    "VP5015": Diagnostic(
        ExitStatus.RENDER,
        "{path}: this shader is written for a later version of OpenGL ES than {api}, which the profile {profile} has",
        "Build the package for this profile.",
    ),
    "VP5016": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: the file holds {found}, and the manifest says {named}",
        "The package is damaged: build it again.",
    ),
    "VP5017": Diagnostic(
        ExitStatus.PACKAGE,
        "program {name}: the manifest names {named}, and active in the shaders are {found}",
        "The package is damaged: build it again.",
    ),
    "VP5018": Diagnostic(
        ExitStatus.PACKAGE,
        "{package}: nothing in it draws level {level} with the transfer function {transfer}. It can draw {known}",
        "Ask for one of these, or build the package with the stages transfer, texture or mosaic, and shaders.",
    ),
    "VP5019": Diagnostic(
        ExitStatus.RENDER,
        "a step of {step_mm} mm is not possible here: {reason}",
        "Choose another step.",
    ),
    "VP5020": Diagnostic(
        ExitStatus.RENDER,
        "no camera can be made from {what}",
        "Give numbers, with the eye away from the middle of the volume.",
    ),
    "VP5021": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: cannot write the picture: {error}",
        "Check that the folder exists and can be written.",
    ),
    "VP5022": Diagnostic(ExitStatus.USAGE, "there is no view {name}", "Name one of: {known}; or give an eye."),
    "VP5023": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: transfer functions of this package are not editable",
        "Build it from a scene with editable = true.",
    ),
    # VP6xxx validation and report
    "VP6001": Diagnostic(
        ExitStatus.SOURCE,
        "voxel [z {z}, y {y}, x {x}] is {value}: the field around it is not defined, so there is no true picture",
        "Replace values that are not finite before you convert the volume.",
    ),
    "VP6010": Diagnostic(
        ExitStatus.PACKAGE,
        "{path}: the package is not whole: {findings}",
        "{remedy}",
    ),
    "VP6011": Diagnostic(
        ExitStatus.TOLERANCE,
        "{path}: {failed} of {views} views are beyond the tolerance; the worst is {view} of program {program}: RMSE "
        "{rmse:.4g} of {rmse_allowed:g}, largest error {maximum:.4g} of {maximum_allowed:g}; RMSE {data:.2g} comes "
        "from the data, {drawing:.2g} from drawing",
        "See {report}. Against an error of the data: a profile that holds a finer level, quantize.bits = 16. Against "
        "one of drawing: render.classification lookup or preintegrated if it is another, a smaller render.step_voxels, "
        "a larger render.opacity_cutoff. Or allow more in [tolerance].",
    ),
    "VP6012": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the scan that the package was made from is not known: {path}.origin.json is missing",
        "Name the scan, or the scene, with --source.",
    ),
    "VP6013": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: not the scan that package {package} was made from: its digest is {found}…, the package's {expected}…",
        "Name the right scan with --source, or build the package again.",
    ),
    "VP6014": Diagnostic(
        ExitStatus.SCENE,
        "{path}: its shaders light labels, and there is no true picture of lit labels to compare with: their normals "
        "depend on how they are numbered",
        "Validate a package of the same scene without render.lighting.",
    ),
    "VP6015": Diagnostic(
        ExitStatus.TOLERANCE,
        "{path}: the skip table or the proxy mesh of {programs} changes a picture, although rays may leave out only "
        "samples that show nothing",
        "See {report}. Build the package again; if that does not help, skip.kind none and no [proxy] do without both, "
        "and this is a defect of volprep.",
    ),
    "VP6016": Diagnostic(
        ExitStatus.TOLERANCE,
        "{path}: {failed} of {views} views are beyond the tolerance; the worst is {view} of {program}: RMSE {rmse:.4g} "
        "of {rmse_allowed:g}, largest error {maximum:.4g} of {maximum_allowed:g}. Slices are classified before they "
        "are filtered, and have no step to refine: of view {part_view}, their texels alone are {texels:.2g} off, the "
        "angle adds {angle:.2g}, 8 bits {target:.2g}",
        "See {report}. A transfer function with softer edges comes nearer; steep ones cannot without shaders. Say in "
        "[tolerance] what is good enough for such devices.",
    ),
    "VP6017": Diagnostic(
        ExitStatus.SCENE,
        "profile {profile} has no shaders: stacks of slices have neither a step nor a float target to be tried with",
        "Choose a profile of OpenGL ES 2 or 3 with --profile.",
    ),
    "VP6018": Diagnostic(
        ExitStatus.TOLERANCE,
        "{failed} of {cases} cases are not drawn as they must be, the first is {case}: {problem}",
        "See {report}. This driver, or volprep, is wrong where arithmetic is hard.",
    ),
    "VP6020": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: not replaced by the report, because {problem}",
        "Name another folder with --report, or move what is there.",
    ),
    "VP6021": Diagnostic(
        ExitStatus.OUTPUT,
        "{path}: cannot write the report: {error}",
        "Make room, or name another folder with --report.",
    ),
    # VP7xxx machine
    "VP7001": Diagnostic(
        ExitStatus.MACHINE,
        "this machine cannot turn a scan into a validated package; missing: {missing}",
        "The lines marked missing say how to get each.",
    ),
    # VP9xxx defects
    "VP9001": Diagnostic(
        ExitStatus.INTERNAL,
        "internal error: {error}",
        "This is a defect in volprep. Run again with VOLPREP_TRACEBACK=1 and report what it prints.",
    ),
}


class VolprepError(Exception):
    """An error with a permanent code. `fields` fill the catalogue's texts; its message is code, summary, remedy."""

    def __init__(self, code: str, **fields: object) -> None:
        entry = CATALOGUE[code]
        self.code = code
        self.fields = fields
        self.status = entry.status
        self.summary = entry.summary.format(**fields)
        self.remedy = entry.remedy.format(**fields)
        super().__init__(f"{code} {self.summary}. {self.remedy}")
