// SPDX-License-Identifier: GPL-3.0-or-later
#include "zip_writer.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "archive.h"
#include "run_program.h"

namespace fibrolite {
namespace {

using namespace testing;

std::string archive(int entries, std::uint64_t most) {
  const TempDir folder;
  OutputFile file(folder / "a.zip");
  ZipWriter zip(file, most);
  for (int i = 0; i < entries; ++i) zip.add_stored("e" + std::to_string(i), stored_piece("entry " + std::to_string(i)));
  zip.add("last", std::string(1000, 'x'));
  zip.finish();
  file.commit();
  return content(folder / "a.zip");
}

void expect_whole(const std::string& zip, int entries) {
  const auto found = unzipped(zip);
  ASSERT_EQ(found.size(), static_cast<std::size_t>(entries) + 1);
  EXPECT_EQ(found.at("e0"), "entry 0");
  EXPECT_EQ(found.at("e" + std::to_string(entries - 1)), "entry " + std::to_string(entries - 1));
  EXPECT_EQ(found.at("last"), std::string(1000, 'x'));
}

TEST(ZipWriter, holds_few_entries_without_extensions) {
  const std::string zip = archive(100, 0xFFFFFFFE);
  expect_whole(zip, 100);
  EXPECT_EQ(zip.find("PK\x06\x06"), std::string::npos);
  EXPECT_EQ(zip.find("PK\x06\x07"), std::string::npos);
}

TEST(ZipWriter, holds_more_than_sixteen_bits_of_entries) { expect_whole(archive(70000, 0xFFFFFFFE), 70000); }

/// As beyond 4 GB, told from 1000 bytes on: the entries before stay as they are.
TEST(ZipWriter, holds_entries_that_lie_far) {
  const std::string zip = archive(100, 1000);
  expect_whole(zip, 100);
  EXPECT_NE(zip.find("PK\x06\x06"), std::string::npos);
  const std::string few = archive(1, 1000);
  expect_whole(few, 1);
  EXPECT_EQ(few.find("PK\x06\x06"), std::string::npos);
}

}  // namespace
}  // namespace fibrolite
