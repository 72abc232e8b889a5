// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/world.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "loopbit/error.hpp"

#include "chance.hpp"
#include "circuit.hpp"
#include "column_tracer.hpp"
#include "drive.hpp"
#include "fisheye.hpp"
#include "light.hpp"
#include "shader.hpp"
#include "town.hpp"
#include "traffic.hpp"
#include "truth.hpp"

namespace loopbit {
namespace {

using namespace town;  // NOLINT(google-build-using-namespace): the private parts of this one

constexpr double kFocal = 0.595876796;  // of a width: 80 degrees across
constexpr double kHorizon = 0.55;       // of the height, from the top
constexpr double kEye_m = 1.6;
constexpr double kNod_px = 3.0;     // of the horizon, from end to end, at a width of 640
constexpr double kNodFrames = 3.0;  // between two nods
constexpr double kDrivenBetween_m = 50.0;
constexpr double kCosSame = 0.8660254037844386;  // 30 degrees
constexpr double kCosNear = 0.5;                 // 60 degrees
constexpr double kFramesPerSecond = 10.0;
constexpr double kRadPerDeg = std::numbers::pi / 180;

constexpr float kNightNoise = 8.0F;  // standard deviation in grey levels
constexpr float kNightGrey = 0.9F;   // share of the colour that is lost

constexpr std::uint32_t kNodSalt = 0x40dU;
constexpr std::uint32_t kNoiseSalt = 0x4015eU;
constexpr std::uint32_t kRampSalt = 0x4a3bU;

double largest_spacing_m() {
  double largest = 0;
  for_each_field<WorldOptions>([&](const auto& field) {
    if (field.name == std::string_view("spacing_m")) largest = static_cast<double>(field.max);
  });
  return largest;
}

WorldOptions checked(const WorldOptions& options) {
  validate(options, "world");
  if (options.near_place_m < options.same_place_m) {
    throw Error(ErrorKind::option,
                fmt::format("world.near_place_m is {}, but must be at least world.same_place_m, "
                            "which is {}.",
                            options.near_place_m, options.same_place_m));
  }
  if (options.floors > 1 && options.reverse_second_lap) {
    throw Error(ErrorKind::option,
                fmt::format("world.floors is {}, but must be 1 with world.reverse_second_lap.",
                            options.floors));
  }
  const double laps = options.laps * options.floors;
  const double circuit_m = options.frames * options.spacing_m / laps;
  if (circuit_m >= Circuit::kShortestCircuit_m) return options;
  const double drive_m = Circuit::kShortestCircuit_m * laps;
  const double least_spacing_m = std::ceil(drive_m / options.frames * 100) / 100;
  const bool may_be_set = least_spacing_m <= largest_spacing_m();
  throw Error(
      ErrorKind::option,
      fmt::format(
          "world: {} frames {} m apart in {} laps make a circuit of {:.0f} m, but "
          "the shortest has {} m: take {:.0f} frames or more{}.",
          options.frames, options.spacing_m, laps, circuit_m, Circuit::kShortestCircuit_m,
          std::ceil(drive_m / options.spacing_m),
          may_be_set ? fmt::format(", or set spacing_m to {:.2f} or more", least_spacing_m) : ""));
}

double wrap_angle(double angle) {
  constexpr double kTurn = 2 * std::numbers::pi;
  const double wrapped = angle - kTurn * std::ceil(angle / kTurn - 0.5);
  return std::clamp(wrapped, -std::numbers::pi, std::numbers::pi);
}

/// About normal, of mean 0 and standard deviation 1: the sum of the four bytes of a hash.
float bell(std::uint32_t hash) {
  constexpr float kMean = 510.0F;
  constexpr float kSigma = 147.80392F;
  const std::uint32_t sum =
      (hash & 255U) + ((hash >> 8) & 255U) + ((hash >> 16) & 255U) + (hash >> 24);
  return (static_cast<float>(sum) - kMean) / kSigma;
}

float luminance(Color color) { return 0.114F * color.b + 0.587F * color.g + 0.299F * color.r; }

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
}

}  // namespace

struct World::Plan {
  explicit Plan(const WorldOptions& wanted)
      : options(checked(wanted)),
        seed(scramble(static_cast<std::uint32_t>(options.seed))),
        circuit(seed, options.frames * options.spacing_m / (options.laps * options.floors),
                options.blank_stretch),
        drive(options, circuit),
        town(seed, circuit, options.look_alike),
        traffic(seed, circuit, drive, options.moving_objects) {
    if (options.floors > 1) ramp_circuit.emplace(seed, circuit.length_m(), 1.0);
  }
  Plan(const Plan&) = delete;
  Plan& operator=(const Plan&) = delete;
  Plan(Plan&&) = delete;
  Plan& operator=(Plan&&) = delete;
  ~Plan() = default;

