// SPDX-License-Identifier: Apache-2.0
#include "fibrolite/solid_io.h"

#include <openvdb/io/Stream.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <istream>
#include <new>
#include <optional>
#include <ostream>
#include <span>
#include <streambuf>
#include <string>
#include <utility>
#include <vector>

#include "fibrolite/error.h"
#include "fibrolite/file.h"
#include "fibrolite/random.h"
#include "fibrolite/vdb.h"
#include "read_file.h"
#include "vdb_access.h"

namespace fibrolite {
namespace {

using openvdb::FloatGrid;
using Tree = openvdb::FloatTree;

// A .vdb file begins with 21 bytes (magic number, versions, a flag) and a UUID as text. OpenVDB takes a random one;
// ours says that the file is ours and holds a hash of everything behind it. So the same grids give the same bytes, and
// a damaged file is found before OpenVDB sees it: it trusts sizes in a file, and its decompressor writes out of bounds
// on damaged data.
constexpr std::size_t uuid_begin = 21, uuid_size = 36, uuid_end = uuid_begin + uuid_size;
constexpr std::string_view our_uuid = "66696272-6f6c-800";  // "fibrol", then version 8: the rest is ours to choose

class Hash {
 public:
  void add(std::uint64_t word) { value_ = mix(value_ ^ word); }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0x6c69627265666962ULL;
};

// Of a stream of bytes, in words of eight; the last one is padded, so the count of bytes goes in too.
class ByteHash {
 public:
  void add(std::string_view bytes) {
    count_ += bytes.size();
    if (!rest_.empty()) {
      const std::size_t n = std::min(8 - rest_.size(), bytes.size());
      rest_ += bytes.substr(0, n);
      bytes.remove_prefix(n);
      if (rest_.size() < 8) return;
      hash_.add(word(rest_));
      rest_.clear();
    }
    for (; bytes.size() >= 8; bytes.remove_prefix(8)) hash_.add(word(bytes));
    rest_ = bytes;
  }
  [[nodiscard]] std::uint64_t value() const {
    Hash hash = hash_;
    std::string last = rest_;
    last.resize(8, '\0');
    hash.add(word(last));
    hash.add(count_);
    return hash.value();
  }

 private:
  static std::uint64_t word(std::string_view bytes) {
    std::uint64_t w = 0;
    std::memcpy(&w, bytes.data(), sizeof w);
    return w;
  }
  Hash hash_;
  std::string rest_;
  std::uint64_t count_ = 0;
};

std::string uuid_of(std::uint64_t hash) {
  std::string digits;
  for (int shift = 60; shift >= 0; shift -= 4) digits += "0123456789abcdef"[(hash >> shift) & 15U];
  return std::string(our_uuid) + digits.substr(0, 1) + "-8" + digits.substr(1, 3) + "-" + digits.substr(4);
}

// Bytes on their way to the file. OpenVDB would swallow the system's errors; here they end the writing.
class HashingOutput : public std::streambuf {
 public:
  HashingOutput(OutputFile& file, const Context& context) : file_(file), context_(context) {}
  [[nodiscard]] std::uint64_t hash() const { return hash_.value(); }
  [[nodiscard]] std::exception_ptr error() const { return error_; }

 protected:
  std::streamsize xsputn(const char* data, std::streamsize size) override {
    if (error_) return 0;
    const std::string_view bytes(data, static_cast<std::size_t>(size));
    try {
      context_.check();
      file_.write(bytes);
    } catch (...) {
      error_ = std::current_exception();
      return 0;
    }
    const std::size_t skip = written_ < uuid_end ? std::min(uuid_end - written_, bytes.size()) : 0;
    hash_.add(bytes.substr(skip));
    written_ += bytes.size();
    return size;
  }
  int_type overflow(int_type c) override {
    const char byte = traits_type::to_char_type(c);
    return xsputn(&byte, 1) == 1 ? c : traits_type::eof();
  }
  pos_type seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode) override {
    const bool is_tell = offset == 0 && direction == std::ios_base::cur;
    return is_tell ? pos_type(static_cast<off_type>(written_)) : pos_type(off_type(-1));
  }

