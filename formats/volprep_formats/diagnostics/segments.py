"""Segmentations: VP14xx when they are read, VP322x and VP323x when a scene asks for them."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP1400 SOURCE {path}: not a usable segmentation: {problem}
    The file is damaged, or written against the standard; export it again.
VP1401 SOURCE {path}: it has {count} segments; from 1 to {most} can be read
    Check that this is a segmentation: a label volume has whole numbers, 0 for the background, and a folder has one mask
    for each segment.
VP1402 SOURCE {path}: {layers} layer(s) of {size} voxels are more than the {most} that segments of this scan may have
    Crop the segmentation, or merge segments that overlap.
VP1403 SOURCE {path}: the frames are compressed (transfer syntax {syntax}), which is not read for segmentations
    Decompress the file, for example with dcmdjpeg or gdcmconv --raw.
VP1404 SOURCE {path}: its frames need {expected} bytes of pixels, but the file has {actual}
    The file is incomplete; copy it again from where it came.
VP1405 SOURCE {path}: the frames form no grid: {problem}
    Export the segmentation on one regular grid.
VP1406 SOURCE {path}: its structures lie in {count} different frames of reference
    Export the structures of one scan.
VP1407 SOURCE {path}: slice {z} has the value {value:g}, which is not a label: labels are whole numbers from 0 to 2^53
    Check that this is the label volume and not the scan.
VP1408 SOURCE {path}: the masks of the folder lie on different grids: {found}; {first} has {expected}
    Resample the masks onto one grid.
VP1409 SOURCE {path}: the folder holds {count} DICOM objects, and one segmentation is needed
    Name the file of the segmentation.
VP1410 SOURCE {path}: the segmentation lies in another frame of reference (…{own}) than the scan (…{scan})
    Use the segmentation of this scan, or register it and export it in the frame of the scan.
VP1411 SOURCE {path}: the segmentation does not lie on the scan: {difference}. Segmentation: {own}; scan: {scan}
    Use the segmentation of this scan, or resample it onto the grid of the scan.
VP1412 SOURCE {path}: contour {contour} of segment {number} does not lie in a slice of the scan: its points are up to \
{off_mm:.3g} mm off one plane, or the plane is turned by {angle:.2f}° against the slices
    Use the series on which the contours were drawn.
VP1413 SOURCE {path}: overlaps of segments make {count} combinations; {most} labels can be drawn
    Leave segments out of the file, or make segments that do not overlap.
VP1414 SOURCE {path}: the file has {shape} values along x, y, z, ...; one volume of labels is needed
    Write each volume into a file of its own. A folder of masks, one for each segment, is a segmentation, too.
VP1415 SOURCE {path}: slice {z} has the value {value:g}; a mask has 0 outside, and one number or fractions up to 1 \
inside
    Move files that are no masks, such as the scan, out of the folder.
VP1416 SOURCE {path}: the store has {count} label images, and one is needed: {names}
    Name the folder of one of them, STORE/labels/NAME.
VP3220 SCENE {path}: a scan with its segments is not drawn with {what}; {instead}
    Change this setting, or leave [segments] out of the scene.
VP3222 SCENE {path}: a segments.style names {label!r}, which no segment has as its number, name or code; numbers are \
{numbers}
    Correct the name, or leave it out.
VP3223 SCENE {path}: segments name the transfer function {name!r}; the scene has {known}
    Name one of these, or add a [[transfer]] of that name.
VP3224 SCENE {path}: a scan with segments in {styles} styles takes {count} textures; the profile has {limit} units
    Let segments share transfer functions, or set render.classification to control-points, which takes no textures.
VP3225 SCENE {path}: segments.smoothing_mm is {width:g}, wider than the {widest:.4g} mm that its voxels allow
    Choose a narrower one: its Gaussian may reach a quarter of each axis, or eight voxels.
VP3290 SOURCE {path}: more than {most} segments overlap in one voxel
    Leave segments out of the file, or make segments that do not overlap.
VP3291 SOURCE {path}: its contours are too intricate: on the grid of the scan they take {work} steps, {most} are allowed
    Export fewer structures, or simpler contours: these cross the slices of the scan again and again.
""")
