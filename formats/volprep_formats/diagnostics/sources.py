"""Sources and their readers: VP1xxx."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP1001 SOURCE {path}: no such file or folder
    Check the path that you gave, on the command line or in [source] of a scene.
VP1002 SOURCE {path}: {problem}
    Check that the file is complete. If its format is one of these, set source.format in a scene: {known}. A raw file
    also needs the table [source.raw].
VP1003 SOURCE {path}: cannot be read: {error}
    Check the file and its permissions.
VP1004 SOURCE {path}: source.{key} is set, but the source is read as {format}
    Leave source.{key} out, or correct source.format.
VP1005 SOURCE {path}: the compressed data cannot be unpacked: {error}
    The file is damaged or incomplete; get it again from where it came.
VP1006 SOURCE {path}: the header names the data file {name!r}, which {problem}
    Put both files into one folder, with the names under which they were written.
VP1007 SOURCE {path}: the data are text, and {text!r} in them is not a number of type {dtype}
    The file is damaged or its header is wrong; get it again from where it came.
VP1008 SOURCE {path}: the header declares {expected} bytes of voxels, but the data have, or can unpack to, {actual}
    The file is incomplete or its header is wrong; get it again from where it came.
VP1010 SOURCE {path}: a file without a header says nothing about its shape
    Add the table [source.raw] with shape_zyx and dtype to a scene.
VP1011 SOURCE {path}: {declared} needs exactly {expected} bytes, but the file has {actual}: {hint}
    Correct [source.raw], or get the complete file.
VP1020 SOURCE {path}: not a valid NIfTI file: {error}
    Get the file again from where it came.
VP1021 SOURCE {path}: the file has {shape} values along x, y, z, ...; {problem}
    Use --volume N, or source.volume in a scene, with a number from 1 to {volumes}. If they are frames of a time series,
    use --frames all.
VP1022 SOURCE {path}: voxels of NIfTI type {dtype} cannot be read as one grey value each
    Convert the file to an integer or floating-point type.
VP1030 SOURCE {path}: there are no DICOM images (other files: {files})
    Name the folder that holds the series; or, if the scan is not a DICOM series, the file itself.
VP1031 SOURCE {path}: the DICOM file is cut off: {what}
    Copy the series again from where it came. Do not simply remove the file: a slice would be missing.
VP1032 SOURCE {path}: the file begins like DICOM, but cannot be parsed ({error})
    Copy the series again from where it came. Move the file away only if it belongs to no series here.
VP1033 SOURCE {path}: the folder holds {count} DICOM series, and it is not clear which one is meant
    Set source.series in the scene, or --series, to the number of one of these, or to a unique ending of its UID;
    volprep import FOLDER --list describes them:{found}
VP1034 SOURCE {path}: {fits} here ends with {wanted!r}
    Set source.series in the scene, or --series, to one of these or to a unique ending of it:{found}
VP1035 SOURCE {path}: the image is in colour ({kind}); a volume needs one grey value in each pixel
    Choose the grey series that this picture was made from, keep colours with a table [colour] in the scene, or make
    them grey with rgb = "luminance" in [source], or --rgb luminance. Palettes, big-endian colours and more than 16 bits
    are not read.
VP1036 SOURCE {path}: the attribute {keyword} is missing, so the place or the values of this slice are not known
    Export the series again with all its attributes, or choose another series.
VP1037 SOURCE {path}: the value of {keyword} is not {wanted}
    Export the series again, or choose another series.
VP1038 MACHINE {path}: no decoder for the transfer syntax {syntax} ({missing})
    Install the decoder, or export the series as Explicit VR Little Endian.
VP1039 SOURCE {path}: the pixel data cannot be decoded as {syntax} ({error})
    The file is damaged; copy the series again from where it came.
VP1040 SOURCE {path}: the header declares {columns}×{rows} pixels of {bits} bits, which are {expected} bytes, but the \
pixel data have {actual}
    The file is damaged; copy the series again from where it came.
VP1041 SOURCE {path}: the file holds {frames} frames, and {what}
    Export the series as single-frame images, or as enhanced multi-frame images with functional groups.
VP1042 SOURCE {path}: this is a Siemens mosaic, many slices in one picture, but {what}
    Export the series with its private attributes, or as single-frame images.
VP1043 SOURCE {path}: {bits} cannot be read; integers of 8, 16 and 32 bits and floating point of 32 and 64 bits can
    Export the series with 16-bit pixels.
VP1044 SOURCE {path}: the header declares {columns}×{rows} pixels, more than the {limit} that a slice may have
    The file is damaged or hostile; copy the series again from where it came.
VP1045 SOURCE {path}: the header declares {frames} frames, which need {expected}, but the pixel data have {actual}
    The file is damaged; copy the series again from where it came.
VP1046 SOURCE {path}: the header declares {columns}×{rows} pixels of 1 value, but the compressed data declare {actual}
    The file is damaged; copy the series again from where it came.
VP1047 SOURCE {path}: the compressed picture is cut off: its end marker, or coded data before it, are missing
    Copy the series again from where it came. Do not simply remove the file: a slice would be missing.
VP1048 SOURCE {path}: the header says {syntax}, which is coded as {wanted}, but the compressed data are {actual}
    The file is damaged or was converted wrongly; export the series again as Explicit VR Little Endian.
VP1049 SOURCE {path}: the header says {stored} values (BitsStored, PixelRepresentation), but the compressed data are \
{precision} ones from {low} to {high}
    The header is wrong, or its bits are ambiguous; export the series again as Explicit VR Little Endian.
VP1050 SOURCE {path}: the table of values (ModalityLUTSequence) {what}
    Export the series again, or choose another series.
VP1051 SOURCE {folder}: the slices of the series lie in {count} frames of reference (FrameOfReferenceUID), as {first} \
and {other} do, so their positions have nothing to do with each other
    Put the slices of each frame of reference into a folder of their own.
VP1052 SOURCE {path}: {keyword} is not a UID, which has digits and dots only, 64 characters at most
    The file is damaged or hostile; export the series again.
VP1053 SOURCE {path}: a DICOM segmentation (SEG) has segments of a scan, and no grey values
    Build the scan, and give the segmentation with --segments FILE, or in [segments] of a scene.
VP1071 SOURCE {path}: its decoder opens only files whose path is UTF-8
    Rename the file, or the folder that the message shows with \\x in its name.
VP1080 OUTPUT {path}: it exists already and is not an empty folder
    Choose another folder, or remove this one.
VP1081 OUTPUT {path}: cannot be written: {error}
    Check the disk and the permissions.
VP1082 OUTPUT {path}: the volume holds values that are not finite, which DICOM cannot store
    Replace NaN and infinite values first.
VP1090 SOURCE the source has {count} voxels that are NaN or infinite, the first in slice {z}
    Write nan = VALUE or nan = "outside" in [source], or replace them in the source: they have no colour.
VP1100 SOURCE {path}: not a valid NRRD file: {error}
    Get the file again from where it came, or correct its header.
VP1101 SOURCE {path}: axis {axis} of the NRRD file (kind {kind}) has {size} values for each voxel; one is needed
    Use --volume N, or source.volume in a scene, with a number from 1 to {size}, or keep colours with a table [colour].
    If they are frames of a time series, use --frames all.
VP1102 SOURCE {path}: NRRD files with {what} cannot be read
    Write the volume into one file of numbers, raw, gzipped, bzipped or as text.
VP1103 SOURCE {path}: {what} of the NRRD file cannot be converted to positions in the patient
    Write the file with space left-posterior-superior, space directions and space origin, in millimetres.
VP1120 SOURCE {path}: not a valid MetaImage file: {error}
    Get the file again from where it came, or correct its header.
VP1121 SOURCE {path}: the MetaImage file has {what}; one value at each place of a volume is needed
    Use --volume N, or source.volume in a scene, with the number of a volume or channel, from 1 on; or keep colours with
    a table [colour]. If they are frames of a time series, use --frames all.
VP1122 SOURCE {path}: MetaImage files with {what} cannot be read
    Write the volume into one file of numbers, with its header or beside it.
VP1140 SOURCE {path}: not a valid VTK file: {error}
    Get the file again from where it came, or write it again.
VP1141 SOURCE {path}: the VTK file has {problem}; one number at each point of a volume is needed
    Write the wanted array as the scalars of the points; or keep colours with a table [colour] in the scene.
VP1142 SOURCE {path}: VTK files with {what} cannot be read
    Write one piece of image data with numbers as its scalars, uncompressed or compressed with zlib.
VP1160 SOURCE {path}: there are no pictures
    Set source.path to the folder that directly holds the pictures. Files ending in {known} count as pictures.
VP1161 SOURCE {path}: the names of the pictures do not give their order: {first} and {other} {how}
    Keep only the pictures of one volume in the folder, with names that differ only in one number.
VP1162 SOURCE {path}: {count} picture(s) missing between {first} and {last}, by their numbers: {missing}
    Copy the whole stack again; or, if the numbers mean nothing, set source.stack.gaps = "ignore".
VP1163 SOURCE {path}: {count} of {total} pictures differ from the rest: {first}, but {other}
    Remove pictures that do not belong to the volume, or convert all to one size and type.
VP1164 SOURCE {path}: the picture has {what}; a volume needs one grey value in each pixel
    Keep the colours with a table [colour] in the scene, or make them grey: rgb = "luminance" in [source], or --rgb
    luminance.
VP1165 SOURCE {path}: not a valid picture: {error}
    The file is damaged or incomplete; get it again from where it came.
VP1166 SOURCE {path}: pictures with {what} cannot be read
    Convert them to one file of 8, 16 or floating-point 32 bits for each slice, with 0 as black, uncompressed or with
    LZW or Deflate.
VP1167 SOURCE {path}: page {page} declares {columns}×{rows} pixels: more than {limit}, or than a file of {size} bytes \
can hold
    The file is damaged or hostile; get it again from where it came.
VP1168 SOURCE {path}: its {pages} page(s) are not the slices of one volume: the file declares {says}
    Write one channel and one time point into a file of its own, with one page for each slice.
VP1180 SOURCE {path}: a mosaic does not say how many tiles it has
    Add the table [source.mosaic] with tiles_x, tiles_y and slices to the scene.
VP1181 SOURCE {path}: {slices} slices do not fit into {tiles_x}×{tiles_y} tiles of a picture of {columns}×{rows} pixels
    Correct the table [source.mosaic].
VP1200 SOURCE {path}: not a valid OpenVDB file: {error}
    Get the file again from where it came, or write it again with OpenVDB 5 or later.
VP1201 MACHINE {path}: this build of volprep has no OpenVDB ({error})
    Install libopenvdb-dev, libtbb-dev and libboost-dev (Debian), then build volprep again.
VP1202 SOURCE {path}: the file holds {count} OpenVDB grids, and it is not clear which one is meant
    Set source.grid to the name of a grid of floats or doubles:{found}
VP1203 SOURCE {path}: the voxels of the grid {grid!r} are of type {kind}, but must be one float or double each
    Set source.grid to a grid of numbers, or to one of colours (vec3s) with a table [colour]. Convert points and masks
    to such a grid first.
VP1204 SOURCE {path}: the grid {grid!r} has no active voxel, so it has no extent
    Set source.grid to another grid.
VP1205 SOURCE {path}: the active voxels of the grid {grid!r} span {size}, more than the {limit} that a volume may have
    Remove stray voxels, clip the grid, or resample it to larger voxels.
VP1220 SOURCE {path}: not a valid OME-TIFF or OME-Zarr: {error}
    Get it again from where it came, or write it again.
VP1221 SOURCE {path}: the file holds {count} {kind}s, and nothing says which one is meant
    Time points make a time series with --frames all. Set source.{key}, or --{key}, to the name or number of one:{found}
VP1222 SOURCE {path}: the file holds no {kind} {wanted}, or several
    Set source.{key} to the name or the number of one:{found}
VP1224 SOURCE {path}: the file holds {what}, which volprep does not read
    Write it again with integers or floating point, in the current version of its format, with common compression.
VP1225 SOURCE {path}: the file declares {size}; that is more than {limit}
    Choose a coarser level with source.level if there is one. Else the file is damaged or hostile.
VP1226 SOURCE {path}: the file refers to {name!r}, which lies outside of it
    Do not trust this file. A valid file refers only to data in it or beside it.
VP1227 SOURCE {path}: the file gives {found} along {axis}, although it gives the other sizes
    Correct the physical size of the voxels in the program that wrote the file.
VP1240 SOURCE {path}: channel {name} is not registered with channel {first}: {difference}
    If another program has registered the two, give its file or its matrix as transform in [[source.channels]], or as
    --transform; or resample {name} onto the grid of {first}. Channels may have grids of their own if their files place
    them in one space: DICOM series with one FrameOfReferenceUID, or NIfTI, NRRD, MetaImage, MGH, MINC, MRtrix files.
VP1241 SCENE {path}: a transfer function is for channel {wanted}, which the source does not have
    Set transfer.channel to one of: {found}.
VP1242 SCENE {path}: source.channels is "all", but {format} files have one channel
    Leave source.channels out, or list the files of the channels in [[source.channels]].
VP1243 SCENE {path}: the scene lists a file for each channel, so one path or setting on the command line cannot \
replace them
    Change the paths or settings in the scene.
VP1244 SCENE {path}: {what} cannot be made of a volume of several channels
    Leave that out, or use transfer functions of only one channel in the scene.
VP1245 SCENE {path}: the picture {name} cannot be drawn: {reason}
    Leave [together] out, name other transfer functions in it, or change what the message names.
VP1246 SCENE {path}: channel {name} has a grid of its own, which does not go with {what}
    Leave that out, or resample {name} onto the grid of the first channel before the build.
VP1247 SOURCE {path}: this registration cannot be used: {reason}
    A registration is an affine map of ITK (.tfm, .txt, .h5, or .mat of ANTs), a matrix of FLIRT between two NIfTI
    files, or a DICOM Spatial Registration of both scans. Or write its matrix into the scene as transform.
VP1248 PACKAGE {path}: the channels {names} lie on several grids, and one file of several channels has one
    Write one channel: --channel NAME.
VP1250 PACKAGE {path}: the package holds no level {level}, only: {found}
    Choose one of these. volprep inspect shows them.
VP1251 OUTPUT {path}: a file of this name exists
    Choose another name, or replace the file with --force.
VP1252 OUTPUT {path}: the ending does not name a format that can be written
    Use .nii, .nii.gz, .nrrd, .raw, .vdb or .ome.zarr for values, .seg.nrrd, .nii.gz with --labels or .dcm with --series
    for segments, .glb, .usdz, .stl or .ply for surfaces, .glb with --volume for voxels, .json for looks. A name without
    an ending becomes a folder of DICOM files.
VP1253 PACKAGE {path}: the package holds the colours that its transfer functions make of the scan, but no values
    Export the scan itself: volprep import makes a draft of it, and volprep export writes that. Or build the scene for a
    profile with shaders, and classify samples rather than voxels.
VP1254 OUTPUT {path}: a folder of this name exists
    Choose another name. --force replaces a folder only if it is an OME-Zarr store that volprep export wrote and that
    holds nothing else.
VP1255 OUTPUT {path}: the voxels need {needed} bytes, and a glTF binary holds {most}
    Choose a coarser level with --level, one channel with --channel, or another format.
VP1260 SOURCE {path}: {missing} of the {files} chunks of the volume are missing, more than {limit}
    Copy the store again, whole. If the chunks were left out because they are empty, write missing = "fill" in [source].
VP1270 SOURCE {path}: its decoder crashed ({how}); it ran in a separate process with {limit_mb:.0f} MB of memory
    The file is damaged or hostile; get it again from where it came.
VP1271 SOURCE {path}: its decoder was stopped, because it had not finished after {limit_s:.0f} s of {of}
    The file is damaged or hostile; get it again from where it came.
VP1272 SOURCE {path}: its decoder asked for more than the {limit_mb:.0f} MB of memory that a valid file needs
    The file is damaged or hostile; get it again from where it came.
VP1273 MACHINE {path}: no process can be started to decode it: {error}
    Check how much memory and how many processes this machine allows: ulimit -a.
VP1280 SOURCE {path}: not a valid FreeSurfer volume: {error}
    The file is damaged; get it again from where it came.
VP1281 SOURCE {path}: not a valid NumPy file: {error}
    The file is damaged; write it again with numpy.save or numpy.savez.
VP1282 SOURCE {path}: the array has {what}; a volume needs three axes z, y, x of integers or floating-point numbers
    Save one volume of numbers: numpy.save(file, array). If its first axis is time, use --frames all.
VP1283 SOURCE {path}: the array lies in Fortran order, so that slabs of z are spread over the whole file
    Save it in C order: numpy.save(file, numpy.ascontiguousarray(array)).
VP1284 SOURCE {path}: {fits} arrays fit, and one is needed; the file holds: {found}
    Set name in [source.array] to one of them.
VP1285 SOURCE {path}: not a valid Analyze header: {error}
    The file is damaged; get it again from where it came.
VP1286 SOURCE {path}: no voxel of type {type} has the value {value}: they go from {low} to {high} in steps of {step}
    Set source.outside or source.nan to one of these values.
VP1287 SOURCE {path}: the mask does not lie on the voxels of the scan: {difference}
    Resample the mask onto the grid of the scan, and do not crop it.
VP1288 SOURCE {folder}: {problem}
    Keep only the raw slices of one volume in the folder, NAME.1, NAME.2 and so on, or correct [source.raw].
VP1289 SOURCE {path}: this is {what}, which is not read
    {how}
VP1290 SOURCE {path}: no colours for a volume in colour: {problem}
    Choose another colour.extinction, convert to RGB or RGBA (uint8, uint16, floats from 0 to 1), or leave [colour] out.
VP1291 SOURCE {path}: not a valid MRtrix image: {error}
    Get the file again from where it came, or correct its header.
VP1292 SOURCE {path}: MRtrix images with {what} cannot be read
    Write one volume into one file: mrconvert IN.mif -coord 3 0 -datatype float32 OUT.nii.gz.
""")