 private:
  OutputFile& file_;
  const Context& context_;
  ByteHash hash_;
  std::size_t written_ = 0;
  std::exception_ptr error_;
};

// Bytes in memory as a stream that can be searched.
class MemoryInput : public std::streambuf {
 public:
  explicit MemoryInput(std::string_view bytes) {
    char* const begin = const_cast<char*>(bytes.data());  // the base class wants it so; nothing is put back
    setg(begin, begin, begin + bytes.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode) override {
    char* const base = direction == std::ios_base::beg ? eback() : direction == std::ios_base::cur ? gptr() : egptr();
    if (offset < eback() - base || offset > egptr() - base) return pos_type(off_type(-1));
    setg(eback(), base + offset, egptr());
    return pos_type(gptr() - eback());
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode which) override {
    return seekoff(off_type(position), std::ios_base::beg, which);
  }
};

// Of everything that says where the surface is: background, tiles, active voxels, and the sign of the others. One
// number per leaf, put together in order.
std::int64_t checksum(const FloatGrid& grid) {
  const Tree& tree = grid.tree();
  const auto bits = [](float v) { return std::uint64_t{std::bit_cast<std::uint32_t>(v)}; };
  const auto place = [](const openvdb::Coord& c) {
    return mix(mix(mix(static_cast<std::uint32_t>(c.x())) ^ static_cast<std::uint32_t>(c.y())) ^
               static_cast<std::uint32_t>(c.z()));
  };
  const openvdb::tree::LeafManager<const Tree> leaves(tree);
  std::vector<std::uint64_t> part(leaves.leafCount());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, part.size(), 64), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Tree::LeafNodeType& leaf = leaves.leaf(i);
      Hash hash;
      hash.add(place(leaf.origin()));
      for (openvdb::Index k = 0; k < Tree::LeafNodeType::SIZE; ++k) {
        const float v = leaf.getValue(k);
        hash.add(leaf.isValueOn(k) ? bits(v) : v < 0 ? 0x200000000ULL : 0x100000000ULL);
      }
      part[i] = hash.value();
    }
  });
  Hash hash;
  hash.add(bits(grid.background()));
  for (const std::uint64_t h : part) hash.add(h);
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (!tile.isValueOn() && *tile == grid.background()) continue;  // what a file need not hold
    hash.add(place(tile.getCoord()) ^ tile.getDepth());
    hash.add(bits(*tile) | (tile.isValueOn() ? 0x100000000ULL : 0));
  }
  return std::bit_cast<std::int64_t>(hash.value());
}

// What our files say about each grid.
struct Facts {
  static constexpr const char* voxels_key = "fibrolite_voxels";
  static constexpr const char* box_min_key = "fibrolite_box_min";
  static constexpr const char* box_max_key = "fibrolite_box_max";
  static constexpr const char* checksum_key = "fibrolite_checksum";

  std::int64_t voxels = 0, sum = 0;
  openvdb::CoordBBox box;

  explicit Facts(const FloatGrid& grid)
      : voxels(static_cast<std::int64_t>(grid.activeVoxelCount())),
        sum(checksum(grid)),
        box(grid.evalActiveVoxelBoundingBox()) {}

  void put(openvdb::MetaMap& meta) const {
    meta.insertMeta(voxels_key, openvdb::Int64Metadata(voxels));
    meta.insertMeta(box_min_key, openvdb::Vec3IMetadata(box.min().asVec3i()));
    meta.insertMeta(box_max_key, openvdb::Vec3IMetadata(box.max().asVec3i()));
    meta.insertMeta(checksum_key, openvdb::Int64Metadata(sum));
  }
  [[nodiscard]] bool agree(const openvdb::MetaMap& meta) const {
    return meta.metaValue<std::int64_t>(voxels_key) == voxels && meta.metaValue<std::int64_t>(checksum_key) == sum &&
           meta.metaValue<openvdb::Vec3i>(box_min_key) == box.min().asVec3i() &&
           meta.metaValue<openvdb::Vec3i>(box_max_key) == box.max().asVec3i();
  }
};

openvdb::GridBase::ConstPtr to_write(const NamedSolid& named) {
  const FloatGrid::ConstPtr grid = to_vdb(named.solid);
  // What came with the grid from elsewhere, statistics above all, is not repeated.
  openvdb::MetaMap meta;
  meta.insertMeta(openvdb::GridBase::META_GRID_NAME, openvdb::StringMetadata(named.name));
  meta.insertMeta(openvdb::GridBase::META_GRID_CLASS,
                  openvdb::StringMetadata(openvdb::GridBase::gridClassToString(openvdb::GRID_LEVEL_SET)));
  meta.insertMeta("unit", openvdb::StringMetadata("mm"));
  Facts(*grid).put(meta);
  return grid->copyGridReplacingMetadata(meta);
}

Error damaged(const std::filesystem::path& path, const std::string& what) {
  return Error(Code::BadInput, what, path.string(), "the file is damaged or was not written to its end");
}

void check_bytes(const std::filesystem::path& path, std::string_view bytes) {
  constexpr std::string_view magic{"\x20\x42\x44\x56\0\0\0\0", 8};
  if (!bytes.starts_with(magic))
    throw Error(Code::BadInput, "not a .vdb file", path.string(),
                "give a level set, as generate -o FILE.vdb writes it");
  if (bytes.size() < uuid_end) throw damaged(path, "the .vdb file ends in its header");
  const std::string_view uuid = bytes.substr(uuid_begin, uuid_size);
  if (!uuid.starts_with(our_uuid)) return;
  ByteHash hash;
  hash.add(bytes.substr(uuid_end));
  if (uuid != uuid_of(hash.value())) throw damaged(path, "the .vdb file does not match its checksum");
}

