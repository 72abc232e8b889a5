// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

namespace loopbit {

/// One image of a sequence, or the reason why it is missing.
struct Frame {
  std::string name;                   ///< name in its folder or list, or its position
  std::optional<double> timestamp_s;  ///< seconds, if the data set has times; see open_source
  cv::Mat image;                      ///< 8- or 16-bit, grey, BGR or BGRA; empty if unreadable
  std::string error;  ///< empty, or a sentence that says why the image is unreadable
  /// x_odometry = T_odometry_camera x_camera, in metres, by the odometry of a recording.
  std::optional<cv::Matx44d> T_odometry_camera = std::nullopt;
  /// Of the motion since the frame before, see OdometryPose.
  std::optional<cv::Matx66d> odometry_covariance = std::nullopt;
};

/// A sequence of images, read in order. Not thread-safe; one reader at a time.
class ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// Reads the next frame. False at the end. A damaged image is a frame with `error` set, not an
  /// exception and not the end. A camera ends when it is unplugged. frame.image shares no memory
  /// with frames read before.
  virtual bool next(Frame& frame) = 0;

  /// Skips the next frame without decoding it. False at the end.
  virtual bool skip() = 0;

  /// The total number of frames, if it is known before reading them. Exact for images; an estimate
  /// from the header for a video, so read until next() returns false.
  [[nodiscard]] virtual std::optional<std::size_t> size() const = 0;

  /// One line that describes the source, such as "KITTI odometry sequence, image_0".
  [[nodiscard]] virtual std::string description() const = 0;

  /// After the end: one sentence if the input is known to end too early, such as a video that is
  /// cut off. Otherwise, and before the end, empty.
  [[nodiscard]] virtual std::string early_end() const { return {}; }
};

/// Larger images are not read, unless the caller allows it. Decoding takes up to 8 bytes per pixel.
inline constexpr int kMaxMegapixels = 100;

/// Opens a sequence. Its kind is detected:
///  - `camera:N`: a camera attached to this machine (N from 0 to 99), no times;
///  - a folder with `image_0` or `image_2`: a KITTI odometry sequence (times.txt if present);
///  - a folder with `images` and `times.txt` (seconds, one per image), as `loopbit demo` writes it;
///  - a folder with `mav0/cam0/data.csv`, or that `mav0` or `cam0` itself: EuRoC;
///  - a folder with `rgb.txt`: TUM RGB-D;
///  - any other folder: its images in natural order (2.png before 10.png), told by extension;
///    hidden files and sub-folders are passed over;
///  - a .txt or .csv file: a list, one image per line, relative to the file or to a folder `images`
///    beside it, `#` for comments; or names that NUL bytes end, as `find -print0` writes them;
///  - an image file: that one image;
///  - any other file: a video, its times counted from its first frame.
/// Throws Error (kind input) if nothing is there, no image is found or a list is malformed, and
/// Error (kind option) if N is no camera number. Listed images are not looked at before next(). An
/// image of more than `max_megapixels` (at least 1) is not decoded, but unreadable, and a video of
/// them is refused. Formats: PNG, JPEG, BMP, PBM, PGM, PPM, TIFF and WebP; videos as OpenCV reads.
std::unique_ptr<ImageSource> open_source(const std::string& input,
                                         int max_megapixels = kMaxMegapixels);

/// Which frames of an input are read.
struct Sampling {
  int every = 1;  ///< only every N-th
  int limit = 0;  ///< at most this many; 0 = all
};

/// The frames of `source` that `sampling` keeps. Others are skipped, not decoded. Throws Error
/// (kind option) if `every` is less than 1 or `limit` less than 0.
std::unique_ptr<ImageSource> subsample(std::unique_ptr<ImageSource> source,
                                       const Sampling& sampling);

/// The total number of frames of `source`, opened from `input`, if it is exact, as for a folder.
/// None for a video, which has only an estimate.
std::optional<std::size_t> exact_size(const ImageSource& source, const std::string& input);

/// From the first frame asked for, reads ahead in a thread, at most `depth` frames (at least 1).
/// The frames and their order are the same; decoding overlaps with processing. Throws Error (kind
/// option) if `depth` is 0.
std::unique_ptr<ImageSource> prefetch(std::unique_ptr<ImageSource> source, std::size_t depth);

}  // namespace loopbit
