// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "hessian_pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace loopbit {
namespace {

/// Rows are sampled at every second pixel in all octaves; the coarser ones keep a part.
constexpr int kRowStep_px = 2;

/// Kernels read and write up to so many samples past the end of a row.
constexpr int kPadding = 16;

int round_up(int value, int unit) { return (value + unit - 1) / unit * unit; }

/// In samples. A little more than half: one axis may push another past it.
constexpr double kMaxOffset = 0.6;

/// The first x >= `x` that is marked, or one >= `end`. Reads up to 7 bytes past the end.
int next_marked(const std::uint8_t* marks, int x, int end) {
  while (x < end) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, marks + x, sizeof eight);
    if (eight != 0) break;
    x += 8;
  }
  while (x < end && marks[x] == 0) ++x;
  return x;
}

}  // namespace

cv::Rect HessianPyramid::valid_samples(int octave, int interval) const {
  const int step = step_px(octave);
  const int reach = (3 * lobe_px(octave, interval) - 1) / 2;
  const cv::Size size = integral_->size_px();
  const int first = round_up(reach, step) / step;
  const int end_x = (size.width - 1 - reach) / step + 1;
  const int end_y = (size.height - 1 - reach) / step + 1;
  if (size.width <= 2 * reach || size.height <= 2 * reach) return {};
  return {first, first, std::max(0, end_x - first), std::max(0, end_y - first)};
}

void HessianPyramid::build(const IntegralImage& integral, const SurfKernels& kernels) {
  integral_ = &integral;
  const cv::Size size = integral.size_px();
  for (int o = 0; o < kOctaves; ++o) {
    const int step = step_px(o);
    Octave& octave = octaves_[static_cast<std::size_t>(o)];
    octave.samples = {(size.width - 1) / step + 1, (size.height - 1) / step + 1};
    const int stride = round_up(octave.samples.width, kPadding) + kPadding;
    for (auto& layer : octave.layers) {
      layer.create(octave.samples.height, stride);
    }
    const int tile = static_cast<int>(kHessianRun) * kRowStep_px / step;
    const int first_new = o == 0 ? 0 : 2;
    for (int i = 0; i < first_new; ++i) take_from_below(o, i);
    for (int begin = 0; begin < octave.samples.width; begin += tile) {
      compute(begin, std::min(tile, octave.samples.width - begin), o, first_new, kernels);
    }
  }
}

void HessianPyramid::compute(int begin, std::ptrdiff_t count, int octave, int first_interval,
                             const SurfKernels& kernels) {
  const std::ptrdiff_t step = step_px(octave);
  const std::ptrdiff_t part = step / kRowStep_px;
  Octave& of = octaves_[static_cast<std::size_t>(octave)];
  const IntegralView integral = integral_->view();
  for (int y = 0; y < of.samples.height; ++y) {
    const std::ptrdiff_t y_px = y * step;
    for (int i = first_interval; i < kIntervals; ++i) {
      const std::ptrdiff_t lobe = lobe_px(octave, i);
      const std::ptrdiff_t reach = (3 * lobe - 1) / 2;
      if (y_px < reach || y_px + reach >= integral_->size_px().height) continue;
      float* out = of.row(i, y) + begin;
      if (part == 1) {
        kernels.hessian_row(integral, y_px, begin, count, lobe, out);
        continue;
      }
      std::array<float, kHessianRun> responses{};
      kernels.hessian_row(integral, y_px, begin * part, (count - 1) * part + 1, lobe,
                          responses.data());
      for (std::ptrdiff_t x = 0; x < count; ++x) {
        out[x] = responses[static_cast<std::size_t>(x * part)];
      }
    }
  }
}

void HessianPyramid::take_from_below(int octave, int interval) {
  const cv::Rect valid = valid_samples(octave, interval);
  const Octave& below = octaves_[static_cast<std::size_t>(octave - 1)];
  Octave& of = octaves_[static_cast<std::size_t>(octave)];
  for (int y = valid.y; y < valid.y + valid.height; ++y) {
    const float* from = below.row(2 * interval + 1, 2 * y);
    float* to = of.row(interval, y);
    for (int x = valid.x; x < valid.x + valid.width; ++x) to[x] = from[std::ptrdiff_t{2} * x];
  }
}

bool HessianPyramid::equals_earlier_neighbour(int octave, int interval, int x, int y) const {
  constexpr int kEarlier = 13;  // of the 26, in order of interval, y, x
  const float here = response(octave, interval, x, y);
  for (int k = 0; k < kEarlier; ++k) {
    const int dx = k % 3 - 1;
    const int dy = k / 3 % 3 - 1;
    if (response(octave, interval + k / 9 - 1, x + dx, y + dy) == here) return true;
  }
  return false;
}

