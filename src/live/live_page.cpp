// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "loopbit/live_page.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <httplib.h>
#include <unistd.h>

#include "loopbit/error.hpp"
#include "loopbit/growing_report.hpp"
#include "loopbit/read_file.hpp"
#include "loopbit/text_rows.hpp"

namespace loopbit {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

constexpr std::size_t kMaxViewers = 16;
constexpr std::size_t kOtherRequests = 8;  ///< that are answered at the same time
/// A viewer hears of new frames this often, and of nothing new every so many times.
constexpr auto kPause = 100ms;
constexpr int kPausesOfSilence = 20;
constexpr std::size_t kFramesPerEvent = 2000;
/// A viewer that takes nothing for so long is left, and comes back if it is still there.
constexpr auto kPatience = 3s;
/// For viewers to ask for the finished page.
constexpr auto kFarewell = 3s;
/// The evidence of more of the latest frames than may not be in the file yet.
constexpr std::size_t kLatest = std::size_t{2} * kFramesPerTransaction;

constexpr const char* kHtml = "text/html; charset=utf-8";
constexpr const char* kJson = "application/json";

bool is_loopback(const std::string& address) {
  const bool is_ipv4 = address.find_first_not_of("0123456789.") == std::string::npos;
  return address == "localhost" || address == "::1" || (is_ipv4 && address.starts_with("127."));
}

/// 128 bits that nobody can guess, as hexadecimal digits.
std::string secret() {
  std::random_device random;
  std::string digits;
  for (int i = 0; i < 4; ++i) digits += fmt::format("{:08x}", std::uint32_t{random()});
  return digits;
}

/// The name for a URL, which others have to reach.
std::string name_for(const std::string& address) {
  if (address == "0.0.0.0" || address == "::") {
    std::array<char, 256> name{};
    if (gethostname(name.data(), name.size() - 1) == 0) return name.data();
  }
  return address.find(':') == std::string::npos ? address : fmt::format("[{}]", address);
}

/// Of the same address as ours: a page of elsewhere whose name was made to lead here has another.
bool is_ours(const std::string& host) {
  const auto port = host.rfind(':');
  const bool has_port = port != std::string::npos && host.find(']', port) == std::string::npos;
  const std::string name = host.substr(0, has_port ? port : host.size());
  return is_loopback(name) || name == "[::1]";
}

/// Threads that start here and later do not die of a viewer that hangs up, whatever the process
/// does with that signal.
class BrokenPipesIgnored {
 public:
  BrokenPipesIgnored() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &signals, &before_);
  }
  ~BrokenPipesIgnored() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  BrokenPipesIgnored(const BrokenPipesIgnored&) = delete;
  BrokenPipesIgnored& operator=(const BrokenPipesIgnored&) = delete;
  BrokenPipesIgnored(BrokenPipesIgnored&&) = delete;
  BrokenPipesIgnored& operator=(BrokenPipesIgnored&&) = delete;

 private:
  sigset_t before_{};
};

/// httplib's constructor sets the process's handling of SIGPIPE.
std::unique_ptr<httplib::Server> make_server() {
  struct sigaction before {};
  sigaction(SIGPIPE, nullptr, &before);
  auto server = std::make_unique<httplib::Server>();
  sigaction(SIGPIPE, &before, nullptr);
  return server;
}

/// What the run has so far. Written by the run, read by viewers.
class GrowingRun {
 public:
  void start(const std::string& folder) {
    const std::lock_guard lock(mutex_);
    folder_ = folder;
  }

  void add(const Detection& detection) {
    const std::lock_guard lock(mutex_);
    detections_.push_back(detection);
  }

  void add(const Detection& detection, const StoredEvidence& evidence) {
    const std::lock_guard lock(mutex_);
    if (latest_.size() == kLatest) latest_.pop_front();
    latest_.emplace_back(detection.frame, evidence);
  }

  /// Empty before the run has one.
  [[nodiscard]] std::string folder() const {
    const std::lock_guard lock(mutex_);
    return folder_;
  }

  /// Frames from `first` on, up to kFramesPerEvent.
  [[nodiscard]] std::vector<Detection> frames_from(std::size_t first) const {
    const std::lock_guard lock(mutex_);
    const std::size_t last = std::min(detections_.size(), first + kFramesPerEvent);
    if (first >= last) return {};
    const auto at = [&](std::size_t i) { return detections_.begin() + std::ptrdiff_t(i); };
    return {at(first), at(last)};
  }

