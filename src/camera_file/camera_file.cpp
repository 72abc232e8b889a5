// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/camera_file.hpp"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "loopbit/error.hpp"
#include "loopbit/read_file.hpp"
#include "loopbit/text_rows.hpp"

namespace loopbit {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxCameraFileBytes = std::uintmax_t{1} << 20U;
/// The YAML reader recurses; calibrations need three levels.
constexpr int kMaxNesting = 32;
/// Of a list: a few lines with aliases can stand for millions.
constexpr std::size_t kMaxNumbers = 64;

constexpr const char* kExpected =
    "give a sensor.yaml of EuRoC, a camchain.yaml of Kalibr, a camera_info of ROS, a YAML file of "
    "OpenCV, a calib.txt of KITTI odometry or a 3 x 3 camera matrix";

class CameraFile {
 public:
  explicit CameraFile(const std::string& path) : path_(path) {}

  [[noreturn]] void fail(const std::string& fault) const {
    throw Error(ErrorKind::input, fmt::format("'{}' {}; {}.", path_, fault, kExpected));
  }

  /// All numbers of a list, or of the `data` of a matrix.
  [[nodiscard]] std::vector<double> numbers(const YAML::Node& node, const char* name) const {
    const YAML::Node data = node.IsMap() ? node["data"] : node;
    if (!data || !data.IsSequence()) fail(fmt::format("has no list of numbers in '{}'", name));
    std::vector<double> numbers;
    const auto add = [&](const YAML::Node& cell) {
      if (numbers.size() == kMaxNumbers) fail(fmt::format("has too many numbers in '{}'", name));
      numbers.push_back(number(cell, name));
    };
    for (const YAML::Node& cell : data) {
      if (cell.IsSequence()) {  // a row of a matrix
        for (const YAML::Node& inner : cell) add(inner);
      } else {
        add(cell);
      }
    }
    return numbers;
  }

  [[nodiscard]] double number(const YAML::Node& node, const char* name) const {
    const std::string text = node && node.IsScalar() ? node.Scalar() : "";
    const auto number = parse_number<double>(std::string_view(text).substr(text.starts_with('+')));
    if (!number)
      fail(fmt::format("has '{}' for '{}', where a finite number is needed", text, name));
    return *number;
  }

  /// Sets the intrinsics from a row-major 3 x 3 matrix.
  void set_matrix(const std::vector<double>& k, CameraModel& camera) const {
    if (k.size() != 9) {
      fail(fmt::format("has a camera matrix of {} numbers, where 9 are needed", k.size()));
    }
    camera.fx = k[0];
    camera.fy = k[4];
    camera.cx = k[2];
    camera.cy = k[5];
  }

  /// Sets the distortion; what is beyond kMaxDistortion (thin prisms, tilted sensors) must be 0.
  void set_distortion(const std::vector<double>& numbers, CameraModel& camera) const {
    const std::size_t usable = camera.lens == Lens::equidistant ? 4U : CameraModel::kMaxDistortion;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (i < usable) {
        camera.distortion[i] = numbers[i];
      } else if (numbers[i] != 0) {
        fail(
            fmt::format("has {} distortion coefficients, of which only the first {} may differ "
                        "from 0",
                        numbers.size(), usable));
      }
    }
    const bool has_all =
        camera.lens == Lens::pinhole || (numbers.size() >= 4 && numbers.size() != 6);
    if (!has_all) {
      fail(fmt::format("has {} distortion coefficients, where a lens has 4, 5 or 8",
                       numbers.size()));
    }
  }

