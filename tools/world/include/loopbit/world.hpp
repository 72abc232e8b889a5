// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>

#include "loopbit/camera.hpp"
#include "loopbit/ground_truth.hpp"
#include "loopbit/image_source.hpp"
#include "loopbit/odometry.hpp"
#include "loopbit/options.hpp"

namespace loopbit {

/// The built-in world: a camera drives through a town on one closed circuit. The length of the
/// circuit follows from frames, spacing_m, laps and floors: a ring around one block, or many
/// kilometres through the town. It never crosses itself. With floors, the drive goes on in a second
/// town that stands on the first one and looks the same, and so on. The last 30 m on each floor are
/// a ramp between plain walls, which the camera sees only then.
struct WorldOptions {
  int frames = 400;
  int seed = 1;
  int width_px = 640;
  int height_px = 480;
  double fisheye_deg = 0.0;
  double laps = 2.25;
  int floors = 1;
  double spacing_m = 0.9;
  double lateral_offset_m = 1.0;
  double light_change = 0.6;
  double night = 0.0;
  double season = 0.0;
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
        Field{"seed", &W::seed, 0, 2'147'483'647, "Random seed of the town"},
        Field{"width_px", &W::width_px, 64, 4096,
              "Width of a frame, px; the field of view is 80 degrees"},
        Field{"height_px", &W::height_px, 48, 4096, "Height of a frame, px"},
        Field{"fisheye_deg", &W::fisheye_deg, 0.0, 170.0,
              "Degrees that an equidistant lens sees across the width; beyond 80 degrees from its "
              "axis the image is black (0 = no such lens)"},
        Field{"laps", &W::laps, 1.0, 1000.0, "Number of laps, on each floor"},
        Field{
            "floors", &W::floors, 1, 100,
            "Storeys of 3 m with the same streets and houses; a walled ramp leads from each to the "
            "next"},
        Field{"spacing_m", &W::spacing_m, 0.02, 20.0,
              "Distance driven between two frames (0.1 s), m"},
        Field{"lateral_offset_m", &W::lateral_offset_m, 0.0, 3.0,
              "Offset of the later laps to the left of the first one, m"},
        Field{"light_change", &W::light_change, 0.0, 1.0,
              "Change of sun, sky and colours from lap to lap (0 = none)"},
        Field{
            "night", &W::night, 0.0, 1.0,
            "Darkness from the second lap on: no sun, lamps, lit windows, noise, grey (0 = none)"},
        Field{
            "season", &W::season, 0.0, 1.0,
            "Change of season from the second lap on: bare trees, snow, painted houses (0 = none)"},
        Field{"moving_objects", &W::moving_objects, 0.0, 1.0,
              "Amount of traffic; every lap has other cars and people (0 = none)"},
        Field{"look_alike", &W::look_alike, 0.0, 1.0,
              "Share of houses that are copies of a few types"},
        Field{"blank_stretch", &W::blank_stretch, 0.0, 0.8,
              "Share of the circuit that runs between plain concrete walls"},
        Field{"noise", &W::noise, 0.0, 50.0, "Sensor noise, standard deviation in grey levels"},
        switch_field("reverse_second_lap", &W::reverse_second_lap,
                     "Drive the second lap in the opposite direction"),
        switch_field("opposite_counts", &W::opposite_counts,
                     "Truth: a place seen in the opposite direction counts as the same place"),
        Field{"same_place_m", &W::same_place_m, 0.1, 20.0,
              "Truth: largest distance of the same place, m"},
        Field{"near_place_m", &W::near_place_m, 0.1, 60.0,
              "Truth: largest distance at which a match is not false, m"},
    };
  }
};

/// Position and heading of the camera: x east, y north, z up from its height on the lowest floor,
/// heading from east to north in (-pi, pi].
struct LevelPose {
  double x_m = 0.0;
  double y_m = 0.0;
  double z_m = 0.0;
  double heading_rad = 0.0;
};

