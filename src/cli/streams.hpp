// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace loopbit::cli {

/// Lets no file that is opened later take the place of a closed stdin, stdout or stderr.
void keep_closed_streams_closed();

/// Writes `text`, printable(), to stderr. Where that fails there is nobody to tell, and nothing
/// else is lost.
void tell(const std::string& text);

/// Throws Error (kind output) if something that was printed did not reach stdout.
void flush_stdout();

}  // namespace loopbit::cli
