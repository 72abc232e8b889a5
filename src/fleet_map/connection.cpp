// SPDX-FileCopyrightText: 2026 The loopbit authors
// SPDX-License-Identifier: MIT
#include "connection.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <future>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <poll.h>

#include "loopbit/error.hpp"

namespace loopbit {
namespace {

constexpr int kBinary = 1;
/// 3 MB of features.
constexpr int kMaxPosted = 128;

/// Network byte order, which is big-endian.
std::string big_endian(std::uint64_t value) {
  std::string bytes(sizeof value, '\0');
  for (std::size_t i = 0; i < sizeof value; ++i) {
    bytes[i] = static_cast<char>(value >> (56U - 8U * i));
  }
  return bytes;
}

std::span<const unsigned char> value_in(const PGresult& result, int row, int column) {
  return {reinterpret_cast<const unsigned char*>(PQgetvalue(&result, row, column)),
          static_cast<std::size_t>(PQgetlength(&result, row, column))};
}

std::uint64_t from_big_endian(std::span<const unsigned char> bytes) {
  std::uint64_t value = 0;
  for (const unsigned char byte : bytes) value = value << 8U | byte;
  return value;
}

/// libpq's messages have several lines.
std::string one_line(const char* message) {
  std::string text = message ? message : "";
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
  text.erase(text.find_last_not_of(' ') + 1);
  return text.empty() ? "out of memory" : text;
}

/// The clause that ends the sentence of an error, by its SQLSTATE (PostgreSQL 15, appendix A).
std::string remedy_for(std::string_view state, const std::string& shown) {
  if (state == "42501") {
    return "the map's owner may GRANT loopbit_reader TO the user, or loopbit_writer for sessions "
           "of "
           "its own; docs/fleet.md says who may make a map";
  }
  if (state == "42P01" || state == "42703" || state == "3F000") {
    return fmt::format(
        "its tables are no map; 'loopbit map create {}' makes one in another database", shown);
  }
  if (state.starts_with("53")) return "free space or memory on the server, then run again";
  if (state.starts_with("22") || state.starts_with("23")) {
    return "the server refuses these rows; 'loopbit map check' says whether their source is "
           "damaged";
  }
  if (state.starts_with("40")) return "another program changed the same rows; run again";
  if (state.empty() || state.starts_with("08") || state.starts_with("57")) {
    return "check that the server runs and can be reached; what was committed before is kept";
  }
  return "the log of the server may say more";
}

/// Such as "host=... connect_timeout=10": a robot should not wait for minutes.
constexpr const char* kConnectTimeout_s = "10";

PGconn* connect(const Address& address) {
  // What the address says comes later, and so it counts.
  std::vector<const char*> names{"client_encoding", "fallback_application_name"};
  std::vector<const char*> values{"UTF8", "loopbit"};
  if (!std::getenv("PGCONNECT_TIMEOUT")) {
    names.push_back("connect_timeout");
    values.push_back(kConnectTimeout_s);
  }
  names.insert(names.end(), {"dbname", nullptr});
  values.insert(values.end(), {address.uri().c_str(), nullptr});
  constexpr int kExpandAddress = 1;
  return PQconnectdbParams(names.data(), values.data(), kExpandAddress);
}

/// The tables are in a schema of their own. A robot whose network or power is cut should count as
/// writing for a minute, not for the two hours that are the default of Linux.
constexpr const char* kSettings =
    "SET search_path = loopbit, pg_temp; SET tcp_keepalives_idle = 30; "
    "SET tcp_keepalives_interval = 10; SET tcp_keepalives_count = 3";

/// How soon an interrupt is noticed.
constexpr std::chrono::milliseconds kSlice{20};

/// The same, but null as soon as `is_interrupted`. Only PQconnectdbParams() tries all hosts of an
/// address in time, and it cannot be interrupted; so it may go on, on a thread of its own.
PGconn* connect(const Address& address, const std::atomic<bool>& is_interrupted) {
  if (is_interrupted) return nullptr;
  using Handle = std::unique_ptr<PGconn, decltype(&PQfinish)>;
  std::packaged_task<Handle()> task([address] { return Handle(connect(address), PQfinish); });
  std::future<Handle> connected = task.get_future();
  std::thread(std::move(task)).detach();
  while (connected.wait_for(kSlice) != std::future_status::ready) {
    if (is_interrupted) return nullptr;
  }
  return connected.get().release();
}

}  // namespace

Parameter parameter(std::int64_t value) { return big_endian(static_cast<std::uint64_t>(value)); }

std::int64_t integer_in(const PGresult& result, int row, int column) {
  const auto bytes = value_in(result, row, column);
  const std::uint64_t value = from_big_endian(bytes);
  switch (bytes.size()) {
    case 1:  // a bool
      return static_cast<std::int64_t>(value);
    case sizeof(std::int32_t):
      return static_cast<std::int32_t>(value);
    case sizeof(std::int64_t):
      return static_cast<std::int64_t>(value);
    default:
      return 0;
  }
}

Connection::Connection(const Address& address, MapDatabase::Access access)
    : address_(address),
      shown_(address.shown()),
      access_(access),
      handle_(connect(address, is_interrupted_)) {
  begin();
}

void Connection::reconnect() {
  prepared_.clear();
  posted_ = 0;
  handle_.reset(connect(address_, is_interrupted_));
  is_given_up_ = false;
  is_listening_ = false;
  begin();
}

void Connection::begin() {
  if (PQstatus(handle_.get()) != CONNECTION_OK) {
    fail(one_line(PQerrorMessage(handle_.get())),
         "check the address and the user, and that the server runs; passwords are best kept in "
         "~/.pgpass");
  }
  PQsetNoticeProcessor(
      handle_.get(), [](void*, const char*) {}, nullptr);
  PQsetnonblocking(handle_.get(), 1);
  execute(kSettings);
  if (access_ == MapDatabase::Access::read) {
    execute("SET default_transaction_read_only = on");
  } else {
    // Others wait for a transaction whose robot has stopped.
    execute("SET idle_in_transaction_session_timeout = '10s'");
  }
}

Result Connection::execute(const std::string& sql) const {
  check_not_given_up();
  settle();
  PQsendQuery(handle_.get(), sql.c_str());
  return checked(answer());
}

void Connection::wait_for_notification(const std::string& channel, std::chrono::milliseconds most) {
  if (!std::exchange(is_listening_, true)) {
    execute("LISTEN " + channel);
    return;
  }
  const auto end = std::chrono::steady_clock::now() + most;
  pollfd server{.fd = PQsocket(handle_.get()), .events = POLLIN, .revents = 0};
  const auto take = [this] {
    const std::unique_ptr<PGnotify, decltype(&PQfreemem)> one(PQnotifies(handle_.get()), PQfreemem);
    return one != nullptr;
  };
  while (!is_interrupted_ && std::chrono::steady_clock::now() < end) {
    bool is_told = false;
    while (take()) is_told = true;
    if (is_told) return;
    if (poll(&server, 1, static_cast<int>(kSlice.count())) == 0) continue;
    if (PQconsumeInput(handle_.get()) == 0) {
      fail(one_line(PQerrorMessage(handle_.get())), remedy_for("", shown_));
    }
  }
}

void Connection::check_not_given_up() const {
  if (is_given_up_) fail("it did not answer in time", remedy_for("", shown_));
}

void Connection::wait_for_server(int events) const {
  const auto begin = std::chrono::steady_clock::now();
  pollfd server{.fd = PQsocket(handle_.get()), .events = static_cast<short>(events), .revents = 0};
  constexpr auto kSlice_ms = static_cast<int>(kSlice.count());
  while (poll(&server, 1, kSlice_ms) == 0) {
    const bool is_late = limit_.count() > 0 && std::chrono::steady_clock::now() - begin > limit_;
    if (!is_late && !is_interrupted_) continue;
    is_given_up_ = true;
    fail(is_late ? fmt::format("no answer within {} ms", limit_.count()) : "interrupted",
         remedy_for("", shown_));
  }
}

void Connection::flush() const {
  int unsent = PQflush(handle_.get());
  for (; unsent > 0; unsent = PQflush(handle_.get())) {
    wait_for_server(POLLIN | POLLOUT);
    if (PQconsumeInput(handle_.get()) == 0) break;
  }
}

Result Connection::next_answer() const {
  while (PQisBusy(handle_.get()) != 0) {
    wait_for_server(POLLIN);
    if (PQconsumeInput(handle_.get()) == 0) break;
  }
  return Result(PQgetResult(handle_.get()));
}

Result Connection::answer() const {
  flush();
  Result kept;
  while (Result next = next_answer()) {
    if (!kept || PQresultStatus(kept.get()) != PGRES_FATAL_ERROR) kept = std::move(next);
  }
  return kept;
}

void Connection::settle() const {
  if (std::exchange(posted_, 0) == 0) return;
  Result failed;
  is_given_up_ = PQpipelineSync(handle_.get()) == 0;
  if (is_given_up_) (void)checked(std::move(failed));
  flush();
  while (PQstatus(handle_.get()) == CONNECTION_OK) {
    Result next = next_answer();  // null between the answers to two statements
    const ExecStatusType status = PQresultStatus(next.get());
    if (next && status == PGRES_PIPELINE_SYNC) break;
    if (next && status == PGRES_FATAL_ERROR && !failed) failed = std::move(next);
  }
  PQexitPipelineMode(handle_.get());
  if (failed || PQstatus(handle_.get()) != CONNECTION_OK) (void)checked(std::move(failed));
}

void Connection::prepare(const std::string& sql, std::size_t parameters) const {
  if (prepared_.contains(sql)) return;
  settle();
  const std::string name = fmt::format("s{}", prepared_.size());
  PQsendPrepare(handle_.get(), name.c_str(), sql.c_str(), static_cast<int>(parameters), nullptr);
  (void)checked(answer());
  prepared_.emplace(sql, name);
}

void Connection::send(const std::string& sql, const std::vector<Parameter>& parameters) const {
  std::vector<const char*> values;
  std::vector<int> sizes;
  for (const Parameter& value : parameters) {
    values.push_back(value ? value->data() : nullptr);
    sizes.push_back(value ? static_cast<int>(value->size()) : 0);
  }
  const std::vector<int> formats(parameters.size(), kBinary);
  PQsendQueryPrepared(handle_.get(), prepared_.at(sql).c_str(), static_cast<int>(parameters.size()),
                      values.data(), sizes.data(), formats.data(), kBinary);
}

Result Connection::run(const std::string& sql, const std::vector<Parameter>& parameters) const {
  check_not_given_up();
  settle();
  prepare(sql, parameters.size());
  send(sql, parameters);
  return checked(answer());
}

void Connection::post(const std::string& sql, const std::vector<Parameter>& parameters) const {
  if (posted_ == 0 && PQtransactionStatus(handle_.get()) != PQTRANS_INTRANS) {
    (void)run(sql, parameters);
    return;
  }
  check_not_given_up();
  prepare(sql, parameters.size());
  if (posted_ == 0) PQenterPipelineMode(handle_.get());
  send(sql, parameters);
  if (++posted_ >= kMaxPosted) settle();
}

void Connection::roll_back() const {
  try {
    settle();
  } catch (const Error&) {  // of what is undone
  }
  try {
    (void)execute("ROLLBACK");
  } catch (const Error&) {
  }
}

std::int64_t Connection::integer(const std::string& sql,
                                 const std::vector<Parameter>& parameters) const {
  const Result result = run(sql, parameters);
  return PQntuples(result.get()) > 0 ? integer_in(*result, 0, 0) : 0;
}

void Connection::refuse(const std::string& why) const {
  throw Error(ErrorKind::input, fmt::format("'{}' {}.", shown_, why));
}

Result Connection::checked(Result answer) const {
  const ExecStatusType status = PQresultStatus(answer.get());
  if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK || status == PGRES_EMPTY_QUERY) {
    return answer;
  }
  const char* state = PQresultErrorField(answer.get(), PG_DIAG_SQLSTATE);
  const char* message = PQresultErrorField(answer.get(), PG_DIAG_MESSAGE_PRIMARY);
  fail(one_line(message ? message : PQerrorMessage(handle_.get())),
       remedy_for(state ? state : "", shown_));
}

