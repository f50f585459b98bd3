// SPDX-License-Identifier: GPL-3.0-or-later
#include "job.h"

#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>

namespace fibrolite::cli {
namespace {

namespace fs = std::filesystem;

/// "stl"
std::string format(const fs::path& file) {
  std::string ending = file.extension().string();
  ending.erase(0, 1);
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

/// A report that another output of the same name wrote: only the ending tells them apart.
bool is_of_another_output(const fs::path& report, const fs::path& output) {
  std::error_code error;
  if (!fs::is_regular_file(report, error)) return false;
  std::ifstream in(report, std::ios::binary);
  const nlohmann::json json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object() || !json.contains("formats") || !json["formats"].is_array() || json["formats"].empty())
    return false;
  return json["formats"].front() != format(output);
}

/// --report, else the first output with the ending .report.json, so hand.report.json for hand.zip. Where hand.stl has
/// its report there, hand.zip.report.json: neither stands in the other's way. --overwrite keeps to the first, unless
/// the second is there already.
fs::path choose_report(const OutputOptions& output, bool overwrite) {
  if (output.report) return *output.report;
  const fs::path& first = output.files.front();
  fs::path plain = first, full = first;
  plain.replace_extension(".report.json");
  full += ".report.json";
  std::error_code error;
  if (fs::exists(full, error)) return full;
  return !overwrite && is_of_another_output(plain, first) ? full : plain;
}

std::vector<fs::path> all_targets(const OutputOptions& output, const std::vector<fs::path>& more,
                                  const fs::path& report) {
  std::vector<fs::path> all = output.files;
  all.insert(all.end(), more.begin(), more.end());
  all.push_back(report);
  return all;
}

}  // namespace

Job::Job(const std::string& command, const Recipe& recipe, const ModelOptions& model, const RunOptions& run,
         const OutputOptions& output, const std::vector<fs::path>& more)
    : report_path(choose_report(output, run.overwrite)),
      targets(all_targets(output, more, report_path)),
      outputs(targets, model.path, run.overwrite),
      threads_(run.threads),
      terminal_(run) {
  report.command = command;
  for (const fs::path& file : output.files) report.formats.push_back(format(file));
  report.recipe = recipe;
  report.infill = "";
  report.threads = ThreadLimit::count();
}

void Job::finish() {
  write_text(outputs.place(report_path), to_json(report));
  context().check();
  outputs.commit();
  context().progress(1);
}

}  // namespace fibrolite::cli
