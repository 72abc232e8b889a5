// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/ground_truth.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/options.hpp"

namespace loopbit {

/// The built-in world: a town whose streets a camera is driven through, on one closed circuit.
/// The circuit is as long as frames, spacing_m and laps ask for: a ring around one block, or many
/// kilometres that wind through the town. It never crosses itself.
struct WorldOptions {
  int frames = 400;
  int seed = 1;
  int width_px = 640;
  int height_px = 480;
  double laps = 2.25;
  double spacing_m = 0.9;
  double lateral_offset_m = 1.0;
  double light_change = 0.6;
  double moving_objects = 0.5;
  double look_alike = 0.3;
  double blank_stretch = 0.12;
  double noise = 2.0;
  bool reverse_second_lap = false;
  bool opposite_counts = false;
  double same_place_m = 4.0;
  double near_place_m = 25.0;

  static constexpr auto fields() {
    using W = WorldOptions;
    return std::tuple{
        Field{"frames", &W::frames, 1, 10'000'000, "Frames in the whole drive"},
        Field{"seed", &W::seed, 0, 2'147'483'647, "Another seed is another town"},
        Field{"width_px", &W::width_px, 64, 4096, "Width of a frame, px; 80 degrees of view"},
        Field{"height_px", &W::height_px, 48, 4096, "Height of a frame, px"},
        Field{"laps", &W::laps, 1.0, 1000.0, "How often the circuit is driven"},
        Field{"spacing_m", &W::spacing_m, 0.02, 20.0, "Driven between two frames (0.1 s), m"},
        Field{"lateral_offset_m", &W::lateral_offset_m, 0.0, 3.0,
              "How far left of the first lap the later laps are driven, m"},
        Field{"light_change", &W::light_change, 0.0, 1.0,
              "How much sun, sky and colours change from lap to lap (0 = not at all)"},
        Field{"moving_objects", &W::moving_objects, 0.0, 1.0,
              "How busy the streets are; every lap has other cars and people (0 = nobody)"},
        Field{"look_alike", &W::look_alike, 0.0, 1.0,
              "Share of houses that are copies of a few types"},
        Field{"blank_stretch", &W::blank_stretch, 0.0, 0.8,
              "Share of the circuit between plain concrete walls"},
        Field{"noise", &W::noise, 0.0, 50.0, "Sensor noise, standard deviation in grey levels"},
        switch_field("reverse_second_lap", &W::reverse_second_lap,
                     "Drive the second lap in the opposite direction"),
        switch_field("opposite_counts", &W::opposite_counts,
                     "Truth: a place seen in the opposite direction is the same place"),
        Field{"same_place_m", &W::same_place_m, 0.1, 20.0,
              "Truth: largest distance of the same place, m"},
        Field{"near_place_m", &W::near_place_m, 0.1, 60.0,
              "Truth: largest distance at which a match is not false, m"},
    };
  }
};

/// Where the camera is and where it looks: x east, y north, heading from east to north in (-pi,
/// pi].
struct Pose {
  double x_m = 0.0;
  double y_m = 0.0;
  double heading_rad = 0.0;
};

/// A town, a drive through it, and what is exactly true about that drive. Everything is made from
/// hashes of positions: the same options give the same bytes on every machine, any frame can be
/// drawn at any time, and only the plan of the circuit is stored.
/// Immutable after construction, so all members may be called from any number of threads.
class World {
 public:
  /// Throws Error (kind option) if an option is out of range, or if the drive is too short for its
  /// laps: a circuit has at least 106 m.
  explicit World(const WorldOptions& options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  [[nodiscard]] const WorldOptions& options() const noexcept;
  [[nodiscard]] double circuit_m() const noexcept;

  /// The lap in which `frame` is driven, from 0. As in all members, 0 <= frame < options().frames.
  [[nodiscard]] int lap(int frame) const;
  [[nodiscard]] Pose pose(int frame) const;
  [[nodiscard]] static double time_s(int frame);

  /// Whether `frame` is driven between the plain walls.
  [[nodiscard]] bool blank(int frame) const;

  /// What the camera sees: BGR, 8 bits a channel. About 25 ms on one core for 640 x 480.
  [[nodiscard]] cv::Mat render(int frame) const;

  /// Every pair of frames that show the same place: camera centres no more than same_place_m apart,
  /// headings no more than 30 degrees apart (or from opposite, if opposite_counts), and at least
  /// 50 m driven between them, so that the view just behind is no revisit. Sorted by query, then
  /// first; the runs of a query neither touch nor overlap. Time is linear in frames for a given
  /// number of laps; near_place() likewise.
  [[nodiscard]] std::vector<PlaceRun> same_place() const;

  /// Every pair of frames that a detector may match without being wrong: as same_place(), but no
  /// more than near_place_m and 60 degrees apart. Contains same_place().
  [[nodiscard]] std::vector<PlaceRun> near_place() const;

  /// Bytes this world holds on the heap: they grow with the circuit, not with the frames.
  [[nodiscard]] std::size_t storage_bytes() const noexcept;

 private:
  struct Plan;
  std::unique_ptr<const Plan> plan_;
};

/// The drive as a sequence of images, 10 frames a second.
std::unique_ptr<ImageSource> make_world_source(std::shared_ptr<const World> world);

}  // namespace loopbit
