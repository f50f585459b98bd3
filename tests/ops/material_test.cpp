// SPDX-License-Identifier: GPL-3.0-or-later
#include "fibrolite/ops/material.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "fibrolite/error.h"

namespace fibrolite {
namespace {

using ::testing::HasSubstr;

TEST(Material, TheFirstIsTheDefault) {
  ASSERT_EQ(materials().size(), 5U);
  EXPECT_EQ(materials().front().name, "PLA");
  EXPECT_EQ(material("PLA"), Material{});
}

/// Wrong units are wrong by powers of ten: every number must be that of a material one can print.
TEST(Material, NumbersAreOfTheRightSize) {
  for (const NamedMaterial& row : materials()) {
    EXPECT_NO_THROW(check_material(row.material)) << row.name;
    EXPECT_FALSE(row.source.empty()) << row.name;
    EXPECT_EQ(material(row.name), row.material);
    EXPECT_GT(row.material.density_g_cm3, 0.8) << row.name;
    EXPECT_LT(row.material.density_g_cm3, 3) << row.name;
    const double yield_strain = row.material.yield_mpa / row.material.young_mpa;
    EXPECT_GT(yield_strain, 0.002) << row.name;
    EXPECT_LT(yield_strain, 0.04) << row.name;
  }
}

TEST(Material, BadNumbersAreRefusedByName) {
  const auto refused = [](const Material& bad, const char* key) {
    try {
      check_material(bad);
      ADD_FAILURE() << key << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Code::BadRecipe);
      EXPECT_THAT(error.what(), HasSubstr(key));
    }
  };
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    refused({.density_g_cm3 = bad}, "material.density_g_cm3");
    refused({.young_mpa = bad}, "material.young_mpa");
    refused({.yield_mpa = bad}, "material.yield_mpa");
  }
  for (const double bad : {-0.1, 0.5, std::nan("")}) refused({.poisson = bad}, "material.poisson");
}

TEST(Material, AnUnknownOneNamesTheNearest) {
  try {
    static_cast<void>(material("PA-12"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::BadRecipe);
    EXPECT_THAT(error.what(), HasSubstr("did you mean PA12?"));
  }
}

}  // namespace
}  // namespace fibrolite
