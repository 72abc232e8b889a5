// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "loopbit/binary_content.hpp"
#include "loopbit/camera.hpp"
#include "loopbit/detection.hpp"
#include "loopbit/loop_detector_options.hpp"
#include "loopbit/surf.hpp"

#include "evenness.hpp"
#include "places.hpp"
#include "recent_view.hpp"
#include "workspace.hpp"

namespace loopbit {

/// The places of this session that are too recent to be candidates: those still in view, or a fixed
/// number of frames or seconds. docs/method.md, section 2, has the rules.
class ExclusionWindow {
 public:
  /// `options` and `places` must outlive this.
  ExclusionWindow(const LoopDetectorOptions& options, const Places& places)
      : options_(options), places_(places) {}

  /// Throws Error (kind input) if the window is one of seconds and a frame's time is not known, or
  /// earlier than the one before.
  void check_time(std::optional<double> timestamp_s) const;

  /// A new frame beside those before it.
  struct View {
    RecentView::Look look;
    PlaceId begin = 0;  ///< where the window begins and the candidates end
    SharedView shared;  ///< with the change of view before
  };

  /// What is seen of the new frame.
  struct Image {
    BinaryContent& content;
    Features& features;
  };

  /// Leaves a companion out of `image`. `camera`: null = not known.
  [[nodiscard]] View view(Image image, std::optional<double> timestamp_s, const CameraModel* camera,
                          Workspace& work) const;

  /// Takes the memory that the next add() needs, so that it does not throw.
  void reserve_next();

  /// Adds a frame. `view`: none = it shows nothing.
  void add(const Detection& frame, const std::optional<View>& view) noexcept;

 private:
  /// A new frame compared with recent places.
  class Comparison;

  [[nodiscard]] bool is_fixed() const {
    return options_.exclusion.frames > 0 || options_.exclusion.seconds > 0;
  }
  [[nodiscard]] bool is_in_view(const std::vector<Keypoint>& shared) const;
  [[nodiscard]] RecentView::Look look(Comparison& comparison) const;
  bool leave_out_companion(Comparison& comparison, PlaceId place) const;
  [[nodiscard]] PlaceId begin(const RecentView::Look& look,
                              std::optional<double> timestamp_s) const;
  [[nodiscard]] SharedView shared_view(Comparison& comparison, bool is_step) const;

  const LoopDetectorOptions& options_;
  const Places& places_;
  std::vector<double> times_s_;  ///< of each frame of this session, or of the readable one before
  SharedView latest_shared_;     ///< of the last View
};

}  // namespace loopbit
