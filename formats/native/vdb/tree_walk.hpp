// Checks the parts of an OpenVDB file before OpenVDB reads it. OpenVDB 10 takes the length of an uncompressed block
// from the file and writes that many bytes into a buffer of another size (io/Compression.cc, bloscFromStream and
// unzipFromStream), so that a file could overwrite the reader's memory.
// Source: the file format of OpenVDB 222 and later (tree/RootNode.h, InternalNode.h, LeafNode.h, io/Compression.h).
#pragma once

#include <cstdint>
#include <istream>

namespace volprep::vdb {

// How the values of a tree are stored.
struct TreeFormat {
    int64_t value_bytes;   // 4 or 8, or 12 of three floats
    bool saved_as_half;    // blocks have 2 bytes for each number
    uint32_t compression;  // flags of openvdb::io
    int64_t numbers = 1;   // of a value
};

// Walks over the tree that begins where the stream is and that ends before the byte `end`. It has the nodes of
// openvdb::FloatTree. Throws std::runtime_error if a node or a block does not fit the format or the file; what the
// stream throws at its end passes through.
void check_tree(std::istream& stream, const TreeFormat& format, int64_t end);

// The same for metadata, and for `count` strings: OpenVDB makes room for them before it knows that they are there. The
// stream is where it was afterwards.
void check_metadata(std::istream& stream, int64_t end);
void check_strings(std::istream& stream, int count, int64_t end);

}  // namespace volprep::vdb
