#include "tree_walk.hpp"

#include <openvdb/io/Compression.h>

#include <array>
#include <bit>
#include <cstring>
#include <set>
#include <stdexcept>
#include <string>

namespace volprep::vdb {
namespace {

constexpr int root_log2 = 5;  // 32³ children of 128³ voxels
constexpr int leaf_log2 = 3;  // 8³ voxels
constexpr int32_t root_voxels = 4096;
constexpr int64_t blosc_header_bytes = 16;

template <int Log2>
struct Mask {
    std::array<uint64_t, (size_t{1} << 3 * Log2) / 64> words;

    int64_t count() const {
        int64_t bits = 0;
        for (const uint64_t word : words) bits += std::popcount(word);
        return bits;
    }
};

class Walk {
  public:
    Walk(std::istream& stream, const TreeFormat& format, int64_t end)
        : stream_(stream), format_(format), left_(end - static_cast<int64_t>(stream.tellg())) {}

    void tree() {
        if (number<int32_t>() != 1) throw std::runtime_error("a tree does not have one buffer");
        skip(format_.value_bytes);  // background
        const auto tiles = number<uint32_t>();
        const auto children = number<uint32_t>();
        for (uint32_t k = 0; k < tiles; ++k) {
            origin();
            skip(format_.value_bytes);
            if (number<uint8_t>() > 1) throw std::runtime_error("a tile is neither active nor inactive");
        }
        for (uint32_t k = 0; k < children; ++k) {
            origin();
            node<root_log2>();
        }
        // The values of leaves follow all nodes.
        for (; leaves_ > 0; --leaves_) values(number<Mask<leaf_log2>>());
    }

    void metadata() {
        for (auto left = number<uint32_t>(); left > 0; --left) strings(3);  // name, type, value
    }
    void strings(int count) {
        for (; count > 0; --count) skip(number<uint32_t>());
    }

  private:
    void take(int64_t bytes) {
        if (bytes > left_) throw std::runtime_error("a part of it is longer than its remaining bytes");
        left_ -= bytes;
    }
    void skip(int64_t bytes) {
        take(bytes);
        stream_.ignore(bytes);
    }
    template <typename Number>
    Number number() {
        take(sizeof(Number));
        Number read{};
        stream_.read(reinterpret_cast<char*>(&read), sizeof(Number));
        return read;
    }

    // Of a tile or a child of the root.
    void origin() {
        const auto corner_xyz = number<std::array<int32_t, 3>>();
        for (const int32_t at : corner_xyz)
            if (at % root_voxels != 0) throw std::runtime_error("a node does not lie where nodes do");
        if (!origins_.insert(corner_xyz).second) throw std::runtime_error("two nodes lie at the same place");
    }

    template <int Log2>
    void node() {
        if constexpr (Log2 == leaf_log2) {
            skip(sizeof(Mask<Log2>));
            ++leaves_;
        } else {
            const auto children = number<Mask<Log2>>();
            values(number<Mask<Log2>>());
            for (int64_t left = children.count(); left > 0; --left) node<Log2 - 1>();
        }
    }

    // The values of a node. `active` marks the stored ones if inactive values are left out.
    template <int Log2>
    void values(const Mask<Log2>& active) {
        using namespace openvdb::io;
        const auto kind = number<int8_t>();
        if (kind < NO_MASK_OR_INACTIVE_VALS || kind > NO_MASK_AND_ALL_VALS)
            throw std::runtime_error("the values of a node are stored in a way that is not known");
        const bool two = kind == MASK_AND_TWO_INACTIVE_VALS;
        const bool one = two || kind == NO_MASK_AND_ONE_INACTIVE_VAL || kind == MASK_AND_ONE_INACTIVE_VAL;
        skip((int{one} + int{two}) * format_.value_bytes);
        if (two || kind == MASK_AND_NO_INACTIVE_VALS || kind == MASK_AND_ONE_INACTIVE_VAL) skip(sizeof(active));
        const bool all = kind == NO_MASK_AND_ALL_VALS || !(format_.compression & COMPRESS_ACTIVE_MASK);
        const int64_t count = all ? int64_t{1} << 3 * Log2 : active.count();
        if (!format_.saved_as_half)
            block(count * format_.value_bytes);
        else if (count > 0)
            block(count * 2 * format_.numbers);
    }

    // So many bytes, which may be compressed.
    void block(int64_t bytes) {
        using namespace openvdb::io;
        if (!(format_.compression & (COMPRESS_BLOSC | COMPRESS_ZIP))) return skip(bytes);
        const auto stored = number<int64_t>();
        if (stored <= 0) {
            if (stored != -bytes)
                throw std::runtime_error("a block of " + std::to_string(bytes) +
                                         " bytes says that it has another size");
            return skip(bytes);
        }
        if (stored > left_)
            throw std::runtime_error("a compressed block is longer than the remaining bytes of its grid");
        if (format_.compression & COMPRESS_BLOSC) {
            // Blosc trusts these sizes of its input.
            if (stored < blosc_header_bytes) throw std::runtime_error("a compressed block is too short");
            const auto header = number<std::array<uint32_t, blosc_header_bytes / 4>>();
            if (int64_t{header[1]} != bytes || int64_t{header[3]} != stored)
                throw std::runtime_error("a compressed block says that it has another size");
            skip(stored - blosc_header_bytes);
        } else {
            skip(stored);
        }
    }

    std::istream& stream_;
    const TreeFormat format_;
    int64_t left_;  // bytes before the end of the grid
    int64_t leaves_ = 0;
    std::set<std::array<int32_t, 3>> origins_;
};

}  // namespace

void check_tree(std::istream& stream, const TreeFormat& format, int64_t end) { Walk(stream, format, end).tree(); }

void check_metadata(std::istream& stream, int64_t end) {
    const auto begin = stream.tellg();
    Walk(stream, {}, end).metadata();
    stream.seekg(begin);
}

void check_strings(std::istream& stream, int count, int64_t end) {
    const auto begin = stream.tellg();
    Walk(stream, {}, end).strings(count);
    stream.seekg(begin);
}

}  // namespace volprep::vdb
