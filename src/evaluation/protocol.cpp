// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/protocol.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "loopbit/error.hpp"

namespace loopbit {

std::span<const Protocol> protocols() {
  static const std::array kProtocols{
      Protocol{"kitti",
               "poses: right within 6 m and more than 150 frames apart",
               TruthKind::poses,
               {.poses = {.radius_m = 6.0, .min_gap_frames = 150}, .variable = "", .views = 1},
               0},
      Protocol{"ibow-lcd",
               "loop matrix: right within 40 frames of a listed place (Garcia-Fidalgo and Ortiz "
               "2018)",
               TruthKind::matrix,
               {},
               40},
      Protocol{"tsintotas",
               "loop matrix: right only on a listed cell (Tsintotas, Bampis, Gasteratos 2019)",
               TruthKind::matrix,
               {},
               0},
      Protocol{"fab-map",
               "loop mask with alternating left and right images: a frame is a pair of images; "
               "--every 2 reads the left ones (Cummins and Newman 2008)",
               TruthKind::matrix,
               {.poses = {}, .variable = "", .views = 2},
               0},
  };
  return kProtocols;
}

const Protocol& find_protocol(const std::string& name) {
  const auto all = protocols();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& p) { return p.name == name; });
  if (found != all.end()) return *found;
  std::vector<std::string_view> names;
  for (const Protocol& protocol : all) names.push_back(protocol.name);
  throw Error(ErrorKind::option, fmt::format("There is no protocol '{}'; the protocols are {}.",
                                             name, fmt::join(names, ", ")));
}

}  // namespace loopbit
