// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "column_tracer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopbit::town {
namespace {

constexpr double kNear_m = 0.2;
constexpr double kHorizon_m = 1e5;

struct RayInterval {
  double begin = -std::numeric_limits<double>::infinity();
  double end = std::numeric_limits<double>::infinity();
};

/// Depths at which origin + direction * depth lies within low..high.
RayInterval between(double origin, double direction, double low, double high) {
  if (direction == 0) return origin >= low && origin <= high ? RayInterval{} : RayInterval{1, 0};
  const double a = (low - origin) / direction;
  const double b = (high - origin) / direction;
  return {std::min(a, b), std::max(a, b)};
}

double height_at(const Prism& prism, double v) {
  for (int i = 1; i < prism.outline_size; ++i) {
    const OutlinePoint& a = prism.outline[static_cast<std::size_t>(i - 1)];
    const OutlinePoint& b = prism.outline[static_cast<std::size_t>(i)];
    if (v > b.v && i + 1 < prism.outline_size) continue;
    const double share = std::clamp((v - a.v) / (b.v - a.v), 0.0, 1.0);
    return a.z + (b.z - a.z) * share;
  }
  return prism.outline[0].z;
}

}  // namespace

struct ColumnTracer::Hit {
  int index = 0;
  double begin_m = 0.0;
  double end_m = 0.0;
  Face face = Face::v_low;

  // Ties go by index, so that the order never depends on the sort.
  bool operator<(const Hit& other) const {
    return begin_m != other.begin_m ? begin_m < other.begin_m : index < other.index;
  }
};

ColumnTracer::ColumnTracer(const Camera& camera, const Scene& scene)
    : camera_(camera), scene_(scene), in_column_(static_cast<std::size_t>(camera.width_px)) {
  int index = 0;
  const auto enter = [&](Span span) {
    for (int c = span.first; c < span.end; ++c) {
      in_column_[static_cast<std::size_t>(c)].push_back(index);
    }
    ++index;
  };
  for (const Prism& prism : scene.prisms) enter(columns_of(prism));
  for (const Billboard& board : scene.billboards) enter(columns_of(board));
}

ColumnTracer::Span ColumnTracer::columns_of(const Prism& prism) const {
  const Vec2 right = left_of(camera_.forward) * -1.0;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  int behind = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const double u = (corner & 1) != 0 ? prism.half_length_m : -prism.half_length_m;
    const double v = (corner & 2) != 0 ? prism.v_max() : prism.v_min();
    const Vec2 at = prism.centre + prism.axis * u + left_of(prism.axis) * v - camera_.eye;
    const double depth = dot(at, camera_.forward);
    if (depth < kNear_m) {
      ++behind;
      continue;
    }
    const double x = camera_.width_px / 2.0 + camera_.focal_px * dot(at, right) / depth;
    low = std::min(low, x);
    high = std::max(high, x);
  }
  if (behind == 4) return {};
  if (behind > 0) return {0, camera_.width_px};
  const double width = camera_.width_px;
  return {static_cast<int>(std::clamp(low - 1.0, 0.0, width)),
          static_cast<int>(std::clamp(high + 1.0, 0.0, width))};
}

ColumnTracer::Span ColumnTracer::columns_of(const Billboard& board) const {
  const Vec2 at = board.at - camera_.eye;
  const double depth = dot(at, camera_.forward);
  if (depth < kNear_m) return {};
  const double right = -dot(at, left_of(camera_.forward));
  const double width = camera_.width_px;
  const auto column = [&](double side_m) {
    const double x = width / 2 + camera_.focal_px * side_m / depth;
    return static_cast<int>(std::clamp(x, 0.0, width));
  };
  return {column(right - board.half_width_m), column(right + board.half_width_m)};
}

bool ColumnTracer::hit_prism(int index, Vec2 ray, Hit& hit) const {
  const Prism& prism = scene_.prisms[static_cast<std::size_t>(index)];
  const Vec2 from = camera_.eye - prism.centre;
  const Vec2 v_axis = left_of(prism.axis);
  const double u_step = dot(ray, prism.axis);
  const double v_step = dot(ray, v_axis);
  const RayInterval u =
      between(dot(from, prism.axis), u_step, -prism.half_length_m, prism.half_length_m);
  const RayInterval v = between(dot(from, v_axis), v_step, prism.v_min(), prism.v_max());
  hit.index = index;
  hit.begin_m = std::max(u.begin, v.begin);
  hit.end_m = std::min(u.end, v.end);
  if (hit.begin_m >= hit.end_m || hit.begin_m < kNear_m) return false;
  const bool through_u = u.begin > v.begin;
  hit.face = through_u ? (u_step > 0 ? Face::u_low : Face::u_high)
                       : (v_step > 0 ? Face::v_low : Face::v_high);
  return true;
}

