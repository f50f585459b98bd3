// SPDX-License-Identifier: GPL-3.0-or-later
#include "helper_program.h"

#include <unistd.h>

#include <cstdlib>
#include <vector>

#include "fibrolite/error.h"

namespace fibrolite {

std::filesystem::path helper_program(const std::string& name, const char* environment) {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  if (const char* named = std::getenv(environment)) places.emplace_back(named);
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  if (!program.empty()) {
    places.push_back(program.parent_path() / name);
    places.push_back(program.parent_path().parent_path() / "libexec" / "fibrolite" / name);
  }
  places.push_back(fs::path(FIBROLITE_BUILD_BIN) / name);
  places.push_back(fs::path(FIBROLITE_INSTALL_LIBEXEC) / name);
  for (const fs::path& place : places) {
    if (access(place.c_str(), X_OK) == 0 && fs::is_regular_file(place, ignored)) return place;
  }
  throw Error(Code::SolverFailed, "the program " + name + " is nowhere to be found", {},
              std::string("reinstall, or name it in ").append(environment));
}

}  // namespace fibrolite
