// SPDX-License-Identifier: GPL-3.0-or-later
// fibrolite-decode
//
// An image file in on stdin (whatever OpenCV's codecs read), its gray values out on stdout:
//   "FBLTGRY1"  u32 width  u32 height  width * height u8, row 0 first
// Eight bits of one channel stay as they are. Deeper values are stretched from the lowest to the highest. Of several
// channels (what is transparent is one too) it is the mix in which most stands out.
// Exit codes: 0 done, 3 not an image.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace {

/// From 0 to 255. Values that are no numbers become the lowest.
cv::Mat stretched(cv::Mat values) {
  cv::patchNaNs(values, -INFINITY);
  const cv::Mat numbers = (values > -FLT_MAX) & (values < FLT_MAX);
  double low = 0, high = 0;
  cv::minMaxLoc(values, &low, &high, nullptr, nullptr, numbers);
  values.setTo(low, ~numbers);
  return (values - low) * (high > low ? 255 / (high - low) : 0);
}

/// The principal axis of how channels differ from their surroundings: uneven light does not count.
cv::Mat mixed(const std::vector<cv::Mat>& channels) {
  const int count = static_cast<int>(channels.size());
  const int width = std::max(3, std::min(channels[0].cols, channels[0].rows) / 8) | 1;
  std::vector<cv::Mat> difference(channels.size());
  for (std::size_t i = 0; i < channels.size(); ++i) {
    cv::blur(channels[i], difference[i], {width, width}, {-1, -1}, cv::BORDER_REFLECT);
    difference[i] = channels[i] - difference[i];
  }
  cv::Mat covariance(count, count, CV_64F), values, axes;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      covariance.at<double>(i, j) =
          difference[static_cast<std::size_t>(i)].dot(difference[static_cast<std::size_t>(j)]);
  cv::eigen(covariance, values, axes);
  const cv::Mat axis = axes.row(0) * (cv::sum(axes.row(0))[0] < 0 ? -1 : 1) / cv::norm(axes.row(0), cv::NORM_L1);
  cv::Mat sum = cv::Mat::zeros(channels[0].size(), CV_32F);
  double least = 0;  // what it can be
  for (int i = 0; i < count; ++i) {
    const double weight = axis.at<double>(0, i);
    sum += weight * channels[static_cast<std::size_t>(i)];
    least += std::min(weight, 0.0) * 255;
  }
  return sum - least;
}

cv::Mat gray(const cv::Mat& image) {
  if (image.type() == CV_8U) return image;
  cv::Mat values;
  image.convertTo(values, CV_32F);
  if (image.depth() != CV_8U) values = stretched(values.reshape(1)).reshape(image.channels());
  if (image.channels() > 1) {
    std::vector<cv::Mat> channels;
    cv::split(values, channels);
    if (channels.size() == 4)  // colour behind what is transparent means nothing
      for (std::size_t i = 0; i < 3; ++i) channels[i] = channels[i].mul(channels[3], 1 / 255.0);
    values = mixed(channels);
  }
  values.convertTo(values, CV_8U);
  return values;
}

}  // namespace

int main() {
  constexpr int not_an_image = 3, no_output = 7;
  const std::vector<char> bytes{std::istreambuf_iterator<char>(std::cin), std::istreambuf_iterator<char>()};
  if (bytes.empty()) return not_an_image;
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
    if (image.empty()) return not_an_image;
    image = gray(image);
  } catch (const cv::Exception&) {
    return not_an_image;
  }
  const std::uint32_t size[2] = {static_cast<std::uint32_t>(image.cols), static_cast<std::uint32_t>(image.rows)};
  bool good = std::fwrite("FBLTGRY1", 8, 1, stdout) == 1 && std::fwrite(size, sizeof size, 1, stdout) == 1;
  for (int y = 0; y < image.rows; ++y)
    good = good && std::fwrite(image.ptr(y), static_cast<std::size_t>(image.cols), 1, stdout) == 1;
  return good && std::fflush(stdout) == 0 ? 0 : no_output;
}