openvdb::GridPtrVecPtr read_grids(const std::filesystem::path& path, std::string_view bytes) {
  initialize_openvdb();
  MemoryInput buffer(bytes);
  std::istream stream(&buffer);
  // OpenVDB does not look whether it got the bytes it asked for: the stream must throw.
  stream.exceptions(std::ios_base::eofbit | std::ios_base::failbit | std::ios_base::badbit);
  try {
    return openvdb::io::Stream(stream, /*delayLoad=*/false).getGrids();
  } catch (const std::ios_base::failure&) {
    throw damaged(path, "the .vdb file ends too early");
  } catch (const std::bad_alloc&) {
    throw damaged(path, "the .vdb file asks for more memory than there is");
  } catch (const std::exception& error) {
    throw damaged(path, std::string("the .vdb file cannot be read: ") + error.what());
  }
}

// A level set keeps within its background; a file that was cut off or altered does not.
void check_values(const std::filesystem::path& path, const FloatGrid& grid) {
  const float limit = grid.background() * 1.001F;
  for (auto value = grid.cbeginValueAll(); value; ++value)
    if (!(std::abs(*value) <= limit))
      throw Error(Code::BadInput, "the grid '" + grid.getName() + "' has values beyond its background", path.string(),
                  "is it a level set?");
}

FloatGrid::Ptr chosen_grid(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
                           const std::string& name) {
  constexpr const char* usual_name = "solid";
  std::vector<FloatGrid::Ptr> found;
  std::string names;
  for (const openvdb::GridBase::Ptr& base : grids) {
    names += " '" + base->getName() + "'";
    const auto grid = openvdb::gridPtrCast<FloatGrid>(base);
    if (grid && grid->getGridClass() == openvdb::GRID_LEVEL_SET && (name.empty() || grid->getName() == name))
      found.push_back(grid);
  }
  if (found.empty())
    throw Error(Code::BadInput,
                name.empty() ? "the .vdb file has no level set" : "the .vdb file has no level set '" + name + "'",
                path.string(), names.empty() ? "" : "its grids are" + names);
  if (found.size() == 1 || !name.empty()) return found.front();
  for (const FloatGrid::Ptr& grid : found)
    if (grid->getName() == usual_name) return grid;
  throw Error(Code::BadInput,
              "the .vdb file has " + std::to_string(found.size()) + " level sets and none is called 'solid':" + names,
              path.string(), "give a file that holds the one that is meant");
}

}  // namespace

void write_vdb(const std::filesystem::path& path, const std::vector<NamedSolid>& solids, const Context& context) {
  initialize_openvdb();
  OutputFile file(path);
  HashingOutput buffer(file, context);
  std::ostream stream(&buffer);
  openvdb::GridCPtrVec grids;
  for (const NamedSolid& named : solids) {
    context.check();
    grids.push_back(to_write(named));
  }
  context.progress(0.2);
  try {
    openvdb::io::Stream archive(stream);
    archive.setGridStatsMetadataEnabled(false);  // ours say more
    archive.write(grids);
  } catch (const std::exception& error) {
    if (!buffer.error()) throw Error(Code::Io, std::string("cannot write the grids: ") + error.what(), path.string());
  }
  if (buffer.error()) std::rethrow_exception(buffer.error());
  if (!stream) throw Error(Code::Io, "cannot write the grids", path.string());
  const std::string uuid = uuid_of(buffer.hash());
  file.overwrite(uuid_begin, std::as_bytes(std::span(uuid)));
  file.commit();
  context.progress(1);
}

Solid read_vdb(const std::filesystem::path& path, const std::string& name) {
  openvdb::GridPtrVecPtr grids;
  {
    const FileBytes bytes = read_file(path, {});
    check_bytes(path, bytes.view());
    grids = read_grids(path, bytes.view());
  }
  const FloatGrid::Ptr grid = chosen_grid(path, *grids, name);
  Solid solid;
  try {
    solid = from_vdb(grid);
  } catch (const Error& error) {
    throw Error(error.code(), error.what(), path.string());
  }
  check_values(path, *grid);
  if (grid->getMetadata<openvdb::Int64Metadata>(Facts::checksum_key)) {
    bool agree = false;
    try {
      agree = Facts(*grid).agree(*grid);
    } catch (const openvdb::Exception&) {  // one of the facts is missing or of another type
    }
    if (!agree) throw damaged(path, "the grid '" + grid->getName() + "' does not match its checksum");
  }
  return solid;
}

}  // namespace fibrolite
