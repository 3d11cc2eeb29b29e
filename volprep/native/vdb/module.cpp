// The module volprep._vdb: what volprep takes from OpenVDB.
#include <nanobind/nanobind.h>
#include <openvdb/openvdb.h>

NB_MODULE(_vdb, module) {
    // Registers the grid types; needed once before any file is read, and proof that the library itself loads.
    openvdb::initialize();
    module.doc() = "OpenVDB, as far as volprep uses it.";
    module.def(
        "library_version", []() { return OPENVDB_LIBRARY_VERSION_STRING; },
        "Version of the OpenVDB that volprep was built with.");
}
