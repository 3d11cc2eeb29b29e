"""Recognition of scans, tables of labels, and segments that leave a package: VP1300 to VP1349."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP1300 SOURCE {path}: not a table of labels: {problem}
    Use a table of FreeSurfer, 3D Slicer, ITK-SNAP, BIDS, FSL or SPM, or lines of number and name. Without
    --label-table, volprep chooses the colours of labels.
VP1301 SOURCE {path}: not an MRC or CCP4 map that can be read: {problem}
    Write it as a map of floats with right angles, for example with e2proc3d.py, IMOD's newstack or ChimeraX.
VP1302 SOURCE {path}: {count} series have the number {wanted}
    Set source.series in the scene, or --series, to one of these or to a unique ending of it:{found}
VP1303 OUTPUT {path}: holds a package of another scan or scene, which is not replaced
    Name another output, or replace it with --force.
VP1304 SOURCE {path}: not a MINC volume that can be read: {problem}
    Get the file again from where it came, or write it again with mincconvert or mincresample (MINC toolkit).
VP1305 SOURCE {path}: a MINC 2 file, for which h5py is needed
    To add it: {how}. Or convert the file with mincconvert -1.
VP1306 SOURCE {address}: this command reads files of this machine, not addresses
    Download the scan first, and name the file. volprep batch takes addresses of stores: s3://, gs:// and others.
VP1307 SOURCE the scan has a label with the number {number}, and numbers up to {most} are exact
    Renumber the labels in the source, for example with skimage.segmentation.relabel_sequential.
VP1308 SOURCE {path}: a picture of {shape} values with {count} axes in space; a volume has 3
    Name the file of the volume. The pictures of one volume, saved as PNG or TIFF in a folder of their own, are a scan,
    too.
VP1309 SOURCE {path}: there are no DICOM images, and each of the {files} files is {what}
    {how}
VP1310 SOURCE {path}: it has {count} {axis}, more than the {most} that a volume may have
    The header is damaged, or its axes are exchanged. Cut a longer volume into parts.
VP1330 PACKAGE {path}: the package holds no labels
    Choose a package with segments or of a label map. A draft has none yet.
VP1331 SOURCE {path}: holds {problem}, and a segmentation belongs to one
    Give the folder that holds the DICOM files of the series, and nothing else.
VP1332 SOURCE {path}: the package has other voxels than this series: they are off by {off} voxels
    Give the series that the package was made of, and level 0. Packages of repaired slices have voxels of their own.
VP1333 PACKAGE {path}: the picture shows no surface: {reason}
    Choose a transfer function of a compositing that accumulates opacity or shows an isovalue, and that is opaque
    somewhere.
VP1334 SOURCE {path}: there is nothing to judge: {problem}
    Give a pyramid of several levels, and a scene with transfer functions over its values.
VP1340 SOURCE {path}: the volumes of the file are not frames of a time series: {what}
    Choose one with --volume N, or source.volume in a scene.
VP1341 SOURCE {path}: {wanted} chooses {chosen} frames of a series of {count}; a package has 1 to {most}
    Use --frames all, --frames N for every so many, or --frames FIRST:LAST[:STEP] with numbers from 1 to {count}.
VP1342 SOURCE {path}: frame {number} of the series differs from the first one: {difference}
    Give all frames the same grid, type and scale.
VP1343 SOURCE {path}: the time points of the series are not complete: {what}
    Add the missing images, or keep only complete time points in the folder. If the images of a place follow each other
    by InstanceNumber, give --volumes-by number.
""")