  /// Nothing for a frame that has none.
  [[nodiscard]] std::optional<StoredEvidence> evidence_of(PlaceId frame) const {
    {
      const std::lock_guard lock(mutex_);
      const auto found =
          std::ranges::find(latest_, frame, &std::pair<PlaceId, StoredEvidence>::first);
      if (found != latest_.end()) return found->second;
    }
    StoredEvidence evidence;
    const std::string file = (fs::path(folder()) / "evidence.db").string();
    if (!EvidenceReader(file).read(frame, evidence)) return std::nullopt;
    return evidence;
  }

 private:
  mutable std::mutex mutex_;
  std::string folder_;
  std::vector<Detection> detections_;
  std::deque<std::pair<PlaceId, StoredEvidence>> latest_;
};

}  // namespace

class LivePage::Impl {
 public:
  explicit Impl(const Options& options) : server_(make_server()), id_(secret()) {
    const bool is_open = !is_loopback(options.address);
    if (is_open) path_ += secret() + '/';
    server_->set_pre_routing_handler([is_open](const auto& request, auto& response) {
      using Response = httplib::Server::HandlerResponse;
      if (is_open || is_ours(request.get_header_value("Host"))) return Response::Unhandled;
      response.status = 403;
      return Response::Handled;
    });
    server_->set_exception_handler(
        [](const auto&, auto& response, const auto&) { response.status = 500; });
    server_->set_default_headers({{"Cache-Control", "no-store"},
                                  {"Referrer-Policy", "no-referrer"},
                                  {"X-Content-Type-Options", "nosniff"}});
    server_->Get(path_, [this](const auto&, auto& response) { show_page(response); });
    server_->Get(path_ + "pictures/(\\d{1,9})", [this](const auto& request, auto& response) {
      show_picture(*parse_number<std::size_t>(request.matches[1].str()), response);
    });
    server_->Get(path_ + "events/(\\w{1,40})", [this](const auto& request, auto& response) {
      feed(request.matches[1], request.get_header_value("Last-Event-ID"), response);
    });
    // Connections that stay open without a request would take threads from viewers.
    server_->set_keep_alive_max_count(1);
    server_->set_read_timeout(kPatience);
    server_->set_write_timeout(kPatience);
    server_->set_tcp_nodelay(true);
    server_->new_task_queue = [] { return new httplib::ThreadPool(kMaxViewers + kOtherRequests); };
    // The usual options would let two servers share a port.
    server_->set_socket_options([](int socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    const int port = bind(options);
    url_ = fmt::format("http://{}:{}{}", name_for(options.address), port, path_);
    const BrokenPipesIgnored ignored;
    thread_ = std::thread([this] { server_->listen_after_bind(); });
  }

  ~Impl() {
    end(nullptr);
    while (!server_->is_running()) std::this_thread::yield();  // a stop before that is lost
    server_->stop();
    thread_.join();
  }

  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  [[nodiscard]] const std::string& url() const { return url_; }
  GrowingRun& run() { return run_; }

  /// Ends the streams of events. `page`: what viewers get from now on; null = what they got so far.
  void end(std::shared_ptr<const std::string> page) {
    std::unique_lock lock(mutex_);
    if (has_ended_) return;
    has_ended_ = true;
    const bool is_finished = page != nullptr;
    finished_ = std::move(page);
    changed_.notify_all();
    if (!is_finished) return;
    // Each viewer hears that the run has ended, and asks for the page once more.
    changed_.wait_for(lock, kFarewell, [&] { return viewers_ == 0 && unserved_ <= 0; });
  }

 private:
  int bind(const Options& options) {
    const auto& [address, port] = options;
    errno = 0;
    const int bound = port == 0                              ? server_->bind_to_any_port(address)
                      : server_->bind_to_port(address, port) ? port
                                                             : -1;
    if (bound > 0) return bound;
    throw Error(
        ErrorKind::option,
        fmt::format("The live page cannot be served on {} port {}{}.", address, port,
                    errno != 0
                        ? fmt::format(" ({}); choose another port, or 0 for any that is free",
                                      std::generic_category().message(errno))
                        : ", which is no address of this machine; choose another one"));
  }

  void show_page(httplib::Response& response) {
    std::shared_ptr<const std::string> finished;
    {
      const std::lock_guard lock(mutex_);
      finished = finished_;
      if (finished && unserved_ > 0) --unserved_;
      changed_.notify_all();
    }
    if (finished) {
      response.set_content(*finished, kHtml);
      return;
    }
    const std::string folder = run_.folder();
    if (folder.empty()) {
      response.set_header("Refresh", "1");
      response.set_content("<!doctype html><title>loopbit</title>The run has not begun.", kHtml);
      return;
    }
    const std::string name = fs::path(folder).filename().string();
    response.set_content(
        growing_report(name, read_file((fs::path(folder) / "run.json").string()), id_), kHtml);
  }

  void show_picture(std::size_t frame, httplib::Response& response) {
    const auto evidence = run_.evidence_of(static_cast<PlaceId>(frame));
    if (evidence) {
      response.set_content(report_picture(*evidence), kJson);
    } else {
      response.status = 404;
    }
  }

  /// Server-sent events: the columns of frames, with the number of the frame after them as their
  /// ID, and at last "end" with what to do.
  void feed(const std::string& run, const std::string& last_event, httplib::Response& response) {
    {
      const std::lock_guard lock(mutex_);
      if (viewers_ == kMaxViewers) {
        response.status = 503;
        return;
      }
      ++viewers_;
    }
    auto viewer = std::make_shared<Viewer>(Viewer{
        .is_of_this_run = run == id_, .next = parse_number<std::size_t>(last_event).value_or(0)});
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, viewer](std::size_t /*offset*/, httplib::DataSink& sink) {
          return send_news(*viewer, sink);
        },
        [this](bool /*success*/) { forget_viewer(); });
  }

