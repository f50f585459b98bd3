// SPDX-License-Identifier: GPL-3.0-or-later
#include "outputs.h"

#include <fcntl.h>
#include <stdio.h>  // NOLINT(modernize-deprecated-headers): renameat2 is no part of <cstdio>
#include <unistd.h>

#include <atomic>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "exit_codes.h"
#include "fibrolite/error.h"

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

// What a signal handler may read: names that do not change while they are listed here.
std::atomic<const std::vector<std::string>*> hidden_names{nullptr};
std::atomic<bool> in_commit{false};

/// Hidden name and the one that was asked for, of all outputs ever planned.
std::vector<std::pair<std::string, std::string>>& places() {
  static std::vector<std::pair<std::string, std::string>> all;
  return all;
}

/// The file itself where `target` is a link to one, so that the link stays.
fs::path followed(const fs::path& target) {
  std::error_code error;
  if (!fs::is_symlink(target, error)) return target;
  const fs::path real = fs::weakly_canonical(target, error);
  return error ? target : real;
}

/// Keeps the ending, which says the format.
fs::path hidden_name(const fs::path& target) {
  std::string name = ".";
  name += target.stem().string() + "." + std::to_string(getpid()) + ".new" + target.extension().string();
  return target.parent_path() / name;
}

/// Two files trade their names. False where that cannot be done (not all file systems can), and nothing is changed.
bool exchange(const fs::path& a, const fs::path& b) {
#ifdef RENAME_EXCHANGE
  return ::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0;
#else
  return false;
#endif
}

}  // namespace

Outputs::Outputs(const std::vector<fs::path>& targets, const fs::path& model, bool overwrite) {
  auto names = std::make_unique<std::vector<std::string>>();
  for (const fs::path& asked : targets) {
    const fs::path target = followed(asked);
    std::error_code error;
    const bool exists = fs::exists(target, error);
    if (exists && fs::equivalent(target, model, error))
      throw UsageError("an output would replace the model", asked.string(), "choose another name");
    for (const Item& other : items_)
      if (fs::weakly_canonical(other.target, error) == fs::weakly_canonical(target, error))
        throw UsageError("two outputs have the same name", asked.string(), "choose another name for one");
    if (exists && !overwrite)
      throw Error(Code::Io, "the output exists", asked.string(),
                  "use --overwrite to replace it, or choose another name (a report's by --report)");
    static_cast<void>(OutputFile(target));  // throws if the folder is missing or nothing can be written there
    items_.push_back({asked, target, hidden_name(target), exists});
    held_.emplace_back(items_.back().hidden);
    names->push_back(fs::absolute(items_.back().hidden, error).string());
    places().emplace_back(items_.back().hidden.string(), asked.string());
  }
  hidden_names = names.release();
}

Outputs::~Outputs() {
  discard();
  delete hidden_names.exchange(nullptr);
}

const fs::path& Outputs::place(const fs::path& target) const {
  for (const Item& item : items_)
    if (item.asked == target) return item.hidden;
  throw Error(Code::Internal, "an output that was not planned", target.string());
}

std::vector<fs::path> Outputs::hidden() const {
  std::vector<fs::path> all;
  for (const Item& item : items_) all.push_back(item.hidden);
  return all;
}

void Outputs::commit() {
  struct Committing {
    Committing() { in_commit = true; }
    ~Committing() { in_commit = false; }
  };
  const Committing committing;
  for (HeldOutput& held : held_) held.release();
  // What is replaced keeps the hidden name until all are in place.
  std::vector<bool> kept(items_.size(), false);
  std::error_code error, ignored;
  for (std::size_t i = 0; i < items_.size(); ++i) {
    const auto& [asked, target, hidden, existed] = items_[i];
    kept[i] = existed && fs::is_regular_file(target, ignored) && exchange(hidden, target);
    if (!kept[i]) fs::rename(hidden, target, error);
    if (!error) continue;
    for (std::size_t j = 0; j < i; ++j) {
      if (kept[j]) {
        exchange(items_[j].hidden, items_[j].target);
      } else if (!items_[j].existed) {
        fs::remove(items_[j].target, ignored);
      }
    }
    throw Error(Code::Io, "the output cannot be put in place: " + error.message(), asked.string());
  }
  for (std::size_t i = 0; i < items_.size(); ++i)
    if (kept[i]) fs::remove(items_[i].hidden, ignored);
  for (const Item& item : items_) sync_folder_of(item.target);
}

void Outputs::discard() noexcept {
  if (const auto* names = hidden_names.load())
    for (const std::string& name : *names) ::unlink(name.c_str());
}

bool Outputs::committing() noexcept { return in_commit; }

std::string with_asked_names(std::string text) {
  for (const auto& [hidden, asked] : places()) {
    const auto at = text.find(hidden);
    if (at != std::string::npos) text.replace(at, hidden.size(), asked);
  }
  return text;
}

}  // namespace fibrolite::cli
