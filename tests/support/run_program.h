// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the program as a user would: its own process, its own output, its own exit code.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

#include "models.h"

namespace fibrolite::testing {

inline std::string content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Whether files there can be without a name. Where they cannot, a killed process leaves what it was writing.
inline bool has_nameless_files([[maybe_unused]] const std::filesystem::path& folder) {
#ifdef O_TMPFILE
  const int fd = open(folder.c_str(), O_TMPFILE | O_RDWR, 0600);
  if (fd >= 0) close(fd);
  return fd >= 0;
#else
  return false;
#endif
}

/// A started program. stdout and stderr go to files, so that it never waits for a reader.
class Process {
 public:
  Process(const std::filesystem::path& program, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program.string());
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const std::string out = (folder_ / "out").string(), err = (folder_ / "err").string();
    pid_ = fork();
    if (pid_ == 0) {
      dup2(open(out.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
      dup2(open(err.c_str(), O_WRONLY | O_CREAT, 0600), STDERR_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
  }
  void send(int signal) const { kill(pid_, signal); }
  [[nodiscard]] bool ended() {
    if (!ended_) ended_ = waitpid(pid_, &status_, WNOHANG) == pid_;
    return ended_;
  }
  /// Exit code, or 1000 + the signal that ended it.
  int wait() {
    if (!ended_) waitpid(pid_, &status_, 0);
    ended_ = true;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 1000 + WTERMSIG(status_);
  }
  /// Sizes of the files that it has open in a folder, those without a name among them.
  [[nodiscard]] std::vector<std::uintmax_t> open_in(const std::filesystem::path& folder) const {
    std::vector<std::uintmax_t> sizes;
    std::error_code error;
    const std::filesystem::path mine = "/proc/" + std::to_string(pid_) + "/fd";
    for (const auto& entry : std::filesystem::directory_iterator(mine, error)) {
      const std::filesystem::path file = std::filesystem::read_symlink(entry.path(), error);
      if (error || file.parent_path() != folder) continue;
      const std::uintmax_t size = std::filesystem::file_size(entry.path(), error);
      if (!error) sizes.push_back(size);
    }
    return sizes;
  }
  [[nodiscard]] std::string out() const { return content(folder_ / "out"); }
  [[nodiscard]] std::string err() const { return content(folder_ / "err"); }

 private:
  TempDir folder_;
  pid_t pid_ = -1;
  int status_ = 0;
  bool ended_ = false;
};

struct Finished {
  int code = 0;
  std::string out, err;
};
inline Finished run_program(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  Process process(program, arguments);
  const int code = process.wait();
  return {code, process.out(), process.err()};
}

/// Names of everything in a folder, hidden files too.
inline std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace fibrolite::testing