  [[nodiscard]] Lens lens_of(std::string_view distortion_model) const {
    if (distortion_model == "none" || distortion_model.empty()) return Lens::pinhole;
    for (const std::string_view name :
         {"radial-tangential", "radtan", "plumb_bob", "rational_polynomial"}) {
      if (distortion_model == name) return Lens::radial_tangential;
    }
    for (const std::string_view name : {"equidistant", "equi", "fisheye", "kannala_brandt"}) {
      if (distortion_model == name) return Lens::equidistant;
    }
    fail(
        fmt::format("has the distortion model '{}', but loopbit knows radial-tangential, "
                    "plumb_bob, rational_polynomial, equidistant and none",
                    distortion_model));
  }

  [[nodiscard]] cv::Matx44d transform(const YAML::Node& node, const char* name) const {
    const auto numbers = this->numbers(node, name);
    if (numbers.size() != 16) {
      fail(fmt::format("has {} numbers in '{}', where 16 are needed", numbers.size(), name));
    }
    return cv::Matx44d(numbers.data());
  }

 private:
  const std::string& path_;
};

std::string text_of(const YAML::Node& node) {
  return node && node.IsScalar() ? node.Scalar() : std::string();
}

/// EuRoC's sensor.yaml, or one camera of Kalibr's camchain.yaml.
CameraModel kalibr_camera(const CameraFile& file, const YAML::Node& node) {
  const std::string model = text_of(node["camera_model"]);
  if (model != "pinhole") {
    file.fail(
        fmt::format("has the camera model '{}', but loopbit knows pinhole alone, with a "
                    "distortion model",
                    model));
  }
  CameraModel camera;
  const auto intrinsics = file.numbers(node["intrinsics"], "intrinsics");
  const auto size = file.numbers(node["resolution"], "resolution");
  if (intrinsics.size() != 4 || size.size() != 2) {
    file.fail("needs 4 intrinsics and a resolution of 2 numbers");
  }
  camera.fx = intrinsics[0];
  camera.fy = intrinsics[1];
  camera.cx = intrinsics[2];
  camera.cy = intrinsics[3];
  camera.size_px = cv::Size2d(size[0], size[1]);
  camera.lens = file.lens_of(text_of(node["distortion_model"]));
  for (const char* name : {"distortion_coeffs", "distortion_coefficients"}) {
    if (node[name]) file.set_distortion(file.numbers(node[name], name), camera);
  }
  if (node["T_BS"]) camera.T_body_camera = file.transform(node["T_BS"], "T_BS");
  if (node["T_cam_imu"]) {
    camera.T_body_camera = file.transform(node["T_cam_imu"], "T_cam_imu").inv();
  }
  return camera;
}

/// Each camera says where it is from the one before. Without an IMU the first is the body.
std::vector<CameraModel> kalibr_chain(const CameraFile& file, const YAML::Node& root) {
  std::vector<CameraModel> cameras;
  for (int number = 0; root[fmt::format("cam{}", number)]; ++number) {
    const YAML::Node node = root[fmt::format("cam{}", number)];
    CameraModel camera = kalibr_camera(file, node);
    if (!camera.T_body_camera && number == 0) camera.T_body_camera = cv::Matx44d::eye();
    const YAML::Node step = node["T_cn_cnm1"];
    if (step && !camera.T_body_camera && cameras.back().T_body_camera) {
      camera.T_body_camera =
          *cameras.back().T_body_camera * file.transform(step, "T_cn_cnm1").inv();
    }
    cameras.push_back(camera);
  }
  return cameras;
}

