// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "capture.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <opencv2/videoio.hpp>

#include "loopbit/error.hpp"
#include "loopbit/image_file.hpp"

#include "encoded_video.hpp"

namespace loopbit::images {
namespace {

/// Where the frame grabbed last begins, up to a constant that depends on the backend. Before a
/// grab, FFMPEG tells the time of the frame before, and 0 for each of the first two.
double position_ms(const cv::VideoCapture& capture) { return capture.get(cv::CAP_PROP_POS_MSEC); }

/// After so many frames in a row that cannot be read, a video has ended.
constexpr std::size_t kMostDamaged = 100;
/// The number of frames that a container tells is sometimes an estimate: if fewer than this share
/// of them can be read, some are missing.
constexpr double kMinReadable = 0.9;

/// Grabs the next frame that can be read, at most `most` frames further on. Returns how many cannot
/// be read before it; none at the end.
std::optional<std::size_t> grab_readable(cv::VideoCapture& capture, std::size_t most) {
  for (std::size_t damaged = 0; damaged <= most; ++damaged) {
    if (capture.grab()) return damaged;
  }
  return std::nullopt;
}

class CaptureSource final : public ImageSource {
 public:
  struct Facts {
    std::string description;
    bool has_times = false;
    std::optional<std::size_t> size;
    std::string early_end = {};  ///< as ImageSource::early_end() at the end
    std::string file = {};       ///< of a video
  };

  /// Shares `capture`, which is a handle.
  CaptureSource(const cv::VideoCapture& capture, Facts facts)
      : capture_(capture), facts_(std::move(facts)) {}

  bool next(Frame& frame) override {
    if (!skip()) return false;
    frame = Frame{fmt::format("frame {}", passed_ - 1), {}, {}, {}};
    try {
      if (damaged_before_ > 0) fail(frame.name);
      frame.timestamp_s = timestamp_s();
      frame.image = retrieve(frame.name);
    } catch (const Error& e) {
      frame.error = e.what();
    }
    return true;
  }

  bool skip() override {
    if (damaged_before_ > 0) {
      --damaged_before_;
    } else if (!grab()) {
      return false;
    }
    ++passed_;
    return true;
  }

  [[nodiscard]] std::optional<std::size_t> size() const override { return facts_.size; }

  [[nodiscard]] std::string description() const override { return facts_.description; }

  [[nodiscard]] std::string early_end() const override {
    if (!ended_) return {};
    if (!facts_.early_end.empty()) return facts_.early_end;
    const std::size_t expected = facts_.size.value_or(0);
    if (static_cast<double>(passed_) >= kMinReadable * static_cast<double>(expected)) return {};
    return fmt::format("Video '{}' ends after {} of about {} frames: copy it again or convert it.",
                       facts_.file, passed_, expected);
  }

 private:
  /// Grabs a frame, and finds how many before it are damaged. Of a camera, none are.
  bool grab() {
    const std::size_t expected = facts_.size.value_or(0);
    const std::size_t left = expected > passed_ ? expected - passed_ - 1 : 0;
    const auto damaged =
        ended_ ? std::nullopt : grab_readable(capture_, std::min(left, kMostDamaged));
    ended_ = !damaged;
    if (ended_) return false;
    damaged_before_ = *damaged;
    if (!first_ms_) first_ms_ = position_ms(capture_);
    return true;
  }

  [[nodiscard]] std::optional<double> timestamp_s() const {
    if (!facts_.has_times) return std::nullopt;
    return (position_ms(capture_) - *first_ms_) / 1000.0;
  }

  [[nodiscard]] std::string thing(const std::string& name) const {
    return fmt::format("{}, {},", facts_.description, name);
  }

  [[noreturn]] void fail(const std::string& name) const {
    throw Error(ErrorKind::input,
                thing(name) + " cannot be decoded: convert the video or leave it out.");
  }

