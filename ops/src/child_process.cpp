// SPDX-License-Identifier: GPL-3.0-or-later
#include "child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return number_; }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

/// Kills and reaps the child unless it was waited for.
class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  ~Child() {
    if (pid_ > 0) {
      kill();
      wait();
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  void kill() const { ::kill(pid_, SIGKILL); }
  /// How it ended, in words; empty for exit code 0.
  std::string wait() {
    int status = 0;
    pid_t got = 0;
    do {
      got = waitpid(pid_, &status, 0);
    } while (got < 0 && errno == EINTR);
    pid_ = -1;
    if (got < 0) return {};  // the host ignores SIGCHLD: the system has reaped it and its answer must speak for itself
    if (WIFSIGNALED(status)) {
      return WTERMSIG(status) == SIGXCPU ? "it ran out of processor time"
                                         : std::string("it crashed: ") + strsignal(WTERMSIG(status));
    }
    const int code = WEXITSTATUS(status);
    return code == 0 ? std::string{} : "exit code " + std::to_string(code);
  }

 private:
  pid_t pid_;
};

struct SpawnSettings {
  posix_spawn_file_actions_t files{};
  posix_spawnattr_t attributes{};
  SpawnSettings() {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
};

pid_t spawn(const std::filesystem::path& program, const std::vector<std::string>& arguments, int channel) {
  SpawnSettings settings;
  posix_spawn_file_actions_adddup2(&settings.files, channel, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&settings.files, channel, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&settings.files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&settings.attributes, &none);
  posix_spawnattr_setsigdefault(&settings.attributes, &all);
  posix_spawnattr_setpgroup(&settings.attributes, 0);
  posix_spawnattr_setflags(&settings.attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);

  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  pid_t pid = -1;
  const int failed =
      posix_spawn(&pid, program.c_str(), &settings.files, &settings.attributes, pointers.data(), environ);
  if (failed != 0) {
    throw Error(Code::SolverFailed, "cannot start a helper program: " + std::string(std::strerror(failed)),
                program.string(), "reinstall it");
  }
  return pid;
}

/// One step of the exchange: send what the channel takes, receive what it holds. False when the child has closed its
/// end.
bool exchange(int channel, std::span<const std::byte>& input, bool& sending, std::vector<std::byte>& output) {
  pollfd watched{channel, static_cast<short>(sending ? POLLIN | POLLOUT : POLLIN), 0};
  if (poll(&watched, 1, 50) <= 0) return true;  // a signal or nothing to do: the caller looks at the clock
  if (sending && (watched.revents & POLLOUT) != 0) {
    const ssize_t put = input.empty() ? 0 : send(channel, input.data(), input.size(), MSG_NOSIGNAL);
    if (put > 0) input = input.subspan(static_cast<std::size_t>(put));
    // A child that stopped reading is no error here: how it ends will say why.
    const bool broken = put < 0 && errno != EAGAIN && errno != EINTR;
    if (broken || input.empty()) {
      sending = false;
      shutdown(channel, SHUT_WR);
    }
  }
  if ((watched.revents & (POLLIN | POLLHUP | POLLERR)) != 0) {
    std::byte buffer[1 << 16];
    const ssize_t got = recv(channel, buffer, sizeof buffer, 0);
    if (got > 0) {
      output.insert(output.end(), buffer, buffer + got);
    } else {
      return got < 0 && (errno == EAGAIN || errno == EINTR);
    }
  }
  return true;
}

}  // namespace

ChildResult run_child(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                      std::span<const std::byte> input, const ChildLimits& limits, const Context& context) {
  // One socket pair instead of two pipes: it can be told not to raise SIGPIPE, whatever the host's handlers are.
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw Error(Code::SolverFailed, "cannot talk to a helper program: " + std::string(std::strerror(errno)));
  }
  Descriptor ours(ends[0]);
  Descriptor theirs(ends[1]);
  fcntl(ours.get(), F_SETFL, O_NONBLOCK);
  Child child(spawn(program, arguments, theirs.get()));
  theirs.close();

  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  ChildResult result;
  bool sending = true;
  while (exchange(ours.get(), input, sending, result.output)) {
    context.check();
    if (std::chrono::duration<double>(Clock::now() - start).count() > limits.wall_s) {
      result.failure = "it took more than " + std::to_string(static_cast<long>(limits.wall_s)) + " s";
      return result;
    }
    if (result.output.size() > limits.output_bytes) {
      result.failure = "it wrote more than was expected";
      return result;
    }
  }
  result.failure = child.wait();
  context.check();
  return result;
}

}  // namespace fibrolite
