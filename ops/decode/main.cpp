// SPDX-License-Identifier: GPL-3.0-or-later
// fibrolite-decode
//
// An image file in on stdin (whatever OpenCV's codecs read), its gray values out on stdout:
//   "FBLTGRY1"  u32 width  u32 height  width * height u8, row 0 first
// Exit codes: 0 done, 3 not an image.
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <vector>

int main() {
  constexpr int not_an_image = 3, no_output = 7;
  const std::vector<char> bytes{std::istreambuf_iterator<char>(std::cin), std::istreambuf_iterator<char>()};
  if (bytes.empty()) return not_an_image;
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    return not_an_image;
  }
  if (image.empty()) return not_an_image;
  const std::uint32_t size[2] = {static_cast<std::uint32_t>(image.cols), static_cast<std::uint32_t>(image.rows)};
  bool good = std::fwrite("FBLTGRY1", 8, 1, stdout) == 1 && std::fwrite(size, sizeof size, 1, stdout) == 1;
  for (int y = 0; y < image.rows; ++y)
    good = good && std::fwrite(image.ptr(y), static_cast<std::size_t>(image.cols), 1, stdout) == 1;
  return good && std::fflush(stdout) == 0 ? 0 : no_output;
}
