"""Geometry of DICOM series, and sources whose files say little of it: VP2xxx."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP2001 SOURCE {folder}: slices differ in size: {first} pixels, {other}
    Move the images that do not belong to the volume out of the folder.
VP2002 SOURCE {folder}: slices differ in pixel spacing: {first} mm, {other} mm
    Move the images that do not belong to the volume out of the folder.
VP2003 SOURCE {folder}: {count} of {total} slices have another orientation than {first}; {other} is turned by \
{angle:.2f}°
    Move the images that do not belong to the volume (localisers, reformats) out of the folder. Split a file that holds
    both.
VP2004 SOURCE {path}: ImageOrientationPatient must be two unit vectors at a right angle, but is off by \
{deviation:.3g}; rounding explains only {tolerance:g}
    Export the series again, or choose another series.
VP2005 SOURCE {folder}: {several} of {places} places hold more than one image (up to {each}); the first are {first} \
and {second}, both at ({position}) mm; {differ}
    Keep only one image at each place.
VP2006 SOURCE {folder}: there are {each} images at each of {places} places: several volumes (echoes, phases, time \
points), or copies; the first are {first} and {second}, both at ({position}) mm; {differ}
    {how}
VP2007 SOURCE {folder}: the gantry was tilted by {angles}: the slices lie {pitch_mm:.3f} mm apart along their normal, \
but {step_mm:.3f} mm along the line from slice to slice, and shift sideways by {total_mm:.2f} mm in all
    Set source.repair = ["tilt"], or use --repair tilt, to remove the tilt by linear interpolation within the slices.
VP2008 SOURCE {folder}: {name} (slice {slice}) lies {shift_mm:.3f} mm beside the line of the other slices; rounding \
explains only {tolerance_mm:.3f} mm
    Check whether the patient or table moved, or whether the slice belongs to another series.
VP2014 SOURCE {folder}: {missing} missing slice(s) between {below} and {above}: the gap is {gap_mm:.3f} mm, the usual \
distance is {usual_mm:.3f} mm; number of such gaps: {holes}
    Copy the whole series again; or set source.repair = ["gaps"], or use --repair gaps, to interpolate between the
    neighbours.
VP2015 SOURCE {folder}: uneven slice distances, from {least_mm:.3f} to {gap_mm:.3f} mm, usually {usual_mm:.3f} mm; the \
largest is between {below} and {above}; slices lie up to {off_mm:.3f} mm from even places, rounding explains only \
{tolerance_mm:.3f} mm
    Set source.repair = ["gaps"], or use --repair gaps, to interpolate slices at even distances; or remove the slices
    that are wrong.
VP2016 SOURCE {path}: the repaired volume would have {size} voxels: more than {growth} times the slices, rows or \
columns of the scan
    Check the positions of the slices. Whole parts of the scan may be missing.
VP2017 SOURCE {path}: there is no volume {volume}; the series holds {count}
    Set source.volume to a number from 1 to {count}, or leave it out.
VP2020 SOURCE {path}: the volume is sheared: its axes deviate from right angles by {angle:.3f}°
    Resample the volume to a grid with right angles first: with Resample Scalar Volume of 3D Slicer, or with
    nibabel.processing.resample_to_output in Python. --repair is for slices of DICOM.
VP2021 SOURCE {path}: the {which} of the file does not give the voxels a usable place or size
    Repair the header, or resample the volume.
VP2022 SOURCE {folder}: the images are {stacks} stacks (of {sizes} slices), which differ in {differ}; together they \
are not one volume: {cause}
    Choose one with --volume, or source.volume in a scene, from 1 to {volumes}; volumes of the first stack come first.
VP2082 SOURCE {path}: the mask has voxels that are NaN, in slice {z}: they are neither inside nor outside
    Replace NaN in the mask by 0 or by another number.
VP2083 SOURCE {path}: the folder holds {count} volume file(s), and no DICOM images
    Name one of the files, or read them as a time series with --frames all. A folder of masks holds the segments of a
    scan: volprep build SCAN --segments FOLDER.
VP2084 SOURCE {path}: the folder holds files of an OME-TIFF of {files} files, and {others} other picture(s)
    Name one of the files of the OME-TIFF, or move the other pictures out of the folder.
""")
