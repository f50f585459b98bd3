// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/kept_work.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <numeric>
#include <thread>

#include "fibrolite/error.h"
#include "run_program.h"

namespace fibrolite {
namespace {

using namespace fibrolite::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
namespace fs = std::filesystem;

const std::string work = "model 12ab\nlayer 0.1\n";

void write(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

struct Sample {
  std::vector<double> areas{1.5, -0.0, 3e-300};
  std::string text = std::string("a\0b", 3);
  std::int64_t count = -7;
  std::vector<int> none{};
};
void keep(KeptWork& kept, const std::string& name, const Sample& sample) {
  KeptWork::Writer part = kept.write(name);
  part.put_list(sample.areas);
  part.put_list(sample.text);
  part.put(sample.count);
  part.put_list(sample.none);
  part.commit();
}
Sample recalled(const KeptWork& kept, const std::string& name) {
  KeptWork::Reader part = kept.read(name);
  Sample sample{{}, {}, 0, {1}};
  part.get_list(sample.areas);
  part.get_list(sample.text);
  part.get(sample.count);
  part.get_list(sample.none);
  return sample;
}

/// A folder with the parts "a" and "b".
fs::path two_parts(const TempDir& dir) {
  KeptWork kept(dir / "kept", work);
  keep(kept, "a", {});
  keep(kept, "b", {});
  return dir / "kept";
}
/// Opens it; returns what was logged.
std::vector<std::string> opened(const fs::path& folder, std::set<std::string>& parts) {
  std::vector<std::string> said;
  const KeptWork kept(folder, work, Context({}, [&](std::string_view line) { said.emplace_back(line); }));
  parts = kept.parts();
  return said;
}

TEST(KeptWork, PartsAreReadBackByALaterRun) {
  const TempDir dir;
  const fs::path folder = two_parts(dir);
  KeptWork later(folder, work);
  EXPECT_THAT(later.parts(), ElementsAre("a", "b"));
  const Sample sample = recalled(later, "b");
  EXPECT_EQ(sample.areas, Sample().areas);
  EXPECT_EQ(sample.text, Sample().text);
  EXPECT_EQ(sample.count, -7);
  EXPECT_THAT(sample.none, IsEmpty());
  KeptWork::Reader beyond = later.read("a");
  std::vector<std::int64_t> list(1000);
  EXPECT_THROW(beyond.read(std::as_writable_bytes(std::span(list))), Error);
  later.discard();
  EXPECT_THAT(names_in(dir.path()), IsEmpty());
}

TEST(KeptWork, APartThatWasNotCommittedIsNone) {
  const TempDir dir;
  {
    KeptWork kept(dir / "kept", work);
    KeptWork::Writer part = kept.write("a");
    part.put(std::int64_t{1});
    EXPECT_FALSE(kept.holds("a"));
  }
  std::set<std::string> parts;
  opened(dir / "kept", parts);
  EXPECT_THAT(parts, IsEmpty());
  EXPECT_THAT(names_in(dir / "kept"), ElementsAre("work"));
}

TEST(KeptWork, AnyDamageIsNoticedAndTheOtherPartsStay) {
  const TempDir dir;
  const fs::path folder = two_parts(dir);
  const std::string good = content(folder / "a.kept");
  std::vector<std::string> bad{"", good + '\0', good + good, content(folder / "b.kept")};
  for (std::size_t i = 0; i < good.size(); ++i) {
    bad.push_back(good.substr(0, i));
    bad.push_back(good);
    bad.back()[i] = static_cast<char>(bad.back()[i] ^ (1 << i % 8));
  }
  for (const std::string& bytes : bad) {
    write(folder / "a.kept", bytes);
    std::set<std::string> parts;
    const auto said = opened(folder, parts);
    ASSERT_THAT(parts, ElementsAre("b"));
    ASSERT_THAT(said, ElementsAre(HasSubstr("a.kept")));
    ASSERT_FALSE(fs::exists(folder / "a.kept"));
  }
}

TEST(KeptWork, OfOtherWorkItIsRefusedAndNothingIsLost) {
  const TempDir dir;
  const fs::path folder = two_parts(dir);
  for (const auto& [other, line] : {std::pair("model 12ab\nlayer 0.2\n", "layer was 0.1, now it is 0.2"),
                                    std::pair("model 12ab\n", "layer was 0.1, now there is none"),
                                    std::pair("model 12ab\nsize 3\nlayer 0.1\n", "size was not there")}) {
    try {
      KeptWork(folder, other);
      FAIL() << "not refused";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::BadInput);
      EXPECT_THAT(error.what(), HasSubstr(line));
      EXPECT_THAT(error.what(), HasSubstr(folder.string()));
    }
  }
  std::set<std::string> parts;
  EXPECT_THAT(opened(folder, parts), IsEmpty());
  EXPECT_THAT(parts, SizeIs(2));
}

TEST(KeptWork, WhereNothingIsKeptAnyWorkMayBegin) {
  const TempDir dir;
  static_cast<void>(KeptWork(dir / "kept", "model 99\n"));
  const KeptWork other(dir / "kept", work);
  EXPECT_EQ(content(dir / "kept/work"), work);
}

TEST(KeptWork, PartsOfOtherWorkAreNotTakenForItsOwn) {
  const TempDir dir;
  const fs::path folder = two_parts(dir);
  fs::remove(folder / "work");
  const KeptWork other(folder, "model 99\n");
  EXPECT_THAT(other.parts(), IsEmpty());
}

TEST(KeptWork, OneProcessAtATime) {
  const TempDir dir;
  const KeptWork one(dir / "kept", work);
  try {
    KeptWork(dir / "kept", work);
    FAIL() << "two at once";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::Io);
    EXPECT_THAT(error.what(), HasSubstr("another run"));
  }
}

TEST(KeptWork, AFileOfThatNameIsNotTouched) {
  const TempDir dir;
  write(dir / "kept", "mine");
  EXPECT_THROW(KeptWork(dir / "kept", work), Error);
  EXPECT_EQ(content(dir / "kept"), "mine");
}

TEST(KeptWork, DiscardingLeavesWhatIsNotItsOwn) {
  const TempDir dir;
  const fs::path folder = two_parts(dir);
  write(folder / "notes.txt", "mine");
  KeptWork(folder, work).discard();
  EXPECT_THAT(names_in(folder), ElementsAre("notes.txt"));
}

TEST(KeptWork, EveryPartIsWholeWhereverAProcessIsKilled) {
  const TempDir dir;
  for (std::size_t enough = 1; enough <= 20; ++enough) {
    const pid_t child = fork();
    if (child == 0) {
      KeptWork kept(dir / "kept", work);
      for (int n = static_cast<int>(kept.parts().size());; ++n) {
        KeptWork::Writer part = kept.write("part" + std::to_string(n));
        for (int i = 0; i < 30000; ++i) part.put(n + i);
        part.commit();
      }
    }
    const auto parts_there = [&] {
      std::error_code error;
      std::size_t count = 0;
      for (const auto& entry : fs::directory_iterator(dir / "kept", error))
        count += entry.path().extension() == ".kept" ? 1 : 0;
      return count;
    };
    while (parts_there() < enough) std::this_thread::yield();
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    std::vector<std::string> said;
    const KeptWork kept(dir / "kept", work, Context({}, [&](std::string_view line) { said.emplace_back(line); }));
    EXPECT_THAT(said, IsEmpty());
    ASSERT_GE(kept.parts().size(), enough);
    for (int n = 0; n < static_cast<int>(kept.parts().size()); ++n) {
      KeptWork::Reader part = kept.read("part" + std::to_string(n));
      std::vector<int> values(30000), wanted(30000);
      part.read(std::as_writable_bytes(std::span(values)));
      std::iota(wanted.begin(), wanted.end(), n);
      ASSERT_EQ(values, wanted);
    }
    EXPECT_THAT(names_in(dir / "kept"), SizeIs(kept.parts().size() + 1));  // nothing half written
  }
}

TEST(ContentHash, NamesContentWhateverTheFileIsCalled) {
  const TempDir dir;
  std::string bytes(3000017, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i >> 3);
  write(dir / "a", bytes);
  write(dir / "b", bytes);
  const std::string name = ContentHash().add_file(dir / "a").text();
  EXPECT_THAT(name, SizeIs(16));
  EXPECT_EQ(ContentHash().add_file(dir / "b").text(), name);
  std::set<std::string> names{name};
  for (const std::size_t at : {std::size_t{0}, std::size_t{1} << 20, bytes.size() - 1}) {
    std::string other = bytes;
    other[at] = static_cast<char>(other[at] ^ 1);
    write(dir / "b", other);
    names.insert(ContentHash().add_file(dir / "b").text());
  }
  write(dir / "b", bytes + '\0');
  names.insert(ContentHash().add_file(dir / "b").text());
  EXPECT_THAT(names, SizeIs(5));
  EXPECT_NE(ContentHash().add("ab").add("c").text(), ContentHash().add("a").add("bc").text());
  EXPECT_THROW(ContentHash().add_file(dir / "none"), Error);
}

}  // namespace
}  // namespace fibrolite
