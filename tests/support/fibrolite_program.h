// SPDX-License-Identifier: GPL-3.0-or-later
// The program under test, FIBROLITE_PROGRAM: runs that must succeed, runs that must be refused, and reports.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "run_program.h"

namespace fibrolite::testing {

inline Finished run(const std::vector<std::string>& arguments) {
  Finished finished = run_program(FIBROLITE_PROGRAM, arguments);
  EXPECT_EQ(finished.code, 0) << finished.err;
  return finished;
}

inline nlohmann::json report_in(const std::filesystem::path& file) { return nlohmann::json::parse(content(file)); }

/// Nothing but one line of error: WHAT (WHERE); TRY.
inline void expect_refused(const Finished& run, int code) {
  EXPECT_EQ(run.code, code) << run.err;
  EXPECT_THAT(run.err, ::testing::StartsWith("fibrolite: error: "));
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_THAT(run.err, ::testing::HasSubstr("; ")) << "it does not say what to try";
  EXPECT_EQ(run.out, "");
}
/// Runs and expects: this exit code, one line of error, nothing written. Returns the line.
inline std::string refused_run(const std::vector<std::string>& arguments, int code,
                               const std::filesystem::path& outputs) {
  const Finished run = run_program(FIBROLITE_PROGRAM, arguments);
  expect_refused(run, code);
  EXPECT_THAT(names_in(outputs), ::testing::IsEmpty());
  return run.err;
}

}  // namespace fibrolite::testing
