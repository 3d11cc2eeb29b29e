// The header of a plain DICOM file: a prefix, little endian, nothing unusual. Of its elements a few are wanted, and to
// walk over the others is all that this does; the caller interprets the values.
// Source: DICOM PS3.5 (7.1 data elements, 7.5 sequences, A.1, A.2), PS3.10 (7.1 file meta information).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace volprep::dicom {

struct PlainHeader {
    std::string transfer_syntax;
    std::vector<std::pair<uint32_t, std::string>> elements;  // the wanted ones, by tag
    std::string pixel_element;                               // its first bytes: tag, type and length, or tag and length
    uint64_t pixel_offset;                                   // where they begin in the file
    uint64_t file_bytes;
};

// Reads the header of the file `path`, and of its elements those in `wanted`, which is sorted. Nothing for a file that
// is not plain: no prefix, tags out of order, unknown types, lengths beyond the file or beyond 32 MiB, wanted values of
// more than 1 MiB in all, sequences deeper than eight, frames; nor for one that cannot be read or is no regular file.
std::optional<PlainHeader> plain_header(const std::string& path, const std::vector<uint32_t>& wanted);

// The same for many files, by up to `threads` threads, which mostly wait for the disk.
std::vector<std::optional<PlainHeader>> plain_headers(const std::vector<std::string>& paths,
                                                      const std::vector<uint32_t>& wanted, int threads);

}  // namespace volprep::dicom
