"""Packages and drafts: VP4xxx."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP4001 PACKAGE {path}: no such package
    Check the path.
VP4002 PACKAGE {path}: not a volume package: {problem}
    Name the folder that volprep build wrote, or the file of volprep zip.
VP4003 PACKAGE {path}: the package has version {version} of the format, but this volprep reads {known}
    Use the volprep that wrote the package, or build the package again.
VP4004 PACKAGE {path}: the manifest breaks the schema: {problems}
    Build the package again.
VP4005 PACKAGE {path}: the package is a draft, still under construction
    Run volprep stage seal on it. That finishes the package, or names the stage that is missing.
VP4006 PACKAGE {path}: the package is sealed and cannot change
    Build it again with volprep build, or begin a new draft.
VP4007 PACKAGE {path}: cannot read {file}: {error}
    Copy the package again, or build it again.
VP4008 PACKAGE {path}: {file} has {size} bytes instead of {expected}
    Copy the package again, or build it again.
VP4009 PACKAGE {path}: {file} is damaged: its SHA-256 is not the one in the manifest
    Copy the package again, or build it again.
VP4010 PACKAGE {path}: the manifest does not name {file}
    Move the file out of the package.
VP4011 PACKAGE {path}: the package contradicts itself: {problem}
    Build the package again.
VP4012 PACKAGE {path}: another process is working on this draft
    Wait until that process has ended.
VP4014 PACKAGE {path}: the package has no file {file}
    volprep inspect lists the files that it has.
VP4020 OUTPUT {path}: cannot write: {error}
    Free disk space, or name an output that can be written.
VP4021 OUTPUT {path}: not replaced: {problem}
    Name another output, or move the existing one.
VP4022 OUTPUT {path}: not replaced, because it holds {count} file(s) that do not belong to the package; the first is \
{first}
    Move these files, or name another output.
VP4023 OUTPUT {path}: a new draft needs an empty folder
    Name another output, or move the existing one.
VP4030 PACKAGE {name}: not a KTX 2 texture of the kind that packages hold: {problem}
    Build the package again.
VP4031 PACKAGE {path}: not a paletted texture: {problem}
    Build the package again.
VP4032 PACKAGE {path}: not a joint histogram: {problem}
    Build the package again.
VP4039 PACKAGE {name}: not a mesh of the kind that packages hold: {problem}
    Build the package again.
VP4040 PACKAGE {path}: stage {stage} needs stage {missing}, which has not run since its settings or its inputs changed
    Run volprep stage {missing} on the draft first.
VP4041 OUTPUT {path}: another build is making this package
    Wait until it is done, or stop it.
VP4042 INTERNAL the package that was built is not sound: {finding}
    This is a defect in volprep. Report it with the scene. The old package, if there was one, is untouched.
VP4043 PACKAGE {path}: cannot tell where the package came from: {problem}
    Remove this file and name the source with --source, or build again.
VP4044 PACKAGE {path}: the package is one file already
    Copy it, or unzip it to get the folder back.
VP4050 PACKAGE {path}: the package has no sub-volumes to cut from
    Build it from a scene with a table [grid].
VP4051 USAGE {path}: the center {center} lies outside the volume of {shape} voxels, x × y × z
    Give a voxel, counted from 0; or, with --world, a place in the patient in millimetres.
VP4052 USAGE {path}: a box of {size} voxels, x × y × z, is more than two pieces of {most} along an axis, and the \
program of sub-volumes draws no more as mosaics
    Cut a smaller box.
VP4053 PACKAGE {path}: alpha, minimum and maximum of a walk change one transfer function, and the segments of this \
package have one for each style
    Leave them out of the walk, or build the package without [segments] and with editable = true.
VP4054 PACKAGE {path}: there is no frame {frame}; the package has {count}, from 0 on
    Choose a frame that is there.
VP4060 OUTPUT {path}: left as it is, because it is {kind} and no file
    Name another output, or move the existing one.
VP4061 PACKAGE {path}: {file} is damaged: its CRC-32 is not the one in the zip
    Copy the package again, or make it again with volprep zip.
VP4070 PACKAGE {path}: the package requires extensions that this reader does not know: {extensions}
    Use a reader that knows them, or ask the author for a package without them.
VP4071 PACKAGE {path}: the package has version {version} of the format; this volprep can draw it, but checks only \
{known}
    Validate the package with the volprep that wrote it.
VP4072 PACKAGE {path}: this volprep does not know the {what} {word!r}; it knows {known}
    Validate the package with the volprep that wrote it.
VP4073 SCENE volprep cannot make programs for the graphics API {api}; it knows {known}
    Choose a profile with another api.
""")
