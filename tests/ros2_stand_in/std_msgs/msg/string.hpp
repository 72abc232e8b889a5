// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace std_msgs::msg {

struct String {
  std::string data;
};

}  // namespace std_msgs::msg
