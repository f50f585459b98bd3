// SPDX-License-Identifier: GPL-3.0-or-later
#include "job.h"

namespace fibrolite::cli {

Job::Job(const std::string& command, const Recipe& recipe, const ModelOptions& model, const RunOptions& run,
         const std::vector<std::filesystem::path>& targets)
    : outputs(targets, model.path, run.overwrite), threads_(run.threads), terminal_(run) {
  report.command = command;
  report.recipe = recipe;
  report.infill = "";
  report.threads = ThreadLimit::count();
}

void Job::finish(const std::filesystem::path& report_path) {
  write_text(outputs.place(report_path), to_json(report));
  context().check();
  outputs.commit();
  context().progress(1);
}

}  // namespace fibrolite::cli
