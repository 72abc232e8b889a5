// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "depth_folder.hpp"

#include <cmath>
#include <cstdint>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/relative_pose.hpp"
#include "loopbit/text_rows.hpp"

#include "image_names.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

std::map<double, fs::path> read_depth_list(const fs::path& list) {
  std::map<double, fs::path> files;
  std::vector<std::string_view> cells;
  for (const TextRow& row : read_rows(list)) {
    split_cells(row.text, cells);
    const auto time_s = cells.empty() ? std::nullopt : parse_number<double>(cells.front());
    if (!time_s || cells.size() != 2) throw_bad_row(list, row, "a timestamp in seconds and a path");
    files[*time_s] = list.parent_path() / cells[1];
  }
  return files;
}

}  // namespace

DepthFolder::DepthFolder(const std::string& folder, double units_per_m)
    : units_per_m_(units_per_m) {
  const fs::path list = fs::path(folder) / "depth.txt";
  std::error_code error;
  if (fs::exists(list, error)) {
    by_time_s_ = read_depth_list(list);
  } else {
    by_stem_ = images_by_stem(folder, "depth images");
  }
  if (!by_stem_.empty() || !by_time_s_.empty()) return;
  throw Error(ErrorKind::input,
              fmt::format("'{}' has no depth images; give a folder of images named like those of "
                          "the run, or one with a depth.txt.",
                          folder));
}

void DepthFolder::check(cv::Size size_px) const {
  (void)read(by_time_s_.empty() ? by_stem_.begin()->second : by_time_s_.begin()->second, size_px);
}

cv::Mat1f DepthFolder::depth_m(const std::string& name, std::optional<double> time_s,
                               cv::Size size_px) const {
  constexpr double kMaxGap_s = 0.02;  // as the tools of TUM RGB-D associate
  const fs::path* file = nullptr;
  if (const auto found = by_stem_.find(fs::path(name).stem().string()); found != by_stem_.end()) {
    file = &found->second;
  }
  if (time_s) {
    double least_s = kMaxGap_s;
    const auto end = by_time_s_.upper_bound(*time_s + kMaxGap_s);
    for (auto at = by_time_s_.lower_bound(*time_s - kMaxGap_s); at != end; ++at) {
      const double gap_s = std::abs(at->first - *time_s);
      if (gap_s > least_s) continue;
      least_s = gap_s;
      file = &at->second;
    }
  }
  if (file == nullptr) return {};
  try {
    return read(*file, size_px);
  } catch (const Error&) {  // one of many: its loops have the scale no_depth
    return {};
  }
}

cv::Mat1f DepthFolder::read(const fs::path& file, cv::Size size_px) const {
  const cv::Mat image = images::read_image_file(file, kMaxMegapixels);
  if (std::int64_t{image.cols} * size_px.height != std::int64_t{image.rows} * size_px.width) {
    throw Error(
        ErrorKind::input,
        fmt::format("The depth image '{}' has {} x {} px, but the images have {} x {}; give "
                    "depth that is registered to the images.",
                    file.string(), image.cols, image.rows, size_px.width, size_px.height));
  }
  try {
    return depth_in_metres(image, units_per_m_);
  } catch (const Error& error) {
    throw Error(ErrorKind::input, fmt::format("'{}': {}", file.string(), error.what()));
  }
}

}  // namespace loopbit
