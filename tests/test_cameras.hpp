// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include "loopbit/camera.hpp"

namespace loopbit::test {

/// A camera without distortion.
inline CameraModel pinhole() {
  return {.size_px = {640, 480}, .fx = 500, .fy = 510, .cx = 315, .cy = 242};
}

/// EuRoC's left camera.
inline CameraModel euroc() {
  return {.lens = Lens::radial_tangential,
          .size_px = {752, 480},
          .fx = 458.654,
          .fy = 457.296,
          .cx = 367.215,
          .cy = 248.375,
          .distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}};
}

/// 150 degrees across.
inline CameraModel fisheye() {
  return {.lens = Lens::equidistant,
          .size_px = {640, 480},
          .fx = 240,
          .fy = 241,
          .cx = 322,
          .cy = 238,
          .distortion = {-0.012, 0.004, -0.0021, 0.0003}};
}

}  // namespace loopbit::test
