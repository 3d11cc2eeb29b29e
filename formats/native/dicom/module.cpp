// The module volprep_formats._dicom: only translates between Python and header.hpp.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "header.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

nb::bytes bytes_of(const std::string& text) { return nb::bytes(text.data(), text.size()); }

nb::object translated(const volprep::dicom::PlainHeader& header) {
    nb::dict elements;
    for (const auto& [tag, value] : header.elements) elements[nb::int_(tag)] = bytes_of(value);
    return nb::make_tuple(bytes_of(header.transfer_syntax), elements, bytes_of(header.pixel_element),
                          header.pixel_offset, header.file_bytes);
}

nb::list plain_headers(const std::vector<nb::bytes>& paths, std::vector<uint32_t> wanted, int threads) {
    std::vector<std::string> names;
    for (const nb::bytes& path : paths) names.emplace_back(path.c_str(), path.size());
    std::sort(wanted.begin(), wanted.end());
    std::vector<std::optional<volprep::dicom::PlainHeader>> headers;
    {
        const nb::gil_scoped_release released;
        headers = volprep::dicom::plain_headers(names, wanted, threads);
    }
    nb::list result;
    for (const auto& header : headers) result.append(header ? translated(*header) : nb::none());
    return result;
}

}  // namespace

NB_MODULE(_dicom, module) {
    module.doc() = "The headers of plain DICOM files, many at a time.";
    module.def("plain_headers", &plain_headers, "paths"_a, "wanted"_a, "threads"_a,
               nb::sig("def plain_headers(paths: collections.abc.Sequence[bytes], wanted: "
                       "collections.abc.Sequence[int], threads: int) -> list[tuple[bytes, dict[int, bytes], bytes, "
                       "int, int] | None]"),
               R"(Read the headers of plain files: one image, little endian, nothing unusual.

Parameters
----------
paths
    The files.
wanted
    Tags, group and element, of the elements whose values are wanted.
threads
    How many files are read at the same time.

Returns
-------
list
    For each file its transfer syntax, the wanted elements as they stand in the file, the first bytes of the element
    that holds the pixels (tag, type and length, or tag and length), where they begin, and the size of the file. None
    for a file that is not plain or cannot be read.)");
}
