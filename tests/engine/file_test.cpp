// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#endif

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>

#include "fibrolite/error.h"
#include "models.h"
#include "run_program.h"

namespace fibrolite {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TempDir;

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::ptrdiff_t files_in(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), fs::directory_iterator{});
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

TEST(OutputFile, appears_only_when_committed) {
  const TempDir dir;
  OutputFile file(dir / "out.txt");
  file.write("one ");
  file.write(std::string(3 << 20, 'x'));  // longer than the buffer
  file.write(" two");
  EXPECT_FALSE(fs::exists(dir / "out.txt"));
  file.commit();
  EXPECT_EQ(content(dir / "out.txt"), "one " + std::string(3 << 20, 'x') + " two");
  EXPECT_EQ(files_in(dir.path()), 1);
}

TEST(OutputFile, leaves_nothing_when_destroyed_uncommitted) {
  const TempDir dir;
  std::ofstream(dir / "out.txt") << "old";
  {
    OutputFile file(dir / "out.txt");
    file.write("new");
    EXPECT_EQ(files_in(dir.path()), testing::has_nameless_files(dir.path()) ? 1 : 2);
  }
  EXPECT_EQ(content(dir / "out.txt"), "old");
  EXPECT_EQ(files_in(dir.path()), 1);
}

TEST(OutputFile, replaces_an_existing_file) {
  const TempDir dir;
  std::ofstream(dir / "out.txt") << "a longer old text";
  OutputFile file(dir / "out.txt");
  file.write("new");
  file.commit();
  EXPECT_EQ(content(dir / "out.txt"), "new");
}

TEST(OutputFile, writes_through_a_link) {
  const TempDir dir;
  std::ofstream(dir / "real.txt") << "old";
  fs::create_symlink(dir / "real.txt", dir / "link.txt");
  OutputFile file(dir / "link.txt");
  file.write("new");
  file.commit();
  EXPECT_TRUE(fs::is_symlink(dir / "link.txt"));
  EXPECT_EQ(content(dir / "real.txt"), "new");
}

TEST(OutputFile, obeys_the_mask_of_the_process) {
  const TempDir dir;
  const mode_t before = umask(027);
  OutputFile file(dir / "out.txt");
  file.commit();
  umask(before);
  struct stat status {};
  ASSERT_EQ(stat((dir / "out.txt").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640U);
}

TEST(OutputFile, overwrites_bytes_in_place) {
  const TempDir dir;
  OutputFile file(dir / "out.txt");
  file.write("0123456789");
  const std::array bytes{std::byte{'a'}, std::byte{'b'}};
  file.overwrite(3, bytes);
  file.write("!");
  file.commit();
  EXPECT_EQ(content(dir / "out.txt"), "012ab56789!");
}

TEST(OutputFile, names_a_missing_folder) {
  const TempDir dir;
  const Error error = error_of([&] { OutputFile(dir.path() / "nowhere" / "out.txt"); });
  EXPECT_EQ(error.code(), Code::Io);
  EXPECT_THAT(error.what(), HasSubstr("nowhere"));
}

TEST(OutputFile, refuses_a_folder_and_a_device) {
  const TempDir dir;
  EXPECT_EQ(error_of([&] { OutputFile(dir.path()); }).code(), Code::Io);
  fs::create_symlink("/dev/full", dir / "out.txt");
  EXPECT_EQ(error_of([&] { OutputFile(dir / "out.txt"); }).code(), Code::Io);
  EXPECT_EQ(files_in(dir.path()), 1);
}

TEST(OutputFile, refuses_a_folder_without_write_permission) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  const TempDir dir;
  fs::create_directory(dir / "locked");
  fs::permissions(dir / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_EQ(error_of([&] { OutputFile(dir.path() / "locked" / "out.txt"); }).code(), Code::Io);
}

TEST(OutputFile, discarding_removes_what_is_uncommitted_and_stops_its_commit) {
  const TempDir dir;
  OutputFile done(dir / "done.txt");
  done.commit();
  OutputFile file(dir / "out.txt");
  OutputFile other(dir / "other.txt");
  file.write("text");
  discard_uncommitted_files();
  EXPECT_EQ(files_in(dir.path()), 1);
  EXPECT_EQ(error_of([&] { file.commit(); }).code(), Code::Cancelled);
  EXPECT_EQ(files_in(dir.path()), 1);
}

/// How a child ends that does this: its exit code, or 1000 + the signal.
int end_of_child(const auto& work) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      work();
    } catch (...) {
      _exit(1);
    }
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

TEST(OutputFile, is_gone_with_a_process_that_is_killed) {
  const TempDir dir;
  if (!testing::has_nameless_files(dir.path())) GTEST_SKIP() << "no files without a name here";
  std::ofstream(dir / "held.txt") << "old";
  const int end = end_of_child([&] {
    OutputFile file(dir / "out.txt");
    file.write(std::string(3 << 20, 'x'));
    const HeldOutput held(dir / "held.txt");
    OutputFile whole(dir / "held.txt");
    whole.write("new");
    whole.commit();
    raise(SIGKILL);
  });
  EXPECT_EQ(end, 1000 + SIGKILL);
  EXPECT_EQ(files_in(dir.path()), 1);
  EXPECT_EQ(content(dir / "held.txt"), "old");
}

TEST(OutputFile, refuses_a_name_that_will_be_too_long_at_once) {
  const TempDir dir;
  EXPECT_THAT(error_of([&] { OutputFile(dir / std::string(250, 'a')); }).what(), HasSubstr("File name too long"));
}

