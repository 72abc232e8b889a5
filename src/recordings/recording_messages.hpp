// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "loopbit/recordings.hpp"

#include "recording_file.hpp"

namespace loopbit::recordings {

/// A recording whose topics are known.
struct Recording {
  std::string input;
  std::vector<std::filesystem::path> files;
  RecordingInfo info;
};

/// Calls `read` for the messages of `topic`, unpacked, until it returns false. `thing` names the
/// message in a sentence. Throws Error (kind input) if a message cannot be unpacked.
using ReadMessage =
    std::function<bool(const Message& message, Bytes data, const std::string& thing)>;
void for_each_message(const Recording& recording, const std::string& topic,
                      const ReadMessage& read);

/// "/a (type, N messages), /b (...)", the first of those that `is_listed`; "none" without any.
std::string list(const std::vector<Topic>& topics,
                 const std::function<bool(const Topic&)>& is_listed);

}  // namespace loopbit::recordings