void ColumnTracer::collect(int column, std::vector<Hit>& hits) const {
  const Vec2 ray = camera_.ray(column);
  const int prisms = static_cast<int>(scene_.prisms.size());
  for (const int index : in_column_[static_cast<std::size_t>(column)]) {
    Hit hit;
    if (index < prisms) {
      if (hit_prism(index, ray, hit)) hits.push_back(hit);
      continue;
    }
    const Billboard& board = scene_.billboards[static_cast<std::size_t>(index - prisms)];
    hit.index = index;
    hit.begin_m = dot(board.at - camera_.eye, camera_.forward);
    hits.push_back(hit);
  }
  std::sort(hits.begin(), hits.end());
}

void ColumnTracer::add_surface(Piece piece, double top_px, float& skyline_px,
                               std::vector<Piece>& pieces) {
  const auto top = static_cast<float>(top_px);
  if (top >= skyline_px) return;
  piece.top_px = top;
  piece.bottom_px = skyline_px;
  skyline_px = top;
  pieces.push_back(piece);
}

void ColumnTracer::add_ground(double from_m, double to_m, float& skyline_px,
                              std::vector<Piece>& pieces) const {
  if (to_m <= from_m) return;
  Piece piece;
  piece.depth_m = from_m;
  piece.end_m = to_m;
  add_surface(piece, camera_.row_of(0.0, to_m), skyline_px, pieces);
}

void ColumnTracer::add_prism(const Hit& hit, Vec2 ray, float& skyline_px,
                             std::vector<Piece>& pieces) const {
  const Prism& prism = scene_.prisms[static_cast<std::size_t>(hit.index)];
  const double v_from = dot(camera_.eye - prism.centre, left_of(prism.axis));
  const double v_step = dot(ray, left_of(prism.axis));
  Piece piece;
  piece.kind = Piece::Kind::wall;
  piece.index = hit.index;
  piece.face = hit.face;
  piece.depth_m = hit.begin_m;
  piece.height_m = height_at(prism, v_from + v_step * hit.begin_m);
  add_surface(piece, camera_.row_of(piece.height_m, hit.begin_m), skyline_px, pieces);

  // The outline's points in the order in which the ray passes under them, and the far side last.
  piece.kind = Piece::Kind::slope;
  for (int step = 0; step <= prism.outline_size; ++step) {
    const int point = v_step > 0 ? step : prism.outline_size - 1 - step;
    double depth = hit.end_m;
    if (step < prism.outline_size && v_step != 0) {
      depth = (prism.outline[static_cast<std::size_t>(point)].v - v_from) / v_step;
    }
    depth = std::min(depth, hit.end_m);
    if (depth <= piece.depth_m) continue;
    const double height = height_at(prism, v_from + v_step * depth);
    piece.end_m = depth;
    piece.climb = (height - piece.height_m) / (depth - piece.depth_m);
    add_surface(piece, camera_.row_of(height, depth), skyline_px, pieces);
    piece.depth_m = depth;
    piece.height_m = height;
  }
}

void ColumnTracer::add_board(const Hit& hit, float skyline_px, std::vector<Piece>& pieces) const {
  Piece piece;
  piece.kind = Piece::Kind::board;
  piece.index = hit.index - static_cast<int>(scene_.prisms.size());
  const Billboard& board = scene_.billboards[static_cast<std::size_t>(piece.index)];
  piece.depth_m = hit.begin_m;
  piece.top_px = static_cast<float>(camera_.row_of(board.height_m, hit.begin_m));
  piece.bottom_px = std::min(skyline_px, static_cast<float>(camera_.row_of(0.0, hit.begin_m)));
  if (piece.top_px < piece.bottom_px) pieces.push_back(piece);
}

double ColumnTracer::depth_at(const Piece& piece, int row) const {
  const double rise = (camera_.horizon_px - (row + 0.5)) / camera_.focal_px;
  switch (piece.kind) {
    case Piece::Kind::board:
      return 0;
    case Piece::Kind::wall:
      return piece.depth_m;
    case Piece::Kind::ground:
      return std::clamp(-camera_.eye_m / std::min(rise, -1e-9), piece.depth_m, piece.end_m);
    case Piece::Kind::slope:
      break;
  }
  const double base = piece.height_m - piece.climb * piece.depth_m - camera_.eye_m;
  const double relative = rise - piece.climb;
  return std::clamp(std::abs(relative) > 1e-9 ? base / relative : piece.end_m, piece.depth_m,
                    piece.end_m);
}

float ColumnTracer::trace(int column, std::vector<Piece>& pieces) const {
  std::vector<Hit> hits;
  collect(column, hits);
  pieces.clear();
  const Vec2 ray = camera_.ray(column);
  auto skyline_px = static_cast<float>(camera_.height_px);
  double ground_from = kNear_m;
  for (const Hit& hit : hits) {
    if (hit.index >= static_cast<int>(scene_.prisms.size())) {
      add_board(hit, skyline_px, pieces);
      continue;
    }
    add_ground(ground_from, hit.begin_m, skyline_px, pieces);
    add_prism(hit, ray, skyline_px, pieces);
    ground_from = std::max(ground_from, hit.end_m);
  }
  add_ground(ground_from, kHorizon_m, skyline_px, pieces);
  return skyline_px;
}

}  // namespace loopbit::town