/// A town, a drive through it, and its exact ground truth. Everything is computed from hashes of
/// positions: the same options give the same bytes on every machine, any frame can be rendered at
/// any time, and only the plan of the circuit is stored. Immutable after construction, so all
/// members may be called from any number of threads.
class World {
 public:
  /// Throws Error (kind option) if an option is out of range, or if the drive is too short for its
  /// laps. A circuit has at least 106 m.
  explicit World(const WorldOptions& options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  [[nodiscard]] const WorldOptions& options() const noexcept;
  [[nodiscard]] double circuit_m() const noexcept;

  /// The lap of `frame`, from 0. In all members, 0 <= frame < options().frames.
  [[nodiscard]] int lap(int frame) const;
  [[nodiscard]] LevelPose pose(int frame) const;
  [[nodiscard]] static double time_s(int frame);

  /// Whether `frame` lies between plain walls, as on ramps.
  [[nodiscard]] bool blank(int frame) const;

  /// The camera of `frame`. It is level, and its nods shift the principal point.
  [[nodiscard]] CameraModel camera(int frame) const;
  /// From the frame of the camera to the world: x east, y down, z north, the ground of the
  /// lowest floor at y = 0.
  [[nodiscard]] cv::Matx44d T_world_camera(int frame) const;

  /// The camera image: BGR, 8 bits per channel. About 25 ms on one core for 640 x 480, and
  /// 100 ms with a fisheye lens. `right_m`:
  /// as a second camera sees it, that far to the right of the first.
  [[nodiscard]] cv::Mat render(int frame, double right_m = 0) const;

  /// The depth along the camera's axis for each pixel, m. 0 in the sky and where something flat, a
  /// tree or a person, stands before it, and everywhere with a fisheye lens.
  [[nodiscard]] cv::Mat1f depth_m(int frame) const;

  /// All pairs of frames that show the same place: camera centres at most same_place_m apart,
  /// headings at most 30 degrees apart (or 30 degrees from opposite, if opposite_counts), on the
  /// same floor, and at least 50 m driven in between, so that the view just passed is not a
  /// revisit. Frames on ramps have none. Sorted by query, then first; the runs of a query neither
  /// touch nor overlap. The time is linear in the frames for a given number of laps; the same holds
  /// for near_place().
  [[nodiscard]] std::vector<PlaceRun> same_place() const;

  /// All pairs of frames whose match is not wrong: as same_place(), but at most near_place_m and 60
  /// degrees apart, and on ramps, too, if their heights differ by at most 1 m. Contains
  /// same_place().
  [[nodiscard]] std::vector<PlaceRun> near_place() const;

  /// Heap memory in bytes. It grows with the circuit, not with the frames.
  [[nodiscard]] std::size_t storage_bytes() const noexcept;

 private:
  struct Plan;
  std::unique_ptr<const Plan> plan_;
};

/// The drive as a sequence of images, 10 frames per second. `odometry`: of all frames, or of none.
std::unique_ptr<ImageSource> make_world_source(std::shared_ptr<const World> world,
                                               std::vector<OdometryPose> odometry = {});

/// The camera of the whole drive, without the nods of single frames.
CameraModel mean_camera(const World& world);

/// The drive by odometry, one pose per frame, from that of the first: per metre driven, the
/// position drifts by 1 % and the heading by 0.1 degrees (standard deviations of errors that stay
/// the same for 10 m). Roll, pitch and the height of the camera's horizon do not drift, as with an
/// inertial sensor; the covariances say so. The same world has the same odometry.
std::vector<OdometryPose> drifting_odometry(const World& world);

/// Writes the whole drive as a data set: images/000000.png ..., times.txt (seconds), poses.txt
/// (KITTI: camera to world, 3 x 4 numbers per row, x right, y down, z forward), odometry.txt (of
/// drifting_odometry(), TUM with covariances), camera.yaml (see read_cameras(); without the nods of
/// single frames), truth.csv and not_false.csv. Calls
/// `on_frame(n)` after each image. Throws Error (kind output) if `folder` already contains images
/// or cannot be written.
void write_dataset(
    const World& world, const std::string& folder,
    const std::function<void(int)>& on_frame = [](int) {});

}  // namespace loopbit
