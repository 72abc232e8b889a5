// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
/// The loopbit command, started once and forked for each call, because a start takes a quarter of a
/// second for the libraries that OpenCV loads. Linked with --wrap=main, so main() of the command is
/// __real_main().
///
/// A request on stdin: the number of strings, then so many strings, each with a zero byte at its
/// end: "run" or "start", working directory, files for stdout and stderr, the number of variables,
/// variables as NAME=VALUE, and the arguments, beginning with the name of the program. The answer
/// on stdout is a line: after "run" the exit code, or the negative number of the signal that ended
/// it; after "start" the number of the process, which whoever adopts orphans of this one waits for.
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

// NOLINTBEGIN(bugprone-reserved-identifier): the names that the linker gives.
extern "C" int __real_main(int argc, char** argv);
extern "C" int __wrap_main(int argc, char** argv);
// NOLINTEND(bugprone-reserved-identifier)

namespace {

std::optional<std::string> next_string() {
  std::string text;
  for (int c = std::getchar(); c != '\0'; c = std::getchar()) {
    if (c == EOF) return std::nullopt;
    text += static_cast<char>(c);
  }
  return text;
}

std::optional<std::vector<std::string>> next_request() {
  const std::optional<std::string> count = next_string();
  if (!count) return std::nullopt;
  std::vector<std::string> strings(std::stoul(*count));
  for (std::string& text : strings) text = next_string().value();
  return strings;
}

void redirect(int stream, const char* file, int flags) {
  const int opened = open(file, flags, 0600);
  if (opened < 0 || dup2(opened, stream) < 0) std::abort();
  close(opened);
}

constexpr unsigned kTimeLimit_s = 600;  ///< as in served_command.py

[[noreturn]] void run(std::vector<std::string> request) {
  if (chdir(request[1].c_str()) != 0) std::abort();
  redirect(STDIN_FILENO, "/dev/null", O_RDONLY);
  redirect(STDOUT_FILENO, request[2].c_str(), O_WRONLY);
  redirect(STDERR_FILENO, request[3].c_str(), O_WRONLY);
  alarm(kTimeLimit_s);
  const std::size_t arguments = 5 + std::stoul(request[4]);
  for (std::size_t i = 5; i < arguments; ++i) putenv(request[i].data());
  std::vector<char*> argv;
  for (std::size_t i = arguments; i < request.size(); ++i) argv.push_back(request[i].data());
  const int count = static_cast<int>(argv.size());
  argv.push_back(nullptr);
  const int code = __real_main(count, argv.data());
  std::fflush(nullptr);
  _exit(code);  // 246 libraries have much to tidy up
}

/// Leaves the process that runs the request an orphan.
[[noreturn]] void start(std::vector<std::string> request) {
  const pid_t child = fork();
  if (child == 0) run(std::move(request));
  std::printf("%d", child);  // the end of the line comes when this process is gone
  std::fflush(stdout);
  _exit(child < 0 ? 1 : 0);
}

}  // namespace

int __wrap_main(int /*argc*/, char** /*argv*/) {
  while (std::optional<std::vector<std::string>> request = next_request()) {
    const bool is_start = request->front() == "start";
    const pid_t child = fork();
    if (child == 0) (is_start ? start : run)(std::move(*request));
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) return 1;
    if (!is_start) std::printf("%d", WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status));
    std::printf("\n");
    std::fflush(stdout);
  }
  return 0;
}
