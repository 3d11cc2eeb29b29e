// Every byte is fetched through Head::up_to, which refuses positions beyond the file; positions have 64 bits
// and lengths 32, so that no sum of them overflows.
#include "header.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <new>
#include <string_view>
#include <thread>

namespace volprep::dicom {
namespace {

constexpr uint64_t first_bytes = 1 << 13;
constexpr uint64_t most_bytes = 1 << 25;
// Of the wanted values of one file. There may be thousands of files, and all are kept.
constexpr uint64_t most_wanted_bytes = 1 << 20;
constexpr int deepest = 8;
constexpr uint64_t meta_start = 128 + 4;
constexpr uint32_t meta_group = 0x0002'0000;
constexpr uint32_t syntax_tag = 0x0002'0010;
constexpr uint32_t first_tag = 0x0008'0000;
// PerFrameFunctionalGroupsSequence; ModalityLUTSequence and RealWorldValueMappingSequence, which define the values.
constexpr std::array<uint32_t, 3> unusual_tags{0x5200'9230, 0x0028'3000, 0x0040'9096};
constexpr uint32_t item = 0xFFFE'E000;
constexpr uint32_t item_end = 0xFFFE'E00D;
constexpr uint32_t sequence_end = 0xFFFE'E0DD;
constexpr uint32_t undefined_length = 0xFFFF'FFFF;
constexpr std::array<uint32_t, 3> pixel_tags{0x7FE0'0008, 0x7FE0'0009, 0x7FE0'0010};
constexpr std::string_view pixel_types = "OB OW OF OD";
// Types whose length has 16 bits, and those whose length has 32, after two bytes that are reserved.
constexpr std::string_view short_types = "AE AS AT CS DA DS DT FL FD IS LO LT PN SH SL SS ST TM UI UL US";
constexpr std::string_view long_types = "OB OD OF OL OV OW SQ SV UC UN UR UT UV";

// The file is not plain.
struct Unusual {};

uint32_t u16(const char* at) {
    return static_cast<uint8_t>(at[0]) | static_cast<uint32_t>(static_cast<uint8_t>(at[1])) << 8;
}
uint32_t u32(const char* at) { return u16(at) | u16(at + 2) << 16; }

bool is_one_of(std::string_view types, std::string_view type) {
    for (size_t k = 0; k < types.size(); k += 3) {
        if (types.substr(k, 2) == type) return true;
    }
    return false;
}

class File {
  public:
    // O_NONBLOCK: a pipe without a writer must not hold us up before it is known for one.
    explicit File(const std::string& path) : descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
        struct stat found{};
        if (descriptor_ < 0) throw Unusual{};
        if (fstat(descriptor_, &found) != 0 || !S_ISREG(found.st_mode)) {
            close(descriptor_);
            throw Unusual{};
        }
        bytes_ = static_cast<uint64_t>(found.st_size);
    }
    ~File() { close(descriptor_); }
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    uint64_t bytes() const { return bytes_; }
    // Reads on from `offset`, and gives how many bytes there were.
    uint64_t read(char* to, uint64_t count, uint64_t offset) const {
        uint64_t done = 0;
        while (done < count) {
            const ssize_t more = pread(descriptor_, to + done, count - done, static_cast<off_t>(offset + done));
            if (more <= 0) break;
            done += static_cast<uint64_t>(more);
        }
        return done;
    }

  private:
    int descriptor_;
    uint64_t bytes_ = 0;
};

// The beginning of a file, up to the furthest byte requested so far.
class Head {
  public:
    explicit Head(const File& file) : file_(file) { grow(first_bytes); }

    // All bytes from the first to `end`, or more. They move when more are asked for.
    const char* up_to(uint64_t end) {
        if (end > std::min(file_.bytes(), most_bytes)) throw Unusual{};
        if (end > data_.size()) grow(std::max<uint64_t>(end, 2 * data_.size()));
        if (end > data_.size()) throw Unusual{};  // the file has become shorter
        return data_.data();
    }
    std::string_view part(uint64_t start, uint64_t end) { return {up_to(end) + start, end - start}; }

  private:
    void grow(uint64_t size) {
        const uint64_t before = data_.size();
        data_.resize(size);
        data_.resize(before + file_.read(data_.data() + before, size - before, before));
    }

    const File& file_;
    std::vector<char> data_;
};

struct Element {
    uint32_t tag;
    uint32_t length;
    uint64_t start;  // of its value
    std::string_view type;
};

// The element at `at`, whose type is not there. `data` holds twelve bytes from there on, as for all that follow.
Element untyped(const char* data, uint64_t at) {
    return {u16(data + at) << 16 | u16(data + at + 2), u32(data + at + 4), at + 8, {}};
}

Element typed(const char* data, uint64_t at) {
    const uint32_t tag = u16(data + at) << 16 | u16(data + at + 2);
    const std::string_view type(data + at + 4, 2);
    if (is_one_of(short_types, type)) return {tag, u16(data + at + 6), at + 8, type};
    if (is_one_of(long_types, type)) return {tag, u32(data + at + 8), at + 12, type};
    throw Unusual{};
}

uint64_t end_of_sequence(Head& head, uint64_t at, int depth);

// Where an item ends whose first element begins at `at`: at its delimiter, or at `end` if that is known.
uint64_t end_of_item(Head& head, uint64_t at, std::optional<uint64_t> end, int depth) {
    while (at != end) {
        const char* data = head.up_to(at + 12);
        const Element delimiter = untyped(data, at);
        if (delimiter.tag == item_end && delimiter.length == 0 && !end) return delimiter.start;
        const Element element = typed(data, at);
        if (element.length != undefined_length) {
            at = element.start + element.length;
        } else if (element.type == "SQ") {
            at = end_of_sequence(head, element.start, depth + 1);
        } else {
            throw Unusual{};
        }
        if (end && at > *end) throw Unusual{};
    }
    return at;
}

// Where a sequence of undefined length ends whose first item begins at `at`.
uint64_t end_of_sequence(Head& head, uint64_t at, int depth) {
    if (depth > deepest) throw Unusual{};
    while (true) {
        const Element part = untyped(head.up_to(at + 12), at);  // items never have a type
        if (part.tag == sequence_end && part.length == 0) return part.start;
        if (part.tag != item) throw Unusual{};
        const bool known = part.length != undefined_length;
        at = end_of_item(head, part.start, known ? std::optional(part.start + part.length) : std::nullopt, depth);
    }
}

// Finds the transfer syntax; gives where the data set begins.
uint64_t read_meta(Head& head, std::string& transfer_syntax) {
    const std::string_view beginning = head.part(0, meta_start + 12);
    if (beginning.substr(128, 4) != "DICM" || beginning.substr(meta_start, 8) != std::string_view("\2\0\0\0UL\4\0", 8))
        throw Unusual{};
    uint64_t at = meta_start + 12;
    const uint64_t end = at + u32(beginning.data() + at - 4);
    uint32_t last = meta_group;
    while (at < end) {
        const Element element = typed(head.up_to(at + 12), at);
        if (element.tag <= last || element.tag >= meta_group + 0x1'0000 || element.length == undefined_length)
            throw Unusual{};
        last = element.tag;
        at = element.start + element.length;
        if (element.tag == syntax_tag) transfer_syntax = head.part(element.start, at);
    }
    if (at != end) throw Unusual{};
    transfer_syntax.erase(transfer_syntax.find_last_not_of(std::string_view("\0 ", 2)) + 1);
    return at;
}

// Collects the wanted elements of a data set that begins at `at`; gives where the one that holds the pixels begins.
uint64_t read_elements(Head& head, uint64_t at, bool has_types, const std::vector<uint32_t>& wanted,
                       std::vector<std::pair<uint32_t, std::string>>& found) {
    const std::string_view type = head.part(at + 4, at + 6);
    // Its types may be there though the transfer syntax says that they are not.
    if (!has_types && (is_one_of(short_types, type) || is_one_of(long_types, type))) throw Unusual{};
    uint32_t last = first_tag - 1;
    uint64_t wanted_bytes = 0;
    while (true) {
        const char* data = head.up_to(at + 12);
        const Element element = has_types ? typed(data, at) : untyped(data, at);
        if (element.tag <= last) throw Unusual{};
        if (std::find(unusual_tags.begin(), unusual_tags.end(), element.tag) != unusual_tags.end()) throw Unusual{};
        last = element.tag;
        if (std::find(pixel_tags.begin(), pixel_tags.end(), element.tag) != pixel_tags.end()) {
            if (has_types && !is_one_of(pixel_types, element.type)) throw Unusual{};
            return at;
        }
        if (element.length == undefined_length) {
            // Without types, only a dictionary of all tags tells what ends with a delimiter.
            if (element.type != "SQ") throw Unusual{};
            at = end_of_sequence(head, element.start, 1);
            continue;
        }
        at = element.start + element.length;
        if (!std::binary_search(wanted.begin(), wanted.end(), element.tag)) continue;
        wanted_bytes += element.length;
        if (wanted_bytes > most_wanted_bytes) throw Unusual{};
        found.emplace_back(element.tag, head.part(element.start, at));
    }
}

}  // namespace

std::optional<PlainHeader> plain_header(const std::string& path, const std::vector<uint32_t>& wanted) {
    try {
        const File file(path);
        Head head(file);
        PlainHeader header{};
        const uint64_t begin = read_meta(head, header.transfer_syntax);
        const bool has_types = header.transfer_syntax != "1.2.840.10008.1.2";
        const uint64_t at = read_elements(head, begin, has_types, wanted, header.elements);
        header.pixel_element = head.part(at, at + (has_types ? 12 : 8));
        header.pixel_offset = at;
        header.file_bytes = file.bytes();
        return header;
    } catch (const Unusual&) {
    } catch (const std::bad_alloc&) {
    }
    return std::nullopt;
}

std::vector<std::optional<PlainHeader>> plain_headers(const std::vector<std::string>& paths,
                                                      const std::vector<uint32_t>& wanted, int threads) {
    std::vector<std::optional<PlainHeader>> headers(paths.size());
    std::atomic<size_t> next{0};
    const auto work = [&]() {
        for (size_t k = next++; k < paths.size(); k = next++) headers[k] = plain_header(paths[k], wanted);
    };
    {
        std::vector<std::jthread> others;
        for (int k = 1; k < threads && static_cast<size_t>(k) < paths.size(); ++k) others.emplace_back(work);
        work();
    }
    return headers;
}

}  // namespace volprep::dicom
