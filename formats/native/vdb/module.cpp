// The module volprep_formats._vdb: what the formats take from OpenVDB. Nothing of OpenVDB but its version is seen here.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <openvdb/version.h>

#include "reader.hpp"
#include "writer.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using volprep::vdb::FogVolume;
using volprep::vdb::GridInfo;
using volprep::vdb::ScalarGrid;
using Volume = nb::ndarray<const float, nb::numpy, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using MutableVolume = nb::ndarray<float, nb::numpy, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using MutableVectors = nb::ndarray<float, nb::numpy, nb::shape<-1, -1, -1, 3>, nb::c_contig, nb::device::cpu>;

namespace {

template <typename Array>
std::array<size_t, 3> shape_zyx(const Array& array) {
    if (array.size() == 0) throw nb::value_error("the array has no voxels");
    return {array.shape(0), array.shape(1), array.shape(2)};
}

// Bytes that are no UTF-8 are escaped.
nb::str name_of(const GridInfo& info) {
    PyObject* const name =
        PyUnicode_DecodeUTF8(info.name.data(), static_cast<Py_ssize_t>(info.name.size()), "backslashreplace");
    if (!name) throw nb::python_error();
    return nb::steal<nb::str>(name);
}

void bind_reader(nb::module_& module) {
    nb::class_<GridInfo>(module, "GridInfo", "Header of a grid, read before its tree.")
        .def_prop_ro("name", &name_of, "Name, made unique with [0], [1], ...")
        .def_ro("value_type", &GridInfo::value_type, "float, double, vec3s, ...")
        .def_ro("grid_class", &GridInfo::grid_class, "Fog Volume, Level Set, Staggered Vector Field or Other.")
        .def_ro("saved_as_half", &GridInfo::saved_as_half, "Whether its floats have 16 bits in the file.")
        .def_ro("declared_box_xyz", &GridInfo::declared_box_xyz,
                "First and last active voxel, as the file notes them; they may be wrong.");
    module.def("list_grids", &volprep::vdb::list_grids, "path"_a,
               "All grids of a file, in its order. Raises RuntimeError for a damaged file.");
    nb::class_<ScalarGrid>(module, "ScalarGrid",
                           "One grid of floats, doubles or vectors of three floats, whole in memory.")
        .def(nb::init<const std::string&, size_t>(), "path"_a, "index"_a,
             "The grid number `index` of list_grids. Raises RuntimeError for a damaged grid.")
        .def_prop_ro("active_box_xyz", &ScalarGrid::active_box_xyz,
                     "First and last active voxel along x, y and z; None if no voxel is active.")
        .def_prop_ro("active_voxels", &ScalarGrid::active_voxels, "Number of active voxels.")
        .def_prop_ro("background", &ScalarGrid::background, "Value of all that no node covers.")
        .def_prop_ro("inexact_values", &ScalarGrid::inexact_values,
                     "Number of values, active or not, that 32-bit floating point does not hold exactly.")
        .def_prop_ro("world_from_index", &ScalarGrid::world_from_index,
                     "Rows of the 4×4 matrix from (x, y, z, 1) in voxels to world; None if it is not linear.")
        .def(
            "copy",
            [](const ScalarGrid& grid, const volprep::vdb::Xyz& first_xyz, const MutableVolume& dst) {
                grid.copy(first_xyz, shape_zyx(dst), dst.data());
            },
            "first_xyz"_a, "dst"_a.noconvert(), "Fill `dst` [z, y, x] with the values from voxel `first_xyz` on.")
        .def(
            "copy_vectors",
            [](const ScalarGrid& grid, const volprep::vdb::Xyz& first_xyz, const MutableVectors& dst) {
                grid.copy_vectors(first_xyz, shape_zyx(dst), dst.data());
            },
            "first_xyz"_a, "dst"_a.noconvert(), "Fill `dst` [z, y, x, 3] with the vectors from voxel `first_xyz` on.");
}

void bind_writer(nb::module_& module) {
    nb::class_<FogVolume>(module, "FogVolume", "A sparse grid of floats with background 0, made slab by slab.")
        .def(nb::init<const std::string&, const std::array<std::array<double, 4>, 4>&>(), "name"_a,
             "world_from_index"_a, "The matrix has rows and maps (x, y, z, 1) in voxels to world.")
        .def(
            "add", [](FogVolume& fog, int32_t z0, const Volume& src) { fog.add(z0, shape_zyx(src), src.data()); },
            "z0"_a, "src"_a.noconvert(), "Take the values `src` [z, y, x] from slice `z0` on. Zeros stay inactive.")
        .def("activate", &FogVolume::activate, "xyz"_a, "Make a voxel active, whatever its value.")
        .def("write", &FogVolume::write, "path"_a,
             "Write the file; bytes 21 to 56 are an identifier that is never the same. Raises RuntimeError.");
}

}  // namespace

NB_MODULE(_vdb, module) {
    // Proof that the library itself loads.
    volprep::vdb::initialize();
    module.doc() = "OpenVDB, as far as volume formats use it.";
    module.def(
        "library_version", []() { return OPENVDB_LIBRARY_VERSION_STRING; },
        "Version of the OpenVDB that volprep was built with.");
    bind_reader(module);
    bind_writer(module);
}