YAML::Node first_of(const YAML::Node& root, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (root[name]) return root[name];
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

/// A camera_info of ROS, or what OpenCV's FileStorage writes.
CameraModel matrix_camera(const CameraFile& file, const YAML::Node& root) {
  CameraModel camera;
  const YAML::Node matrix = first_of(root, {"camera_matrix", "K", "k"});
  if (!matrix) file.fail("has no camera");
  file.set_matrix(file.numbers(matrix, "camera_matrix"), camera);
  const YAML::Node width = first_of(root, {"image_width", "width"});
  const YAML::Node height = first_of(root, {"image_height", "height"});
  if (width && height) {
    camera.size_px =
        cv::Size2d(file.number(width, "image_width"), file.number(height, "image_height"));
  }
  const YAML::Node distortion =
      first_of(root, {"distortion_coefficients", "distortion_coeffs", "D", "d"});
  if (!distortion) return camera;
  const auto numbers = file.numbers(distortion, "distortion_coefficients");
  if (numbers.empty()) return camera;
  const std::string model = text_of(root["distortion_model"]);
  camera.lens = model.empty() ? Lens::radial_tangential : file.lens_of(model);
  if (root["fisheye_model"] && file.number(root["fisheye_model"], "fisheye_model") != 0) {
    camera.lens = Lens::equidistant;
  }
  file.set_distortion(numbers, camera);
  const bool is_undistorted =
      std::ranges::all_of(numbers, [](double coefficient) { return coefficient == 0; });
  if (camera.lens == Lens::radial_tangential && is_undistorted) camera.lens = Lens::pinhole;
  return camera;
}

/// "P0: " and twelve numbers a row, of rectified cameras: K [1 | -K^-1 t].
std::optional<CameraModel> kitti_camera(const TextRow& row) {
  std::vector<std::string_view> cells;
  split_cells(row.text, cells);
  if (cells.size() != 13 || cells[0].size() != 3 || cells[0][0] != 'P') return std::nullopt;
  std::array<double, 12> p{};
  for (std::size_t i = 0; i < p.size(); ++i) {
    const auto number = parse_number<double>(cells[i + 1]);
    if (!number) return std::nullopt;
    p[i] = *number;
  }
  CameraModel camera{.fx = p[0], .fy = p[5], .cx = p[2], .cy = p[6]};
  if (!(camera.fx > 0 && camera.fy > 0)) return std::nullopt;
  const double z = p[11];
  camera.T_body_camera = cv::Matx44d(1, 0, 0, -(p[3] - camera.cx * z) / camera.fx,  //
                                     0, 1, 0, -(p[7] - camera.cy * z) / camera.fy,  //
                                     0, 0, 1, -z, 0, 0, 0, 1);
  return camera;
}

std::vector<CameraModel> kitti_cameras(const std::vector<TextRow>& rows) {
  std::vector<CameraModel> cameras;
  for (const TextRow& row : rows) {
    if (const auto camera = kitti_camera(row)) cameras.push_back(*camera);
  }
  return cameras;
}

/// Nine numbers in three rows.
std::optional<CameraModel> matrix_file_camera(const CameraFile& file,
                                              const std::vector<TextRow>& rows) {
  std::vector<double> matrix;
  std::vector<std::string_view> cells;
  for (const TextRow& row : rows) {
    split_cells(row.text, cells);
    for (const std::string_view cell : cells) {
      const auto number = parse_number<double>(cell);
      if (!number) return std::nullopt;
      matrix.push_back(*number);
    }
  }
  if (rows.size() != 3 || matrix.size() != 9) return std::nullopt;
  CameraModel camera;
  file.set_matrix(matrix, camera);
  return camera;
}

int nesting_of(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  for (const char letter : text) {
    if (letter == '[' || letter == '{') deepest = std::max(deepest, ++depth);
    if (letter == ']' || letter == '}') --depth;
  }
  return deepest;
}

YAML::Node parse_yaml(const CameraFile& file, std::string text) {
  if (text.starts_with("%YAML:")) text.erase(0, text.find('\n'));  // OpenCV's own, which is no YAML
  if (nesting_of(text) > kMaxNesting) file.fail("has too many brackets");
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    file.fail(fmt::format("is not valid YAML (line {}: {})", error.mark.line + 1, error.msg));
  }
}

