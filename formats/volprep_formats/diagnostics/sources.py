"""Sources and their readers: VP1xxx."""

from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus

ENTRIES: dict[str, Diagnostic] = {
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
    "VP1047": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the compressed picture is cut off: its end marker, or coded data before it, are missing",
        "Copy the series again from where it came. Do not just remove the file: a slice would be missing.",
    ),
    "VP1048": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the header says {syntax}, which is coded as {wanted}, but the compressed data are {actual}",
        "The file is damaged or was converted wrongly; export the series again as Explicit VR Little Endian.",
    ),
    "VP1049": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the header says {stored} values (BitsStored, PixelRepresentation), but the compressed data are "
        "{precision} ones from {low} to {high}",
        "The header is wrong, or its bits are ambiguous; export the series again as Explicit VR Little Endian.",
    ),
    "VP1050": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: the table of values (ModalityLUTSequence) {what}",
        "Export the series again, or choose another series.",
    ),
    "VP1051": Diagnostic(
        ExitStatus.SOURCE,
        "{folder}: the slices of the series lie in {count} frames of reference (FrameOfReferenceUID), as {first} and "
        "{other} do, so their positions have nothing to do with each other",
        "Put the slices of each frame of reference into a folder of their own.",
    ),
    "VP1052": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {keyword} is not a UID, which has digits and dots only, 64 characters at most",
        "The file is damaged or hostile; export the series again.",
    ),
    "VP1071": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: its decoder opens only files whose path is UTF-8",
        "Rename the file, or the folder that the message shows with \\x in its name.",
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
        "Convert them to one file of 8, 16 or floating-point 32 bits for each slice, with 0 as black.",
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
    "VP1260": Diagnostic(
        ExitStatus.SOURCE,
        "{path}: {missing} of the {files} chunks of the volume are missing, more than {limit}",
        'Copy the store again, whole. If the chunks were left out because they are empty, write missing = "fill" in '
        "[source].",
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
}
