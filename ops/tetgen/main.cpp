// SPDX-License-Identifier: AGPL-3.0-or-later
// fibrolite-tetgen [--cpu-s N] [--memory-mb N] SWITCHES
//
// One closed surface in on stdin, one tetrahedral mesh out on stdout, by TetGen. Everything is little-endian and
// packed:
//   in   "FBLTSRF1"  u64 vertices  u64 triangles  vertices * 3 f64  triangles * 3 u32
//   out  "FBLTTET1"  u64 nodes     u64 tets       nodes * 3 f64     tets * 4 u32      (the input's vertices come first)
// SWITCHES are TetGen's own. Exit codes: 0 done, 2 usage, 3 the input is not in this format, 4 TetGen refused the
// surface; bad surfaces may also crash it, which is why this is a program of its own.
#include <sys/resource.h>
#include <tetgen.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <string>
#include <vector>

namespace {

constexpr int usage_error = 2, format_error = 3, tetgen_refused = 4;
constexpr std::uint64_t largest_count = std::numeric_limits<int>::max() / 4;  // TetGen counts in int

bool read_all(int file, void* data, std::size_t size) {
  char* at = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = read(file, at, size);
    if (got <= 0) return false;
    at += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

bool write_all(int file, const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t put = write(file, at, size);
    if (put <= 0) return false;
    at += put;
    size -= static_cast<std::size_t>(put);
  }
  return true;
}

/// A process that reaches the soft limit of processor time is told so by SIGXCPU; at the hard one it is just killed.
bool limit(int resource, std::uint64_t value, std::uint64_t grace = 0) {
  const rlimit both{value, value + grace};
  return setrlimit(static_cast<__rlimit_resource>(resource), &both) == 0;
}

struct Surface {
  std::vector<double> xyz;
  std::vector<std::uint32_t> corners;
};

/// False unless stdin holds exactly one surface with finite coordinates and indices in range.
bool read_surface(Surface& surface) {
  char magic[8];
  std::uint64_t counts[2];
  if (!read_all(STDIN_FILENO, magic, sizeof magic) || std::memcmp(magic, "FBLTSRF1", sizeof magic) != 0) return false;
  if (!read_all(STDIN_FILENO, counts, sizeof counts)) return false;
  if (counts[0] < 4 || counts[1] < 4 || counts[0] > largest_count || counts[1] > largest_count) return false;
  surface.xyz.resize(3 * counts[0]);
  surface.corners.resize(3 * counts[1]);
  if (!read_all(STDIN_FILENO, surface.xyz.data(), surface.xyz.size() * sizeof(double))) return false;
  if (!read_all(STDIN_FILENO, surface.corners.data(), surface.corners.size() * sizeof(std::uint32_t))) return false;
  for (const double value : surface.xyz) {
    if (!(std::abs(value) <= std::numeric_limits<double>::max())) return false;
  }
  for (const std::uint32_t corner : surface.corners) {
    if (corner >= counts[0]) return false;
  }
  return true;
}

/// TetGen's own form of a surface: every triangle a facet. tetgenio frees what is allocated here.
void fill(tetgenio& io, const Surface& surface) {
  io.numberofpoints = static_cast<int>(surface.xyz.size() / 3);
  io.pointlist = new double[surface.xyz.size()];
  std::memcpy(io.pointlist, surface.xyz.data(), surface.xyz.size() * sizeof(double));
  io.numberoffacets = static_cast<int>(surface.corners.size() / 3);
  io.facetlist = new tetgenio::facet[surface.corners.size() / 3];
  for (int i = 0; i < io.numberoffacets; ++i) {
    tetgenio::facet& facet = io.facetlist[i];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    facet.polygonlist[0].numberofvertices = 3;
    facet.polygonlist[0].vertexlist = new int[3];
    for (int k = 0; k < 3; ++k) {
      facet.polygonlist[0].vertexlist[k] = static_cast<int>(surface.corners[static_cast<std::size_t>(3 * i + k)]);
    }
  }
}

bool write_tets(int file, const tetgenio& io) {
  const std::uint64_t counts[2] = {static_cast<std::uint64_t>(io.numberofpoints),
                                   static_cast<std::uint64_t>(io.numberoftetrahedra)};
  std::vector<std::uint32_t> corners;
  corners.reserve(4 * counts[1]);
  for (int i = 0; i < io.numberoftetrahedra; ++i) {
    const int* tet = io.tetrahedronlist + static_cast<std::ptrdiff_t>(i) * io.numberofcorners;
    for (int k = 0; k < 4; ++k) corners.push_back(static_cast<std::uint32_t>(tet[k]));
  }
  return write_all(file, "FBLTTET1", 8) && write_all(file, counts, sizeof counts) &&
         write_all(file, io.pointlist, 3 * counts[0] * sizeof(double)) &&
         write_all(file, corners.data(), corners.size() * sizeof(std::uint32_t));
}

}  // namespace

int main(int argc, char** argv) {
  std::string switches;
  limit(RLIMIT_CORE, 0);  // a crash here is expected; its core file would only fill the disk
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--cpu-s" || argument == "--memory-mb") {
      const std::uint64_t value = ++i < argc ? std::strtoull(argv[i], nullptr, 10) : 0;
      const bool cpu = argument == "--cpu-s";
      if (value == 0 || !(cpu ? limit(RLIMIT_CPU, value, 1) : limit(RLIMIT_AS, value << 20))) return usage_error;
    } else if (switches.empty() && !argument.empty() && argument[0] != '-') {
      switches = argument;
    } else {
      return usage_error;
    }
  }
  if (switches.empty()) return usage_error;

  // TetGen prints to stdout even when told to be quiet: the answer goes out through a copy nobody else knows.
  const int answer = dup(STDOUT_FILENO);
  if (answer < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) return usage_error;

  try {
    Surface surface;
    if (!read_surface(surface)) return format_error;
    tetgenio in, out;
    fill(in, surface);
    tetrahedralize(switches.data(), &in, &out);
    if (!write_tets(answer, out)) return usage_error;
    _exit(0);  // TetGen's destructors are one more place to crash, and the answer is out
  } catch (const std::exception&) {
    _exit(tetgen_refused);
  } catch (...) {  // TetGen throws plain ints
    _exit(tetgen_refused);
  }
}
