// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/solid_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <tbb/global_control.h>

#include <fstream>
#include <iterator>
#include <numbers>

#include "fibrolite/error.h"
#include "fibrolite/random.h"
#include "fibrolite/realize.h"
#include "fibrolite/surface.h"
#include "models.h"

namespace fibrolite {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TempDir;

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
void put(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

Solid ball(double radius = 5) {
  return realize(sphere({1, 2, 3}, radius), {{-7, -7, -7}, {9, 9, 11}}, {.voxel_mm = 0.25});
}

Error error_of(const auto& work) {
  try {
    work();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return Error(Code::Internal, "no error");
}

TEST(SolidIo, reads_back_the_same_solid) {
  const TempDir dir;
  const Solid solid = ball();
  write_vdb(dir / "s.vdb", {{"ball", solid}});
  const Solid back = read_vdb(dir / "s.vdb");
  EXPECT_EQ(back.grid(), solid.grid());
  EXPECT_EQ(back.active_voxels(), solid.active_voxels());
  EXPECT_EQ(back.volume_mm3(), solid.volume_mm3());
  EXPECT_NEAR(back.volume_mm3(), 4.0 / 3 * std::numbers::pi * 125, 1);
  EXPECT_EQ(surface(back).vertices, surface(solid).vertices);
  EXPECT_EQ(back.distance({1, 2, 3}), solid.distance({1, 2, 3}));  // deep inside: the tiles came along
}

TEST(SolidIo, grids_are_found_by_name) {
  const TempDir dir;
  write_vdb(dir / "s.vdb", {{"small", ball(2)}, {"large", ball(5)}, {"nothing", Solid{}}});
  EXPECT_EQ(read_vdb(dir / "s.vdb", "large").volume_mm3(), ball(5).volume_mm3());
  EXPECT_TRUE(read_vdb(dir / "s.vdb", "nothing").empty());
  const Error error = error_of([&] { (void)read_vdb(dir / "s.vdb", "other"); });
  EXPECT_EQ(error.code(), Code::BadInput);
  EXPECT_THAT(error.what(), HasSubstr("'small' 'large'"));

  // Without a name none of several is taken by chance.
  EXPECT_THAT(error_of([&] { (void)read_vdb(dir / "s.vdb"); }).what(), HasSubstr("3 level sets"));
  write_vdb(dir / "t.vdb", {{"body", ball(5)}, {"solid", ball(2)}});
  EXPECT_EQ(read_vdb(dir / "t.vdb").volume_mm3(), ball(2).volume_mm3());
}

TEST(SolidIo, the_same_grids_give_the_same_bytes) {
  const TempDir dir;
  const auto write = [&](const std::string& name, std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    write_vdb(dir / name, {{"ball", ball()}});
    return content(dir / name);
  };
  const std::string first = write("a.vdb", 1);
  EXPECT_EQ(first, write("b.vdb", 2));
  // And a solid that was read writes what was read.
  write_vdb(dir / "c.vdb", {{"ball", read_vdb(dir / "a.vdb")}});
  EXPECT_EQ(first, content(dir / "c.vdb"));
  // Other content, other identity.
  write_vdb(dir / "d.vdb", {{"ball", ball(4.9)}});
  EXPECT_NE(first.substr(21, 36), content(dir / "d.vdb").substr(21, 36));
}

TEST(SolidIo, bad_input) {
  const TempDir dir;
  const auto complaint = [&](const std::string& text) {
    put(dir / "bad.vdb", text);
    const Error error = error_of([&] { (void)read_vdb(dir / "bad.vdb"); });
    EXPECT_EQ(error.code(), Code::BadInput);
    EXPECT_THAT(error.what(), HasSubstr("bad.vdb"));
    return std::string(error.what());
  };
  EXPECT_THAT(complaint(""), HasSubstr("empty"));
  EXPECT_THAT(complaint("some text"), HasSubstr("not a .vdb file"));
  write_vdb(dir / "s.vdb", {{"ball", ball(3)}});
  EXPECT_THAT(complaint(content(dir / "s.vdb").substr(0, 40)), HasSubstr("header"));
  EXPECT_EQ(error_of([&] { (void)read_vdb(dir / "none.vdb"); }).code(), Code::BadInput);
}

TEST(SolidIo, every_damage_is_found) {
  const TempDir dir;
  write_vdb(dir / "s.vdb", {{"ball", ball(3)}});
  const std::string good = content(dir / "s.vdb");
  Random random(7, "solid_io_test");
  for (int round = 0; round < 200; ++round) {
    std::string bad = good;
    const std::size_t at = 57 + random.below(good.size() - 57);
    if (round % 2 == 0)
      bad.resize(at);
    else
      bad[at] = static_cast<char>(bad[at] ^ (1 << random.below(8)));
    put(dir / "bad.vdb", bad);
    const Error error = error_of([&] { (void)read_vdb(dir / "bad.vdb"); });
    EXPECT_EQ(error.code(), Code::BadInput);
    EXPECT_THAT(error.what(), HasSubstr("checksum"));
  }
}

// A file by another program, with an identity of its own, that was cut off.
TEST(SolidIo, foreign_files_that_are_cut_off_are_found) {
  const TempDir dir;
  write_vdb(dir / "s.vdb", {{"ball", ball(3)}});
  std::string foreign = content(dir / "s.vdb");
  foreign.replace(21, 36, "01234567-89ab-4cde-8f01-23456789abcd");
  put(dir / "f.vdb", foreign);
  EXPECT_EQ(read_vdb(dir / "f.vdb").volume_mm3(), ball(3).volume_mm3());
  for (std::size_t part = 1; part < 20; ++part) {
    put(dir / "f.vdb", foreign.substr(0, foreign.size() * part / 20));
    EXPECT_EQ(error_of([&] { (void)read_vdb(dir / "f.vdb"); }).code(), Code::BadInput) << part;
  }
}

TEST(SolidIo, a_cancelled_write_leaves_nothing) {
  const TempDir dir;
  const Context context;
  context.cancel();
  EXPECT_EQ(error_of([&] { write_vdb(dir / "s.vdb", {{"ball", ball()}}, context); }).code(), Code::Cancelled);
  EXPECT_TRUE(fs::is_empty(dir.path()));
}

TEST(SolidIo, a_full_disk_is_an_error) {
  const TempDir dir;
  if (mount("none", dir.path().c_str(), "tmpfs", 0, "size=64k") != 0)
    GTEST_SKIP() << "a small file system cannot be mounted here";
  const Error error = error_of([&] { write_vdb(dir / "s.vdb", {{"ball", ball()}}); });
  const bool empty = fs::is_empty(dir.path());
  umount(dir.path().c_str());
  EXPECT_EQ(error.code(), Code::Io);
  EXPECT_THAT(error.what(), HasSubstr("No space left"));
  EXPECT_TRUE(empty);
}

}  // namespace
}  // namespace fibrolite
