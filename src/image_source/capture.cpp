// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "capture.hpp"

#include <array>
#include <cstdint>
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

class CaptureSource final : public ImageSource {
 public:
  struct Facts {
    std::string description;
    bool has_times = false;
    std::optional<std::size_t> size;
    std::string early_end = {};  ///< as ImageSource::early_end() at the end
  };

  /// Shares `capture`, which is a handle.
  CaptureSource(const cv::VideoCapture& capture, Facts facts)
      : capture_(capture), facts_(std::move(facts)) {}

  bool next(Frame& frame) override {
    if (!skip()) return false;
    frame = Frame{fmt::format("frame {}", grabbed_ - 1), timestamp_s(), {}, {}};
    try {
      frame.image = retrieve(frame.name);
    } catch (const Error& e) {
      frame.error = e.what();
    }
    return true;
  }

  bool skip() override {
    if (ended_ || !capture_.grab()) {
      ended_ = true;
      return false;
    }
    if (grabbed_ == 0) first_ms_ = position_ms(capture_);
    ++grabbed_;
    return true;
  }

  [[nodiscard]] std::optional<std::size_t> size() const override { return facts_.size; }

  [[nodiscard]] std::string description() const override { return facts_.description; }

  [[nodiscard]] std::string early_end() const override { return ended_ ? facts_.early_end : ""; }

 private:
  [[nodiscard]] std::optional<double> timestamp_s() const {
    if (!facts_.has_times) return std::nullopt;
    return (position_ms(capture_) - first_ms_) / 1000.0;
  }

  cv::Mat retrieve(const std::string& name) {
    const std::string thing = fmt::format("{}, {},", facts_.description, name);
    cv::Mat image;
    if (!capture_.retrieve(image) || image.empty()) {
      throw Error(ErrorKind::input,
                  thing + " cannot be decoded: convert the video or leave it out.");
    }
    check_pixel_format(image, thing);
    return image;
  }

  cv::VideoCapture capture_;
  Facts facts_;
  std::size_t grabbed_ = 0;
  bool ended_ = false;
  double first_ms_ = 0.0;
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
  if (!capture.grab()) {
    throw Error(ErrorKind::input,
                fmt::format("Video '{}' has no readable frame: copy it again or convert it.",
                            file.string()));
  }
  const double first_ms = position_ms(capture);
  return capture.grab() && position_ms(capture) > first_ms;
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
                             has_times(probe, file), frame_count(probe), early_end(file)};
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
