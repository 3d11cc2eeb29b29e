#include "reader.hpp"

#include <openvdb/io/Archive.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <new>
#include <stdexcept>
#include <type_traits>
#include <variant>

#include "tree_walk.hpp"

namespace volprep::vdb {
namespace {

// OpenVDB's own File reads on beyond the end of a file and takes the contents of its buffers for voxels; this stream
// throws.
class Archive : public openvdb::io::Archive {
  public:
    explicit Archive(const std::string& path) : file_(path, std::ios::binary) {
        if (!file_) throw std::runtime_error("it cannot be opened");
        file_.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
        file_.seekg(0, std::ios::end);
        end_ = file_.tellg();
        file_.seekg(0);
        readHeader(file_);
        if (fileVersion() < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
            throw std::runtime_error("its version is older than 222");
        if (!inputHasGridOffsets()) throw std::runtime_error("it was written as a stream, which has no offsets");
        openvdb::io::setStreamMetadataPtr(file_, metadata_, /*transfer=*/false);
        setFormatVersion(file_);
        setLibraryVersion(file_);
        setDataCompression(file_);
        check_metadata(file_, end_);
        openvdb::MetaMap().readMeta(file_);
        grids_left_ = readGridCount(file_);
    }

    // Goes to the next grid; false after the last. Unknown types are refused by OpenVDB.
    bool next() {
        if (at_grid_) descriptor_.seekToEnd(file_);
        if (grids_left_-- <= 0) return false;
        descriptor_ = openvdb::io::GridDescriptor();
        check_strings(file_, 3, end_);  // name, type, name of the parent
        grid_ = descriptor_.read(file_);
        at_grid_ = true;
        const int64_t begin = descriptor_.getGridPos();
        if (begin != file_.tellg() || descriptor_.getEndPos() < begin)
            throw std::runtime_error("a grid does not lie where it should");
        if (descriptor_.getEndPos() > end_) throw std::runtime_error("it ends before its grids do");
        return true;
    }

    // The grid with its metadata and transform alone.
    GridInfo info() {
        read_metadata();
        const auto first = grid_->getMetadata<openvdb::Vec3IMetadata>(openvdb::GridBase::META_FILE_BBOX_MIN);
        const auto last = grid_->getMetadata<openvdb::Vec3IMetadata>(openvdb::GridBase::META_FILE_BBOX_MAX);
        GridInfo info{openvdb::io::GridDescriptor::nameAsString(descriptor_.uniqueName()),
                      grid_->valueType(),
                      openvdb::GridBase::gridClassToMenuName(grid_->getGridClass()),
                      descriptor_.saveFloatAsHalf(),
                      {}};
        if (first && last) {
            const auto &low = first->value(), &high = last->value();
            info.declared_box_xyz = {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
        }
        return info;
    }

    // The whole grid. It has to end where the file says that it does.
    openvdb::GridBase::Ptr read() {
        check();
        readGrid(grid_, descriptor_, file_);
        if (file_.tellg() != descriptor_.getEndPos()) throw std::runtime_error("a grid does not end where it should");
        return grid_;
    }

    const openvdb::io::GridDescriptor& descriptor() const { return descriptor_; }

  private:
    void read_metadata() {
        readGridCompression(file_);
        check_metadata(file_, descriptor_.getEndPos());
        grid_->readMeta(file_);
    }

    // Walks over the grid before OpenVDB makes anything of its tree, and goes back to its beginning.
    void check() {
        const bool floats = grid_->isType<openvdb::FloatGrid>();
        const bool vectors = grid_->isType<openvdb::Vec3SGrid>();
        if (!floats && !vectors && !grid_->isType<openvdb::DoubleGrid>())
            throw std::runtime_error("its voxels are neither floats, doubles nor vectors of three floats");
        read_metadata();
        const bool half = grid_->saveFloatAsHalf();
        if (half != descriptor_.saveFloatAsHalf())
            throw std::runtime_error("a grid says both that its floats have 16 bits and that they have not");
        check_strings(file_, 1, descriptor_.getEndPos());  // kind of the transform
        grid_->readTransform(file_);
        if (!descriptor_.isInstance())
            check_tree(file_,
                       {vectors  ? 12
                        : floats ? 4
                                 : 8,
                        half, openvdb::io::getDataCompression(file_), vectors ? 3 : 1},
                       descriptor_.getEndPos());
        file_.seekg(descriptor_.getGridPos());
    }

    // Before the stream, which refers to it.
    openvdb::SharedPtr<openvdb::io::StreamMetadata> metadata_ = std::make_shared<openvdb::io::StreamMetadata>();
    std::ifstream file_;
    int64_t end_ = 0;
    int32_t grids_left_ = 0;
    bool at_grid_ = false;
    openvdb::io::GridDescriptor descriptor_;
    openvdb::GridBase::Ptr grid_;
};

// Messages of OpenVDB repeat words of the file, which may be any bytes.
std::string printable(std::string text) {
    std::replace_if(text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

// Calls `read`, and turns the state of the stream into a message.
template <typename Function>
auto reading(Function function) {
    try {
        return function();
    } catch (const std::ios_base::failure&) {
        throw std::runtime_error("it ends too early, or cannot be read");
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw std::runtime_error(printable(error.what()));
    }
}

// A grid without a tree of its own shares that of another, its parent, which may come later in the file.
openvdb::GridBase::Ptr read_parent(const std::string& path, const openvdb::Name& unique_name) {
    Archive archive(path);
    while (archive.next())
        if (archive.descriptor().uniqueName() == unique_name && !archive.descriptor().isInstance())
            return archive.read();
    throw std::runtime_error("a grid shares the voxels of one that is not there");
}

openvdb::GridBase::Ptr read_grid(const std::string& path, size_t index) {
    Archive archive(path);
    for (size_t i = 0; i <= index; ++i)
        if (!archive.next()) throw std::runtime_error("it has no grid " + std::to_string(index));
    const openvdb::GridBase::Ptr grid = archive.read();
    if (archive.descriptor().isInstance()) {
        const auto parent = read_parent(path, archive.descriptor().instanceParentName());
        if (parent->type() != grid->type()) throw std::runtime_error("a grid shares voxels of another type");
        grid->setTree(parent->baseTreePtr());
    }
    return grid;
}

template <typename Grid>
constexpr bool is_vectors = std::is_same_v<std::remove_cvref_t<Grid>, openvdb::Vec3SGrid>;

template <typename Value>
auto first_of(const Value& value) {
    if constexpr (std::is_same_v<Value, openvdb::Vec3s>)
        return value.x();
    else
        return value;
}

template <typename Grid, typename Value>
void copy_voxels(const Grid& grid, const Xyz& first_xyz, const std::array<size_t, 3>& shape_zyx, Value* dst) {
    const openvdb::Coord first(first_xyz[0], first_xyz[1], first_xyz[2]);
    const openvdb::Coord size(static_cast<int32_t>(shape_zyx[2]), static_cast<int32_t>(shape_zyx[1]),
                              static_cast<int32_t>(shape_zyx[0]));
    // OpenVDB's "XYZ" has x as its fastest axis.
    openvdb::tools::Dense<Value, openvdb::tools::LayoutXYZ> dense(openvdb::CoordBBox(first, first + size.offsetBy(-1)),
                                                                  dst);
    openvdb::tools::copyToDense(grid, dense, /*serial=*/true);
}

}  // namespace

struct ScalarGrid::Tree {
    std::variant<openvdb::FloatGrid::Ptr, openvdb::DoubleGrid::Ptr, openvdb::Vec3SGrid::Ptr> grid;

    template <typename Function>
    auto visit(Function function) const {
        return std::visit([&](const auto& pointer) { return function(*pointer); }, grid);
    }
};

void initialize() {
    // One thread: the reading process limits its memory, and the stack and heap of each further thread count as such.
    static const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    openvdb::initialize();
    // It only helps to load voxels later, which is never done here, and is decompressed before anything is checked.
    openvdb::io::DelayedLoadMetadata::unregisterType();
}

std::vector<GridInfo> list_grids(const std::string& path) {
    return reading([&] {
        std::vector<GridInfo> grids;
        Archive archive(path);
        while (archive.next()) grids.push_back(archive.info());
        return grids;
    });
}

ScalarGrid::ScalarGrid(const std::string& path, size_t index) : tree_(std::make_unique<Tree>()) {
    const openvdb::GridBase::Ptr grid = reading([&] { return read_grid(path, index); });
    if (const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid))
        tree_->grid = floats;
    else if (const auto vectors = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid))
        tree_->grid = vectors;
    else
        tree_->grid = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid);
}

ScalarGrid::~ScalarGrid() = default;

std::optional<std::pair<Xyz, Xyz>> ScalarGrid::active_box_xyz() const {
    return tree_->visit([](const auto& grid) -> std::optional<std::pair<Xyz, Xyz>> {
        const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
        if (box.empty()) return {};
        return {{{box.min().x(), box.min().y(), box.min().z()}, {box.max().x(), box.max().y(), box.max().z()}}};
    });
}

uint64_t ScalarGrid::active_voxels() const {
    return tree_->visit([](const auto& grid) { return grid.activeVoxelCount(); });
}

double ScalarGrid::background() const {
    return tree_->visit([](const auto& grid) { return static_cast<double>(first_of(grid.background())); });
}

uint64_t ScalarGrid::inexact_values() const {
    const auto* grid = std::get_if<openvdb::DoubleGrid::Ptr>(&tree_->grid);
    if (!grid) return 0;
    uint64_t count = 0;
    for (auto value = (*grid)->tree().cbeginValueAll(); value; ++value)
        count += !std::isnan(*value) && static_cast<double>(static_cast<float>(*value)) != *value;
    return count;
}

std::optional<std::array<std::array<double, 4>, 4>> ScalarGrid::world_from_index() const {
    return tree_->visit([](const auto& grid) -> std::optional<std::array<std::array<double, 4>, 4>> {
        if (!grid.transform().isLinear()) return {};
        // OpenVDB multiplies row vectors from the left.
        const openvdb::Mat4d matrix = grid.transform().baseMap()->getAffineMap()->getMat4();
        std::array<std::array<double, 4>, 4> rows{};
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) rows[i][j] = matrix(j, i);
        return rows;
    });
}

void ScalarGrid::copy(const Xyz& first_xyz, const std::array<size_t, 3>& shape_zyx, float* dst) const {
    tree_->visit([&](const auto& grid) {
        if constexpr (is_vectors<decltype(grid)>)
            throw std::logic_error("these are vectors");
        else
            copy_voxels(grid, first_xyz, shape_zyx, dst);
    });
}

void ScalarGrid::copy_vectors(const Xyz& first_xyz, const std::array<size_t, 3>& shape_zyx, float* dst) const {
    const auto* grid = std::get_if<openvdb::Vec3SGrid::Ptr>(&tree_->grid);
    if (!grid) throw std::logic_error("these are no vectors");
    static_assert(sizeof(openvdb::Vec3s) == 3 * sizeof(float));
    copy_voxels(**grid, first_xyz, shape_zyx, reinterpret_cast<openvdb::Vec3s*>(dst));
}

}  // namespace volprep::vdb
