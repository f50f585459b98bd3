// SPDX-License-Identifier: GPL-3.0-or-later
// What a refused recipe is told.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "fibrolite/error.h"

namespace fibrolite::testing {

/// The message of the BadRecipe error that `work` throws; empty if it throws none.
inline std::string refusal(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::BadRecipe) << error.what();
    return error.what();
  }
  return {};
}

}  // namespace fibrolite::testing