void Connection::fail(const std::string& reason, const std::string& remedy) const {
  const bool reads = access_ == MapDatabase::Access::read;
  throw Error(reads ? ErrorKind::input : ErrorKind::output,
              fmt::format("'{}' cannot be {} ({}): {}.", shown_, reads ? "read" : "written", reason,
                          remedy));
}

FleetStatement::FleetStatement(const Connection& connection, std::string sql)
    : connection_(connection), sql_(std::move(sql)) {
  std::replace(sql_.begin(), sql_.end(), '?', '$');
}

void FleetStatement::set(int number, Parameter value) {
  const auto size = static_cast<std::size_t>(number);
  if (parameters_.size() < size) parameters_.resize(size);
  parameters_[size - 1] = std::move(value);
}

void FleetStatement::bind(int number, std::int64_t value) { set(number, parameter(value)); }

void FleetStatement::bind(int number, double value) {
  set(number, big_endian(std::bit_cast<std::uint64_t>(value)));
}

void FleetStatement::bind(int number, std::span<const unsigned char> bytes) {
  set(number, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

void FleetStatement::bind(int number, std::string_view text) { set(number, std::string(text)); }

void FleetStatement::bind_null(int number) { set(number, std::nullopt); }

bool FleetStatement::step() {
  if (result_) {
    ++row_;
  } else {
    result_ = connection_.run(sql_, parameters_);
    row_ = 0;
  }
  return row_ < PQntuples(result_.get());
}

std::int64_t FleetStatement::integer(int column) const {
  return integer_in(*result_, row_, column);
}

double FleetStatement::real(int column) const {
  const auto value = bytes(column);
  return value.size() == sizeof(double) ? std::bit_cast<double>(from_big_endian(value)) : 0.0;
}

bool FleetStatement::is_null(int column) const {
  return PQgetisnull(result_.get(), row_, column) != 0;
}

std::span<const unsigned char> FleetStatement::bytes(int column) const {
  return value_in(*result_, row_, column);
}

}  // namespace loopbit