TEST(HeldOutput, gets_its_name_when_released) {
  const TempDir dir;
  std::ofstream(dir / "a.txt") << "a longer old text";
  for (const std::string text : {"first", "second"}) {
    HeldOutput held(dir / "a.txt");
    held.release();  // nothing yet
    OutputFile file(dir / "a.txt");
    file.write(text);
    file.commit();
    held.release();
    EXPECT_EQ(content(dir / "a.txt"), text);
    EXPECT_EQ(files_in(dir.path()), 1);
  }
}

#ifdef __linux__
enum class Forbidden { NamelessFiles, Links };

/// For the rest of this process, what it forbids fails as on a system that does not have it.
void forbid(Forbidden what) {
  const auto load = [](std::size_t from) { return sock_filter BPF_STMT(BPF_LD | BPF_W | BPF_ABS, unsigned(from)); };
  const auto skip_unless = [](std::uint16_t test, std::uint32_t value, std::uint8_t steps) {
    return sock_filter BPF_JUMP(std::uint16_t(BPF_JMP | test | BPF_K), value, 0, steps);
  };
  const auto end = [](std::uint32_t how) { return sock_filter BPF_STMT(BPF_RET | BPF_K, how); };
  const bool links = what == Forbidden::Links;
  std::array filter{load(offsetof(seccomp_data, nr)),
                    skip_unless(BPF_JEQ, links ? SYS_linkat : SYS_openat, 3),
                    load(offsetof(seccomp_data, args) + (links ? 4 : 2) * sizeof(std::uint64_t)),
                    skip_unless(BPF_JSET, links ? AT_SYMLINK_FOLLOW : O_TMPFILE & ~O_DIRECTORY, 1),
                    end(SECCOMP_RET_ERRNO | (links ? EPERM : EOPNOTSUPP)),
                    end(SECCOMP_RET_ALLOW)};
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0)
    _exit(2);
}

TEST(OutputFile, does_without_what_the_system_lacks) {
  for (const Forbidden what : {Forbidden::NamelessFiles, Forbidden::Links}) {
    const TempDir dir;
    std::ofstream(dir / "old.txt") << "old";
    const std::string text(3 << 20, 'x');
    const int end = end_of_child([&] {
      umask(027);
      forbid(what);
      for (const char* name : {"old.txt", "new.txt"}) {
        HeldOutput held(dir / name);
        OutputFile file(dir / name);
        file.write(text);
        if (what == Forbidden::NamelessFiles && files_in(dir.path()) != 2) _exit(3);
        file.commit();
        held.release();
      }
      OutputFile file(dir / "discarded.txt");
      file.write(text);
      discard_uncommitted_files();
      if (error_of([&] { file.commit(); }).code() != Code::Cancelled) _exit(4);
    });
    if (end == 2) GTEST_SKIP() << "system calls cannot be forbidden here";
    EXPECT_EQ(end, 0);
    EXPECT_EQ(files_in(dir.path()), 2);
    for (const char* name : {"old.txt", "new.txt"}) {
      EXPECT_EQ(content(dir / name), text);
      struct stat status {};
      ASSERT_EQ(stat((dir / name).c_str(), &status), 0);
      EXPECT_EQ(status.st_mode & 0777, 0640U);
    }
  }
}
#endif

TEST(ScratchFile, gives_back_what_was_appended_and_leaves_no_name) {
  const TempDir dir;
  ScratchFile file(dir.path());
  const std::string first(3'000'000, 'a'), second = "second";
  const auto append = [&](const std::string& text) { return file.append(std::as_bytes(std::span(text))); };
  const std::uint64_t at_first = append(first), at_second = append(second);
  const auto read = [&](std::uint64_t at, std::size_t size) {
    std::string text(size, ' ');
    file.read(at, std::as_writable_bytes(std::span(text)));
    return text;
  };
  EXPECT_EQ(read(at_second, second.size()), second);
  EXPECT_EQ(read(at_first, first.size()), first);
  EXPECT_EQ(files_in(dir.path()), 0);
  EXPECT_EQ(error_of([&] { read(at_second, 100); }).code(), Code::Io);
}

TEST(ScratchFile, names_a_missing_folder) {
  const TempDir dir;
  const Error error = error_of([&] { ScratchFile(dir.path() / "nowhere"); });
  EXPECT_EQ(error.code(), Code::Io);
  EXPECT_THAT(error.what(), HasSubstr("nowhere"));
}

// A file system of 64 KiB.
class SmallDisk : public ::testing::Test {
 protected:
  void SetUp() override {
    if (mount("none", dir.path().c_str(), "tmpfs", 0, "size=64k") != 0)
      GTEST_SKIP() << "a small file system cannot be mounted here";
    mounted_ = true;
  }
  void TearDown() override {
    if (mounted_) umount(dir.path().c_str());
  }
  TempDir dir;

 private:
  bool mounted_ = false;
};

TEST_F(SmallDisk, a_full_disk_is_an_error_and_keeps_the_old_file) {
  std::ofstream(dir / "out.txt") << "old";
  {
    OutputFile file(dir / "out.txt");
    const Error error = error_of([&] {
      file.write(std::string(100'000, 'x'));
      file.commit();
    });
    EXPECT_EQ(error.code(), Code::Io);
    EXPECT_THAT(error.what(), HasSubstr("No space left"));
  }
  EXPECT_EQ(content(dir / "out.txt"), "old");
  EXPECT_EQ(files_in(dir.path()), 1);
}

TEST_F(SmallDisk, a_full_disk_ends_a_scratch_file_too) {
  const std::string much(100'000, 'x');
  ScratchFile file(dir.path());
  const Error error = error_of([&] { file.append(std::as_bytes(std::span(much))); });
  EXPECT_EQ(error.code(), Code::Io);
  EXPECT_THAT(error.what(), HasSubstr("No space left"));
}

}  // namespace
}  // namespace fibrolite