std::vector<CameraModel> yaml_cameras(const CameraFile& file, const std::string& text) {
  const YAML::Node root = parse_yaml(file, text);
  if (!root.IsMap()) file.fail("has no camera");
  try {
    if (root["cam0"]) return kalibr_chain(file, root);
    if (root["intrinsics"]) return {kalibr_camera(file, root)};
    return {matrix_camera(file, root)};
  } catch (const YAML::Exception& error) {
    file.fail(fmt::format("is not understood (line {}: {})", error.mark.line + 1, error.msg));
  }
}

}  // namespace

std::vector<CameraModel> read_cameras(const std::string& path) {
  const CameraFile file(path);
  const std::string text = read_file(path, kMaxCameraFileBytes);
  const auto rows = read_rows(path);
  std::vector<CameraModel> cameras = kitti_cameras(rows);
  if (cameras.empty()) {
    if (const auto camera = matrix_file_camera(file, rows)) cameras.push_back(*camera);
  }
  if (cameras.empty()) cameras = yaml_cameras(file, text);
  for (const CameraModel& camera : cameras) validate(camera, fmt::format("'{}'", path));
  return cameras;
}

CameraModel parse_camera_info(const std::string& yaml, const std::string& name) {
  const CameraFile file(name);
  CameraModel camera = yaml_cameras(file, yaml).front();
  validate(camera, fmt::format("'{}'", name));
  return camera;
}

CameraModel read_camera(const std::string& path, int index) {
  const auto cameras = read_cameras(path);
  if (index >= 0 && index < static_cast<int>(cameras.size())) {
    return cameras[static_cast<std::size_t>(index)];
  }
  throw Error(ErrorKind::input, fmt::format("'{}' has {} cameras, but number {} (from 0) is asked "
                                            "for; give another file or number.",
                                            path, cameras.size(), index));
}

std::optional<FoundCamera> find_camera(const std::string& input) {
  const fs::path folder = input;
  const auto is_file = [](const fs::path& path) {
    std::error_code error;
    return fs::is_regular_file(path, error);
  };
  if (is_file(folder / "calib.txt")) {
    std::error_code error;
    const bool is_gray = fs::is_directory(folder / "image_0", error);
    return FoundCamera{(folder / "calib.txt").string(), is_gray ? 0 : 2};
  }
  for (const char* name :
       {"mav0/cam0/sensor.yaml", "cam0/sensor.yaml", "sensor.yaml", "camera.yaml"}) {
    if (is_file(folder / name)) return FoundCamera{(folder / name).string(), 0};
  }
  // The folder of one camera in a data set.
  const fs::path within = folder.has_filename() ? folder : folder.parent_path();
  const std::string name = within.filename().string();
  const fs::path around = within.parent_path();
  constexpr std::string_view kKitti = "image_";
  const bool is_kitti = name.size() == kKitti.size() + 1 && name.starts_with(kKitti) &&
                        name.back() >= '0' && name.back() <= '3';
  if (is_kitti && is_file(around / "calib.txt")) {
    return FoundCamera{(around / "calib.txt").string(), name.back() - '0'};
  }
  if (name == "data" && is_file(around / "sensor.yaml")) {
    return FoundCamera{(around / "sensor.yaml").string(), 0};
  }
  return std::nullopt;
}

std::string to_camera_info(const CameraModel& camera) {
  const bool is_fisheye = camera.lens == Lens::equidistant;
  const auto& d = camera.distortion;
  const bool is_rational = d[5] != 0 || d[6] != 0 || d[7] != 0;
  const std::size_t used = is_fisheye ? 4 : is_rational ? 8 : 5;
  const char* model = is_fisheye    ? "equidistant"
                      : is_rational ? "rational_polynomial"
                                    : "plumb_bob";
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: camera\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]\n"
      "distortion_model: {}\n"
      "distortion_coefficients:\n  rows: 1\n  cols: {}\n  data: [{}]\n",
      camera.size_px.width, camera.size_px.height, camera.fx, camera.cx, camera.fy, camera.cy,
      model, used, fmt::join(d.begin(), d.begin() + used, ", "));
}

}  // namespace loopbit
