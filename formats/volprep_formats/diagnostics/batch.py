"""Many scans: VP8xxx."""

from volprep_formats.diagnostics.entry import entries

ENTRIES = entries("""\
VP8001 SCENE {path}: cannot be read as a jobs table: {error}
    A table is CSV with a line of headings, or JSON lines (.jsonl) with an object in each line, in UTF-8.
VP8002 SCENE {path}, line {line}: unknown column {column}
    The columns of a jobs table are {known}.
VP8003 SCENE {path}, line {line}: {problem}
    Correct this line of the jobs table. Nothing has been built.
VP8004 SOURCE {path}, line {line}: {file} does not exist
    A relative path starts at the folder of the table. Correct the path, or take the line out of the table. Nothing has
    been built.
VP8005 SCENE {path}: {first} and {second} both have the name {name} for profile {profile}, so one package would \
replace the other
    Give each scan and each profile a name of its own. Nothing has been built.
VP8006 SOURCE {path}: holds no scan: no reader recognises any of its {files} files
    Name the folder that holds the scans, or a jobs table, CSV or JSON lines, that says how to read them.
VP8007 SCENE {path}: profile {profile} cannot have a folder of its name
    Give the profile a name of letters, digits, ., - and _, which begins with a letter or a digit.
VP8008 SCENE {path}: {where} has no mask, and --require-mask asks for one of each scan
    Name masks in the column mask of a jobs table, or with mask in [source] of scenes. Nothing has been built.
VP8010 OUTPUT {path}, line {line}: not a record of this ledger: {problem}
    The line is left out, and its scan is built again.
VP8011 OUTPUT {path}: a worker cannot see the folder of this batch
    The folder must be the same for all workers: a disk that all machines share, under one path.
VP8020 SOURCE {path}: the process that built it was killed, or crashed, {times} times
    Build this scan alone with volprep build. If that works, the machine had too little memory for so many scans at a
    time: use fewer --workers, and --retry-failed.
VP8021 SOURCE {path}: took longer than {limit_s:g} s, {times} times, and was stopped
    Allow more with --time-limit, and use --retry-failed.
VP8022 SOURCE {path}: took more memory than {limit_mb:.0f} MB, {times} times, and was stopped
    Allow more with --memory-limit or fewer --workers, and use --retry-failed.
VP8023 SOURCE {path}: its files changed while they were read, so there is no package of it
    Wait until the files are complete, and run the batch again.
VP8030 MACHINE {address}: no Dask scheduler answers: {error}
    Check that the scheduler runs and can be reached from here. Scans in the ledger are finished.
VP8031 MACHINE {address}: a worker has volprep {found}, and this is {here}
    Install the same version of volprep on all machines: packages of one batch are made by one version.
VP8032 MACHINE {address}: the scheduler has no worker, and none came within {limit_s:g} s
    Start workers for this scheduler, and run the batch again.
VP8040 SCENE {path}: cannot be used as a rule file: {problem}
    A rule file is TOML: a table [[rule]] for each rule, with a name, a scene, and at least one of modality,
    description, spacing_mm, format and slices. Nothing has been built.
VP8041 SCENE {path}: {none} of {scans} scans match no rule, and {several} match several:{found}
    Make rules narrower, or write [otherwise] with a scene, or with skip = true, for scans that match no rule. --dry-run
    shows which rule each scan matches. Nothing has been built.
VP8042 SCENE {path}: the scene {file} does not exist
    A relative path starts at the folder of the rule file. Nothing has been built.
VP8050 SOURCE {path}: cannot be fetched, tried {times} times: {error}
    Check that the address is right, that this machine may read it, and that the store answers. Then use --retry-failed.
VP8051 OUTPUT {path}: cannot be stored, tried {times} times: {error}
    Check that the bucket exists, that this machine may write to it, and that the store answers. Then use
    --retry-failed.
VP8052 MACHINE {path}: no installed module reads {protocol}://: {error}
    For s3:// install volprep[s3]; for others the package that fsspec names, such as gcsfs for gs:// and aiohttp for
    https://.
VP8053 SCENE {path}: {protocol}:// does not write objects atomically, so a package there could be incomplete
    Store packages at an s3://, gs:// or az:// address, or in a folder with -o.
VP8060 USAGE {path}: no batch in this folder has made the name {name}
    Give a name from the ledger or the page of this folder, and the folder with -o.
VP8061 USAGE {pattern}: names have no field {field!r}
    Use these, in braces: {fields}.
""")
