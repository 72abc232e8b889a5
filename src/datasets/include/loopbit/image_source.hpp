// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

namespace loopbit {

/// One image of a sequence, or the reason why there is none.
struct Frame {
  std::string name;                   ///< name in its folder or list, or position, for messages
  std::optional<double> timestamp_s;  ///< seconds, where the data set has times; see open_source
  cv::Mat image;                      ///< 8- or 16-bit, grey, BGR or BGRA; empty if unreadable
  std::string error;                  ///< empty, or one sentence on why the image is unreadable
};

/// A sequence of images, read in order. Not thread-safe; one reader at a time.
class ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// Reads the next frame. False at the end. A damaged image is a frame with `error` set, not an
  /// exception and not the end. A video that is cut off ends early, and a camera ends when it is
  /// unplugged: no backend tells these from the end. frame.image shares no memory with frames
  /// read before.
  virtual bool next(Frame& frame) = 0;

  /// Passes over the next frame without decoding it. False at the end.
  virtual bool skip() = 0;

  /// How many frames there are in all, where that is known before reading them. Exact for images;
  /// for a video an estimate from its header, so read until next() says false.
  [[nodiscard]] virtual std::optional<std::size_t> size() const = 0;

  /// One line for people and for run.json, such as "KITTI odometry sequence, image_0".
  [[nodiscard]] virtual std::string description() const = 0;
};

/// Opens a sequence, told by what is there:
///  - `camera:N`: a camera attached to this machine (N from 0 to 99), no times;
///  - a folder with `image_0` or `image_2`: a KITTI odometry sequence (times.txt where present);
///  - a folder with `mav0/cam0/data.csv`, or that `mav0` or `cam0` itself: EuRoC;
///  - a folder with `rgb.txt`: TUM RGB-D;
///  - any other folder: its images in natural order (2.png before 10.png), told by extension;
///    hidden files and sub-folders are passed over;
///  - a .txt or .csv file: a list, one image a line, relative to the file or to a folder `images`
///    beside it, `#` for comments; or names that NUL bytes end, as `find -print0` writes them;
///  - an image file: that one image;
///  - any other file: a video, its times counted from its first frame.
/// Throws Error (kind input) if nothing is there, no image is found or a list is malformed, and
/// Error (kind option) if N is no camera number. Listed images are not looked at before next().
std::unique_ptr<ImageSource> open_source(const std::string& input);

/// Every `every`-th frame of `source` (1 = all), and no more than `limit` frames (0 = no limit).
/// Frames left out are skipped, not decoded. Throws Error (kind option) if `every` is 0.
std::unique_ptr<ImageSource> subsample(std::unique_ptr<ImageSource> source, std::size_t every,
                                       std::size_t limit);

/// How many frames `source`, opened from `input`, has in all, where that is sure: of images. A
/// video says about how many.
std::optional<std::size_t> exact_size(const ImageSource& source, const std::string& input);

/// `source`, read ahead by a thread of its own, at most `depth` frames (at least 1). Frames and
/// their order are the same; decoding overlaps with what is done with them. Throws Error (kind
/// option) if `depth` is 0.
std::unique_ptr<ImageSource> prefetch(std::unique_ptr<ImageSource> source, std::size_t depth);

}  // namespace loopbit
