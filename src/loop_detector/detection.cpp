// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/detection.hpp"

namespace loopbit {

std::string_view to_string(Status status) {
  switch (status) {
    case Status::loop:
      return "loop";
    case Status::no_earlier_place:
      return "no_earlier_place";
    case Status::no_similar_place:
      return "no_similar_place";
    case Status::few_matches:
      return "few_matches";
    case Status::no_geometry:
      return "no_geometry";
    case Status::low_score:
      return "low_score";
    case Status::ambiguous:
      return "ambiguous";
    case Status::unreachable:
      return "unreachable";
    case Status::unreadable:
      return "unreadable";
  }
  return "";
}

}  // namespace loopbit
