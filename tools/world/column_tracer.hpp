// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "scene.hpp"

namespace loopbit::town {

/// A pinhole camera that is level: columns of the image are vertical in the world. Depth is
/// measured along `forward`.
struct Camera {
  Vec2 eye;
  Vec2 forward{1.0, 0.0};
  double eye_m = 1.6;  // above the ground
  double focal_px = 380.0;
  double horizon_px = 240.0;
  int width_px = 640;
  int height_px = 480;

  [[nodiscard]] double side_of(int column) const {
    return (column + 0.5 - width_px / 2.0) / focal_px;
  }
  /// A step of one metre of depth along the ray of a column.
  [[nodiscard]] Vec2 ray(int column) const { return forward + left_of(forward) * -side_of(column); }
  [[nodiscard]] double row_of(double z_m, double depth_m) const {
    return horizon_px - focal_px * (z_m - eye_m) / depth_m;
  }
};

enum class Face { v_low, v_high, u_low, u_high };

/// The part of one surface that one image column sees, between two rows.
struct Piece {
  enum class Kind { ground, wall, slope, board };

  Kind kind = Kind::ground;
  Face face = Face::v_low;  // walls
  int index = 0;            // of the prism or billboard in the scene
  float top_px = 0.0F;
  float bottom_px = 0.0F;
  double depth_m = 0.0;   // where it begins
  double end_m = 0.0;     // where it ends: ground and slopes
  double height_m = 0.0;  // slopes: where it begins
  double climb = 0.0;     // slopes: metres up for each metre of depth
};

/// Finds the surfaces that each image column sees.
class ColumnTracer {
 public:
  /// `scene` must outlive the tracer.
  ColumnTracer(const Camera& camera, const Scene& scene);

  /// The pieces that `column` sees, from near to far, without the parts that nearer ones hide.
  /// Returns the row above which the column sees the sky. Overwrites `pieces`.
  float trace(int column, std::vector<Piece>& pieces) const;

  /// The depth at which the middle of `row` sees `piece`. 0 for billboards, which have holes.
  [[nodiscard]] double depth_at(const Piece& piece, int row) const;

 private:
  struct Hit;
  struct Span {
    int first = 0;
    int end = 0;
  };
  [[nodiscard]] Span columns_of(const Prism& prism) const;
  [[nodiscard]] Span columns_of(const Billboard& board) const;
  [[nodiscard]] bool hit_prism(int index, Vec2 ray, Hit& hit) const;
  void collect(int column, std::vector<Hit>& hits) const;
  static void add_surface(Piece piece, double top_px, float& skyline_px,
                          std::vector<Piece>& pieces);
  void add_ground(double from_m, double to_m, float& skyline_px, std::vector<Piece>& pieces) const;
  void add_prism(const Hit& hit, Vec2 ray, float& skyline_px, std::vector<Piece>& pieces) const;
  void add_board(const Hit& hit, float skyline_px, std::vector<Piece>& pieces) const;

  Camera camera_;
  const Scene& scene_;
  std::vector<std::vector<int>> in_column_;  // prisms, then billboards from prisms.size() on
};

}  // namespace loopbit::town