  [[nodiscard]] Camera camera(int frame) const;
  /// What is around the camera: the town, or plain walls on a ramp, other ones on each.
  [[nodiscard]] Town town_of(int frame) const;
  [[nodiscard]] Scene scene(int frame, Vec2 eye) const;
  [[nodiscard]] float from_second_lap(int frame, double factor) const {
    return drive.lap(frame) > 0 ? static_cast<float>(factor) : 0.0F;
  }
  [[nodiscard]] std::vector<View> views() const;
  [[nodiscard]] PlaceRule rule(double distance_m, double cos_turn, bool ramps) const;
  /// Of each column, its rows from the top.
  using TakeColumn = std::function<void(int column, const std::vector<Color>& rows)>;
  void draw(int frame, const Camera& camera, const TakeColumn& take) const;
  void store(int frame, int column, const std::vector<Color>& rows, cv::Mat& image) const;

  WorldOptions options;
  std::uint32_t seed;
  Circuit circuit;
  std::optional<Circuit> ramp_circuit;  // with floors
  Drive drive;
  Town town;
  Traffic traffic;
};

Camera World::Plan::camera(int frame) const {
  const StreetPoint at = drive.camera(frame);
  const auto [sin, cos] = sin_cos(at.heading_rad);
  Camera camera;
  camera.eye = at.at;
  camera.forward = {cos, sin};
  camera.eye_m = kEye_m;
  camera.width_px = options.width_px;
  camera.height_px = options.height_px;
  camera.focal_px = kFocal * options.width_px;
  const double nod = smooth_noise(seed ^ kNodSalt, frame / kNodFrames) - 0.5;
  camera.horizon_px = kHorizon * options.height_px + nod * kNod_px * options.width_px / 640.0;
  return camera;
}

Town World::Plan::town_of(int frame) const {
  if (!drive.on_ramp(frame)) return town;
  return {hash_of(seed ^ kRampSalt, drive.floor(frame)), *ramp_circuit, options.look_alike};
}

Scene World::Plan::scene(int frame, Vec2 eye) const {
  Scene scene;
  town_of(frame).add_surroundings(eye, scene);
  if (!drive.on_ramp(frame)) traffic.add_to(frame, scene);
  const float season = from_second_lap(frame, options.season);
  if (season > 0) change_season(scene, season);
  return scene;
}

std::vector<View> World::Plan::views() const {
  std::vector<View> views;
  views.reserve(static_cast<std::size_t>(options.frames));
  for (int frame = 0; frame < options.frames; ++frame) {
    const Camera at = camera(frame);
    views.push_back({at.eye, at.forward, drive.height_m(frame), drive.on_ramp(frame)});
  }
  return views;
}

PlaceRule World::Plan::rule(double distance_m, double cos_turn, bool ramps) const {
  return {distance_m, cos_turn, options.opposite_counts,
          static_cast<int>(std::ceil(kDrivenBetween_m / options.spacing_m)), ramps};
}

/// What a pinhole camera at a place of `frame` sees, column by column.
void World::Plan::draw(int frame, const Camera& camera, const TakeColumn& take) const {
  const Town around_town = town_of(frame);
  const Scene around = scene(frame, camera.eye);
  const Light light = light_of_lap(seed, drive.lap(frame), options.light_change,
                                   from_second_lap(frame, options.night));
  const ColumnTracer tracer(camera, around);
  Shader shader(camera, around, around_town, light, seed);
  std::vector<Piece> pieces;
  std::vector<Color> rows;
  for (int column = 0; column < camera.width_px; ++column) {
    rows.assign(static_cast<std::size_t>(camera.height_px), Color{});
    const float skyline_px = tracer.trace(column, pieces);
    shader.draw(column, pieces, skyline_px, rows);
    take(column, rows);
  }
}

void World::Plan::store(int frame, int column, const std::vector<Color>& rows,
                        cv::Mat& image) const {
  const std::uint32_t noise = hash_of(seed ^ kNoiseSalt, frame, column);
  const float dark = from_second_lap(frame, options.night);
  const auto sigma = static_cast<float>(options.noise) + kNightNoise * dark;
  for (int row = 0; row < image.rows; ++row) {
    Color color = rows[static_cast<std::size_t>(row)];
    if (dark > 0) color = blend(color, gray(luminance(color)), kNightGrey * dark);
    const float grain =
        sigma > 0 ? sigma * bell(scramble(noise + static_cast<std::uint32_t>(row))) : 0.0F;
    image.at<cv::Vec3b>(row, column) = {to_byte(color.b * 255.0F + grain),
                                        to_byte(color.g * 255.0F + grain),
                                        to_byte(color.r * 255.0F + grain)};
  }
}

