// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "process.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <mutex>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/printable.hpp"
#include "loopbit/write_file.hpp"

namespace loopbit::cli {
namespace {

std::FILE* const kOwnStderr = stderr;

#ifdef __GLIBC__  // where stderr is a variable and may be set

/// What libraries printed last.
struct Heard {
  std::mutex mutex;
  std::array<char, 4096> text{};
  std::size_t size = 0;
};
Heard heard;

ssize_t hear(void* /*cookie*/, const char* text, std::size_t size) {
  const std::lock_guard lock(heard.mutex);
  if (heard.size + size > heard.text.size()) heard.size = 0;
  const std::size_t kept = std::min(size, heard.text.size() - heard.size);
  std::copy_n(text, kept, heard.text.begin() + static_cast<std::ptrdiff_t>(heard.size));
  heard.size += kept;
  return static_cast<ssize_t>(size);
}

extern "C" void tell_heard(int signal) {
  [[maybe_unused]] const auto written = write(STDERR_FILENO, heard.text.data(), heard.size);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

#endif

/// Whether the program, which is searched in PATH, ends well with this argument.
bool starts(std::string program, std::string argument) {
  std::array<char*, 3> arguments{program.data(), argument.data(), nullptr};
  pid_t process = 0;
  int status = 0;
  return posix_spawnp(&process, program.c_str(), nullptr, nullptr, arguments.data(), environ) ==
             0 &&
         waitpid(process, &status, 0) == process && status == 0;
}

std::atomic<bool> signal_arrived{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

extern "C" void request_stop(int signal) {
  signal_arrived = true;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void keep_libraries_quiet() {
  std::cerr.rdbuf(nullptr);  // where OpenCV prints what its decoders throw
#ifdef __GLIBC__
  std::FILE* const quiet = fopencookie(
      nullptr, "w", {.read = nullptr, .write = hear, .seek = nullptr, .close = nullptr});
  if (quiet == nullptr) return;
  (void)std::setvbuf(quiet, nullptr, _IONBF, 0);
  stderr = quiet;
  std::signal(SIGABRT, tell_heard);
#endif
}

void keep_closed_streams_closed() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) != -1) continue;
    // Opened the wrong way round, so that using it still fails.
    (void)open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

void tell(const std::string& text) {
  const bool ends_line = text.ends_with('\n');
  const auto line = std::string_view(text).substr(0, text.size() - (ends_line ? 1 : 0));
  (void)std::fputs((printable(line) + (ends_line ? "\n" : "")).c_str(), kOwnStderr);
  (void)std::fflush(kOwnStderr);
}

std::size_t terminal_columns(int stream) {
  constexpr std::size_t kUsual = 80;
  winsize size{};
  const bool is_known = ioctl(stream, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return is_known ? size.ws_col : kUsual;
}

void clear_terminal_line() {
  (void)std::fputs("\r\033[K", kOwnStderr);
  (void)std::fflush(kOwnStderr);
}

void flush_stdout() {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return;
  // The reason of an earlier failure is not kept.
  throw cannot_write("standard output", errno != 0 ? errno : EIO);
}

void print_document(const nlohmann::ordered_json& json, int indent) {
  const std::string text =
      json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  fmt::print("{}\n", printable_json(text));
}

void print_or_write(const std::string& text, const std::string& file) {
  if (file.empty()) {
    fmt::print("{}", text);
  } else {
    write_file(file, text);
  }
}

const std::atomic<bool>& stop_on_signal() {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  if (std::signal(SIGHUP, request_stop) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // by nohup
  return signal_arrived;
}

void open_page(const std::string& path) {
  const char* const browser = std::getenv("BROWSER");
  if (starts("xdg-open", path) || (browser && starts(browser, path))) return;
  throw Error(ErrorKind::output,
              fmt::format("'{}' is written, but neither xdg-open nor $BROWSER could show it; open "
                          "it by hand.",
                          path));
}

}  // namespace loopbit::cli
