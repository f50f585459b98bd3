// SPDX-License-Identifier: GPL-3.0-or-later
// What every command that writes files sets up before its work, and how it ends.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fibrolite/ops/report.h"
#include "options.h"
#include "outputs.h"
#include "run.h"
#include "terminal.h"

namespace fibrolite::cli {

/// Threads, terminal, outputs and report of one command. One at a time.
class Job {
 public:
  /// `more`: files it may write besides OUT and the report. @throws as Outputs.
  Job(const std::string& command, const Recipe& recipe, const ModelOptions& model, const RunOptions& run,
      const OutputOptions& output, const std::vector<std::filesystem::path>& more = {});

  Report report;
  const std::filesystem::path report_path;
  const std::vector<std::filesystem::path> targets;  ///< Every file it may write, the report last.
  Outputs outputs;
  [[nodiscard]] const Context& context() const { return terminal_.context(); }
  /// Write the report and put every output in its place. @throws Error Io, Cancelled; then none of them is there.
  void finish();

 private:
  const ThreadLimit threads_;
  const Terminal terminal_;
};

}  // namespace fibrolite::cli