World::World(const WorldOptions& options) : plan_(std::make_unique<Plan>(options)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const WorldOptions& World::options() const noexcept { return plan_->options; }

double World::circuit_m() const noexcept { return plan_->circuit.length_m(); }

int World::lap(int frame) const {
  assert(frame >= 0 && frame < options().frames);
  return plan_->drive.lap(frame);
}

LevelPose World::pose(int frame) const {
  assert(frame >= 0 && frame < options().frames);
  const StreetPoint at = plan_->drive.camera(frame);
  return {at.at.x, at.at.y, plan_->drive.height_m(frame), wrap_angle(at.heading_rad)};
}

bool World::blank(int frame) const {
  assert(frame >= 0 && frame < options().frames);
  return plan_->drive.blank(frame);
}

CameraModel World::camera(int frame) const {
  assert(frame >= 0 && frame < options().frames);
  const Camera camera = plan_->camera(frame);
  const bool is_fisheye = options().fisheye_deg > 0;
  const double focal_px = is_fisheye
                              ? FisheyeLens(camera, options().fisheye_deg * kRadPerDeg).focal_px()
                              : camera.focal_px;
  // A pixel's middle is half a pixel from its edges, from which the tracer counts.
  return {.lens = is_fisheye ? Lens::equidistant : Lens::pinhole,
          .size_px = {camera.width_px, camera.height_px},
          .fx = focal_px,
          .fy = focal_px,
          .cx = camera.width_px / 2.0 - 0.5,
          .cy = camera.horizon_px - 0.5};
}

cv::Matx44d World::T_world_camera(int frame) const {
  assert(frame >= 0 && frame < options().frames);
  const Camera camera = plan_->camera(frame);
  const Vec2 ahead = camera.forward;
  const Vec2 right = left_of(ahead) * -1.0;
  return {right.x, 0, ahead.x, camera.eye.x, 0, 1, 0, -camera.eye_m - plan_->drive.height_m(frame),
          right.y, 0, ahead.y, camera.eye.y, 0, 0, 0, 1};
}

cv::Mat1f World::depth_m(int frame) const {
  assert(frame >= 0 && frame < options().frames);
  const Camera camera = plan_->camera(frame);
  const Scene scene = plan_->scene(frame, camera.eye);
  const ColumnTracer tracer(camera, scene);
  cv::Mat1f depth_m(camera.height_px, camera.width_px, 0.0F);
  if (options().fisheye_deg > 0) return depth_m;
  std::vector<Piece> pieces;
  for (int column = 0; column < camera.width_px; ++column) {
    tracer.trace(column, pieces);
    std::reverse(pieces.begin(), pieces.end());  // nearer ones last
    for (const Piece& piece : pieces) {
      const int first = std::max(0, static_cast<int>(std::floor(piece.top_px)));
      const int end = std::min(camera.height_px, static_cast<int>(std::ceil(piece.bottom_px)));
      for (int row = first; row < end; ++row) {
        depth_m(row, column) = static_cast<float>(tracer.depth_at(piece, row));
      }
    }
  }
  return depth_m;
}

cv::Mat World::render(int frame, double right_m) const {
  assert(frame >= 0 && frame < options().frames);
  Camera camera = plan_->camera(frame);
  camera.eye = camera.eye + left_of(camera.forward) * -right_m;
  cv::Mat image(camera.height_px, camera.width_px, CV_8UC3);
  const auto store = [&](int column, const std::vector<Color>& rows) {
    plan_->store(frame, column, rows, image);
  };
  if (options().fisheye_deg <= 0) {
    plan_->draw(frame, camera, store);
    return image;
  }
  const FisheyeLens lens(camera, options().fisheye_deg * kRadPerDeg);
  const auto seen = lens.render([&](const Camera& face, FisheyeLens::Image& columns) {
    plan_->draw(frame, face,
                [&](int /*column*/, const std::vector<Color>& rows) { columns.push_back(rows); });
  });
  for (int column = 0; column < camera.width_px; ++column) {
    store(column, seen[static_cast<std::size_t>(column)]);
  }
  return image;
}

double World::time_s(int frame) { return frame / kFramesPerSecond; }

std::vector<PlaceRun> World::same_place() const {
  return find_places(plan_->views(), plan_->rule(options().same_place_m, kCosSame, false));
}

std::vector<PlaceRun> World::near_place() const {
  return find_places(plan_->views(), plan_->rule(options().near_place_m, kCosNear, true));
}

std::size_t World::storage_bytes() const noexcept {
  const auto& ramps = plan_->ramp_circuit;
  return sizeof(Plan) + plan_->circuit.storage_bytes() + (ramps ? ramps->storage_bytes() : 0);
}

}  // namespace loopbit
