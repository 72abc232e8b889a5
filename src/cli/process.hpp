// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace loopbit::cli {

/// Lets no file that is opened later take the place of a closed stdin, stdout or stderr.
void keep_closed_streams_closed();

/// What libraries print to stderr about damaged images and videos is hidden from now on. If the
/// process aborts, the last of it is shown. loopbit reports damage in its own words, by tell().
void keep_libraries_quiet();

/// Writes one line, printable(), to stderr; it ends where `text` ends with a line feed. Errors of
/// stderr itself are ignored.
void tell(const std::string& text);

/// Width of the terminal that `stream` is; 80 if it is none.
std::size_t terminal_columns(int stream);

/// Erases the current line of a terminal that is stderr.
void clear_terminal_line();

/// Throws Error (kind output) if something that was printed did not reach stdout.
void flush_stdout();

/// Prints `json`, with `indent` spaces per level; -1 = on one line. Bytes that are not UTF-8, as a
/// path may have, are replaced.
void print_document(const nlohmann::ordered_json& json, int indent = 2);

/// Writes `text` to `file`, or to stdout if that is empty. Throws Error (kind output).
void print_or_write(const std::string& text, const std::string& file);

/// From now on, a first SIGINT, SIGTERM or SIGHUP turns the result true; a second one ends the
/// process. SIGHUP stays ignored if it was.
const std::atomic<bool>& stop_on_signal();

/// Opens a file with xdg-open, or else in the program that $BROWSER names. Throws Error (kind
/// output) if neither works.
void open_page(const std::string& path);

}  // namespace loopbit::cli
