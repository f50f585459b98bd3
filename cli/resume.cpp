// SPDX-License-Identifier: GPL-3.0-or-later
#include "resume.h"

#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>
#include <vector>

#include "fibrolite/ops/report.h"
#include "terminal.h"

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* outputs_part = "outputs";

fs::path folder_beside(const fs::path& output) {
  std::string name = ".";
  name.append(output.filename().string()).append(".resume");
  return output.parent_path() / name;
}

/// A file, and what OutputFile had begun of it.
void remove_unfinished(const fs::path& file) {
  std::error_code error;
  fs::remove(file, error);
  const std::string begun = std::string(".").append(file.filename().string()).append(".");
  std::vector<fs::path> all;
  for (const fs::directory_entry& entry : fs::directory_iterator(file.parent_path(), error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begun) && name.ends_with(".part")) all.push_back(entry.path());
  }
  for (const fs::path& path : all) fs::remove(path, error);
}

/// Names of this run's unfinished outputs in place of those of the run before, which go.
void take_over(KeptWork& kept, const Outputs& outputs) {
  std::string names;
  if (kept.holds(outputs_part)) {
    kept.read(outputs_part).get_list(names);
    std::istringstream lines(names);
    for (std::string line; std::getline(lines, line);) remove_unfinished(line);
    names.clear();
  }
  std::error_code error;
  for (const fs::path& file : outputs.hidden()) names.append(fs::absolute(file, error).string()).append("\n");
  KeptWork::Writer part = kept.write(outputs_part);
  part.put_list(names);
  part.commit();
}

}  // namespace

WorkText::WorkText(const Context& context) : context_(context) {
  add("version", version());
  const fs::path program = "/proc/self/exe";
  std::error_code error;
  if (fs::exists(program, error)) add_file("program", program);
}

void WorkText::add(const std::string& name, const std::string& value) {
  text_.append(name).append(" ").append(value).append("\n");
}

void WorkText::add(const std::string& name, double value) { add(name, nlohmann::json(value).dump()); }

void WorkText::add_file(const std::string& name, const fs::path& file) {
  add(name, ContentHash().add_file(file, context_).text());
}

void WorkText::add(const Recipe& recipe) {
  const nlohmann::json keys = nlohmann::json::parse(to_json(recipe)).flatten();
  for (const auto& [path, value] : keys.items()) {
    std::string name = path.substr(1);
    for (char& c : name) c = c == '/' ? '.' : c;
    add(name, value.dump());
  }
  if (recipe.mfs.micrograph) add_file("mfs.template's_content", *recipe.mfs.micrograph);
}

Resume::Resume(const fs::path& output, const WorkText& work, const Outputs& outputs, const Context& context)
    : kept_(std::make_shared<KeptWork>(folder_beside(output), work.text(), context)) {
  take_over(*kept_, outputs);
  set_resumable(true);
}

Resume::~Resume() {
  const bool nothing = kept_->parts().size() <= (kept_->holds(outputs_part) ? 1 : 0);
  if (nothing) kept_->discard();
  set_resumable(!nothing);
}

void Resume::done() { kept_->discard(); }

}  // namespace fibrolite::cli