/// Those of a row that is_maximum_ marks and whose 26 neighbours are all valid: the layer above has
/// the widest filter.
void HessianPyramid::append_marked(int octave, int interval, int y,
                                   std::vector<Maximum>& maxima) const {
  const cv::Rect valid = valid_samples(octave, interval + 1);
  const int end = valid.x + valid.width - 1;
  for (int x = next_marked(is_maximum_.data(), valid.x + 1, end); x < end;
       x = next_marked(is_maximum_.data(), x + 1, end)) {
    if (equals_earlier_neighbour(octave, interval, x, y)) continue;
    maxima.push_back({response(octave, interval, x, y), static_cast<std::uint16_t>(x),
                      static_cast<std::uint16_t>(y), static_cast<std::uint8_t>(octave),
                      static_cast<std::uint8_t>(interval)});
  }
}

void HessianPyramid::find_maxima(float min_response, const SurfKernels& kernels,
                                 std::vector<Maximum>& maxima) {
  for (int o = 0; o < kOctaves; ++o) {
    const Octave& octave = octaves_[static_cast<std::size_t>(o)];
    const int stride = octave.layers.front().cols;
    is_maximum_.resize(static_cast<std::size_t>(stride));
    for (int i = 1; i + 1 < kIntervals; ++i) {
      const cv::Rect valid = valid_samples(o, i + 1);
      for (int y = valid.y + 1; y < valid.y + valid.height - 1; ++y) {
        const std::array layers = {octave.row(i - 1, y), octave.row(i, y), octave.row(i + 1, y)};
        kernels.maxima_row(layers.data(), stride, octave.samples.width, min_response,
                           is_maximum_.data());
        append_marked(o, i, y, maxima);
      }
    }
  }
}

std::optional<BlobCenter> HessianPyramid::refined(const Maximum& maximum) const {
  const auto value = [&](int dx, int dy, int di) -> double {
    return response(maximum.octave, maximum.interval + di, maximum.x + dx, maximum.y + dy);
  };
  const double v = value(0, 0, 0);
  const double gx = (value(1, 0, 0) - value(-1, 0, 0)) / 2;
  const double gy = (value(0, 1, 0) - value(0, -1, 0)) / 2;
  const double gs = (value(0, 0, 1) - value(0, 0, -1)) / 2;
  const double xx = value(1, 0, 0) + value(-1, 0, 0) - 2 * v;
  const double yy = value(0, 1, 0) + value(0, -1, 0) - 2 * v;
  const double ss = value(0, 0, 1) + value(0, 0, -1) - 2 * v;
  const double xy = (value(1, 1, 0) + value(-1, -1, 0) - value(-1, 1, 0) - value(1, -1, 0)) / 4;
  const double xs = (value(1, 0, 1) + value(-1, 0, -1) - value(-1, 0, 1) - value(1, 0, -1)) / 4;
  const double ys = (value(0, 1, 1) + value(0, -1, -1) - value(0, -1, 1) - value(0, 1, -1)) / 4;
  // The offset is -inverse(H) g, by cofactors.
  const double c_xx = yy * ss - ys * ys;
  const double c_xy = xs * ys - xy * ss;
  const double c_xs = xy * ys - xs * yy;
  const double determinant = xx * c_xx + xy * c_xy + xs * c_xs;
  if (determinant == 0) return std::nullopt;
  const double c_yy = xx * ss - xs * xs;
  const double c_ys = xy * xs - xx * ys;
  const double c_ss = xx * yy - xy * xy;
  const double dx = -(c_xx * gx + c_xy * gy + c_xs * gs) / determinant;
  const double dy = -(c_xy * gx + c_yy * gy + c_ys * gs) / determinant;
  const double ds = -(c_xs * gx + c_ys * gy + c_ss * gs) / determinant;
  if (!(std::max({std::abs(dx), std::abs(dy), std::abs(ds)}) < kMaxOffset)) return std::nullopt;
  const double step = step_px(maximum.octave);
  const double lobe = step * (maximum.interval + 1 + ds) + 1;
  return BlobCenter{(maximum.x + dx) * step, (maximum.y + dy) * step, lobe / 3 * 1.2};
}

bool HessianPyramid::is_bright(const Maximum& maximum) const {
  const int x = maximum.x * step_px(maximum.octave);
  const int y = maximum.y * step_px(maximum.octave);
  const int lobe = lobe_px(maximum.octave, maximum.interval);
  const int half = (lobe - 1) / 2;
  const int side = (3 * lobe - 1) / 2;
  const IntegralImage& in = *integral_;
  const std::int32_t xx = in.box(x - side, y - lobe + 1, x + side + 1, y + lobe) -
                          3 * in.box(x - half, y - lobe + 1, x + half + 1, y + lobe);
  const std::int32_t yy = in.box(x - lobe + 1, y - side, x + lobe, y + side + 1) -
                          3 * in.box(x - lobe + 1, y - half, x + lobe, y + half + 1);
  return xx + yy < 0;
}

}  // namespace loopbit
