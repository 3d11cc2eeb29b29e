// Damaged DICOM headers: the walk finds something within the file, or nothing.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "../dicom/header.hpp"
#include "memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    // SOPClassUID, SOPInstanceUID, Modality, SliceThickness, SeriesInstanceUID, ImagePositionPatient, Rows, Columns,
    // PixelSpacing, BitsAllocated, RescaleSlope, a private one.
    static const std::vector<uint32_t> wanted{0x0008'0016, 0x0008'0018, 0x0008'0060, 0x0018'0050,
                                              0x0020'000E, 0x0020'0032, 0x0028'0010, 0x0028'0011,
                                              0x0028'0030, 0x0028'0100, 0x0028'1053, 0x0029'1010};
    static volprep::fuzz::MemoryFile file;
    file.fill(data, size);
    const auto header = volprep::dicom::plain_header(file.path(), wanted);
    if (!header) return 0;
    uint64_t bytes = 0;
    uint32_t last = 0;
    for (const auto& [tag, value] : header->elements) {
        if (tag <= last) std::abort();
        last = tag;
        bytes += value.size();
    }
    if (header->file_bytes != size || header->pixel_offset + header->pixel_element.size() > size ||
        bytes > header->pixel_offset)
        std::abort();
    return 0;
}
