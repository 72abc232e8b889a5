// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "loopbit/runner.hpp"

namespace loopbit {

inline constexpr int kLivePort = 8484;

/// Serves the report page of a run while the run goes on, to several viewers. The run never waits
/// for them: a viewer that is slow gets its frames later, or reconnects and goes on where it was.
/// Cost for the run: it copies each Detection, and the evidence of the latest frames, some 10
/// microseconds per frame; threads of its own do the rest, as far as viewers ask for it.
class LivePage {
 public:
  struct Options {
    /// A numeric address or a name of this machine. Others than loopback addresses are open to the
    /// network; then the URL has a secret token, without which nothing is served.
    std::string address = "127.0.0.1";
    int port = kLivePort;  ///< 0 = any that is free
  };

  /// Serves from now on. Throws Error (kind option) if it cannot have the address and port.
  explicit LivePage(const Options& options);
  /// Tells viewers that the run has ended, unless finish() did.
  ~LivePage();
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;
  LivePage(LivePage&&) = delete;
  LivePage& operator=(LivePage&&) = delete;

  /// What to open in a browser; until finish().
  [[nodiscard]] const std::string& url() const;

  /// `listener`, and this page beside it. The page must outlive the result.
  [[nodiscard]] RunListener beside(const RunListener& listener);

  /// Gives every viewer the finished page, `report`, in place of the growing one. Returns when they
  /// have it, after some seconds at most; nothing is served any more. Throws Error (kind input) if
  /// there is no such file.
  void finish(const std::string& report);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loopbit