  cv::Mat retrieve(const std::string& name) {
    cv::Mat image;
    if (!capture_.retrieve(image) || image.empty()) fail(name);
    check_pixel_format(image, thing(name));
    return image;
  }

  cv::VideoCapture capture_;
  Facts facts_;
  std::size_t passed_ = 0;          ///< frames, the present one included
  std::size_t damaged_before_ = 0;  ///< frames from the present one to the one grabbed
  bool ended_ = false;
  std::optional<double> first_ms_;  ///< position of the first frame grabbed
};

/// The backends that read files. cv::CAP_ANY would also ask the drivers of attached cameras, and
/// take an image for the first of a numbered series.
constexpr std::array kFileBackends = {cv::CAP_FFMPEG, cv::CAP_GSTREAMER, cv::CAP_MSMF,
                                      cv::CAP_AVFOUNDATION, cv::CAP_OPENCV_MJPEG};

cv::VideoCapture open_file(const std::filesystem::path& file) {
  // An absolute path, lest FFMPEG take a name such as "concat:x" for one of its protocols.
  const std::string name = std::filesystem::absolute(file).string();
  for (const int backend : kFileBackends) {
    cv::VideoCapture capture(name, backend);
    if (capture.isOpened()) return capture;
  }
  throw Error(ErrorKind::input,
              fmt::format("'{}' is not a video OpenCV can read here: convert it, or give a folder "
                          "of images, a .txt or .csv image list, or camera:N.",
                          file.string()));
}

/// Some backends report 0 for every frame. Looks at the first two frames, which are then gone.
bool has_times(cv::VideoCapture& capture, const std::filesystem::path& file) {
  if (!grab_readable(capture, kMostDamaged)) {
    throw Error(ErrorKind::input,
                fmt::format("Video '{}' has no readable frame: copy it again or convert it.",
                            file.string()));
  }
  const double first_ms = position_ms(capture);
  return grab_readable(capture, kMostDamaged) && position_ms(capture) > first_ms;
}

std::optional<std::size_t> frame_count(const cv::VideoCapture& capture) {
  constexpr double kMaxBelieved = 1e12;
  const double count = capture.get(cv::CAP_PROP_FRAME_COUNT);
  if (!(count >= 1.0 && count <= kMaxBelieved)) return std::nullopt;
  return static_cast<std::size_t>(count);
}

/// Why the video ends before its time; empty if it does not, as far as its container tells.
std::string early_end(const std::filesystem::path& file) {
  std::error_code error;
  const std::uint64_t bytes = std::filesystem::file_size(file, error);
  const auto declared = declared_bytes(file);
  if (error || !declared || *declared <= bytes) return {};
  return fmt::format(
      "Video '{}' is cut off after {} of at least {} bytes, and its last frames are "
      "missing: copy it again.",
      file.string(), bytes, *declared);
}

}  // namespace

std::unique_ptr<ImageSource> open_video(const std::filesystem::path& file, int max_megapixels) {
  cv::VideoCapture probe = open_file(file);
  check_pixel_count(static_cast<std::int64_t>(probe.get(cv::CAP_PROP_FRAME_WIDTH)),
                    static_cast<std::int64_t>(probe.get(cv::CAP_PROP_FRAME_HEIGHT)), max_megapixels,
                    fmt::format("Video '{}'", file.string()));
  CaptureSource::Facts facts{fmt::format("video {}", file.filename().string()),
                             has_times(probe, file), frame_count(probe), early_end(file),
                             file.string()};
  return std::make_unique<CaptureSource>(open_file(file), std::move(facts));
}

std::unique_ptr<ImageSource> open_camera(int number) {
  cv::VideoCapture capture(number);
  if (!capture.isOpened()) {
    throw Error(ErrorKind::input,
                fmt::format("camera:{} cannot be opened: check that it is attached, not in use and "
                            "that you may read it.",
                            number));
  }
  return std::make_unique<CaptureSource>(
      std::move(capture), CaptureSource::Facts{fmt::format("camera {}", number), false, {}});
}

}  // namespace loopbit::images