  /// Someone with a stream of events.
  struct Viewer {
    bool is_of_this_run = false;  ///< else of one that was here before
    std::size_t next = 0;         ///< frame
    int silence = 0;              ///< pauses without news
  };

  /// False if the viewer has gone.
  bool send_news(Viewer& viewer, httplib::DataSink& sink) {
    const auto send = [&](const std::string& text) {
      viewer.silence = 0;
      return sink.write(text.data(), text.size());
    };
    const bool has_ended = pause();
    const auto frames =
        viewer.is_of_this_run ? run_.frames_from(viewer.next) : std::vector<Detection>();
    if (!frames.empty()) {
      const std::size_t from = std::exchange(viewer.next, viewer.next + frames.size());
      return send(fmt::format("id: {}\ndata: {{\"from\":{},\"columns\":{}}}\n\n", viewer.next, from,
                              report_columns(frames)));
    }
    if (has_ended || !viewer.is_of_this_run) {
      const bool has_page = !viewer.is_of_this_run || count_unserved();
      const bool is_sent =
          send(fmt::format("event: end\ndata: {}\n\n", has_page ? "load" : "stay"));
      sink.done();
      return is_sent;
    }
    return ++viewer.silence < kPausesOfSilence || send(":\n\n");
  }

  /// Returns whether the run has ended.
  bool pause() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPause, [&] { return has_ended_; });
  }

  /// Counts a viewer that is told to load the finished page; false if there is none.
  bool count_unserved() {
    const std::lock_guard lock(mutex_);
    if (finished_) ++unserved_;
    return finished_ != nullptr;
  }

  void forget_viewer() {
    const std::lock_guard lock(mutex_);
    --viewers_;
    changed_.notify_all();
  }

  GrowingRun run_;
  std::unique_ptr<httplib::Server> server_;
  std::string id_;          ///< of the run, for viewers that come back
  std::string path_ = "/";  ///< with the token, if there is one
  std::string url_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t viewers_ = 0;  ///< with a stream of events
  int unserved_ = 0;         ///< viewers that were told of the end, but have no finished page yet
  bool has_ended_ = false;
  std::shared_ptr<const std::string> finished_;
  std::thread thread_;
};

LivePage::LivePage(const Options& options) : impl_(std::make_unique<Impl>(options)) {}
LivePage::~LivePage() = default;

const std::string& LivePage::url() const { return impl_->url(); }

RunListener LivePage::beside(const RunListener& listener) {
  RunListener both = listener;
  GrowingRun& run = impl_->run();
  both.on_start = [&run, listener](const std::string& folder) {
    run.start(folder);
    if (listener.on_start) listener.on_start(folder);
  };
  both.on_detection = [&run, listener](const Detection& detection) {
    run.add(detection);
    listener.on_detection(detection);
  };
  both.on_stored = [&run, listener](const Detection& detection, const StoredEvidence& evidence) {
    run.add(detection, evidence);
    if (listener.on_stored) listener.on_stored(detection, evidence);
  };
  return both;
}

void LivePage::finish(const std::string& report) {
  impl_->end(std::make_shared<std::string>(read_file(report)));
  impl_.reset();
}

}  // namespace loopbit
