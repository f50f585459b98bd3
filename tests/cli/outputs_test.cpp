// SPDX-License-Identifier: GPL-3.0-or-later
#include "outputs.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "fibrolite/error.h"
#include "fibrolite/file.h"
#include "run_program.h"

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

class OutputsTest : public ::testing::Test {
 protected:
  OutputsTest() {
    fs::remove_all(folder);
    fs::create_directories(folder);
    write(model, "model");
  }
  ~OutputsTest() override { fs::remove_all(folder); }

  static void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }
  static std::string text_of(const fs::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
  }

  const fs::path folder = fs::path(::testing::TempDir()) / ("outputs_" + std::to_string(::getpid()));
  const fs::path model = folder / "m.stl", a = folder / "a.stl", b = folder / "b.stl", c = folder / "c.stl";
};

TEST_F(OutputsTest, AreAllPutInPlace) {
  write(a, "old");
  {
    Outputs outputs({a, b}, model, true);
    write(outputs.place(a), "new a");
    write(outputs.place(b), "new b");
    EXPECT_EQ(text_of(a), "old");
    outputs.commit();
  }
  EXPECT_EQ(text_of(a), "new a");
  EXPECT_EQ(text_of(b), "new b");
  EXPECT_EQ(files(), 3);
}

/// The last one was never written, so that it cannot be put in place when the others are already.
TEST_F(OutputsTest, ReplaceNothingIfOneOfThemFails) {
  write(a, "old");
  {
    Outputs outputs({a, b, c}, model, true);
    write(outputs.place(a), "new a");
    write(outputs.place(b), "new b");
    EXPECT_THROW(outputs.commit(), Error);
  }
  EXPECT_EQ(text_of(a), "old");
  EXPECT_FALSE(fs::exists(b));
  EXPECT_EQ(files(), 2);
}

TEST_F(OutputsTest, AreNotSeenBeforeAllAreWritten) {
  if (!testing::has_nameless_files(folder)) GTEST_SKIP() << "no files without a name here";
  write(a, "old");
  Outputs outputs({a, b}, model, true);
  for (const fs::path& target : {a, b}) {
    OutputFile file(outputs.place(target));
    file.write("new");
    file.commit();
  }
  EXPECT_EQ(files(), 2);
  outputs.commit();
  EXPECT_EQ(text_of(a), "new");
  EXPECT_EQ(text_of(b), "new");
  EXPECT_EQ(files(), 3);
}

TEST_F(OutputsTest, AreGoneIfNotCommitted) {
  write(a, "old");
  {
    Outputs outputs({a, b}, model, true);
    write(outputs.place(a), "new a");
    write(outputs.place(b), "new b");
  }
  EXPECT_EQ(text_of(a), "old");
  EXPECT_EQ(files(), 2);
}

}  // namespace
}  // namespace fibrolite::cli
