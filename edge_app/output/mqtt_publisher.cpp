#include "edge_app/output/mqtt_publisher.h"

#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "edge_app/output/clock_pair.h"
#include "edge_app/record/record_format.h"
#include "platform/system/backoff.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

constexpr double kClockPeriod_s = 10;
constexpr double kFarewell_s = 0.5;

std::shared_ptr<const std::string> shared(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

}  // namespace

MqttPublisher::MqttPublisher(const MqttOptions& options)
    : options_(options), news_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  constexpr std::array<const char*, kTopics> kNames = {"status", "targets", "clock", "orientation"};
  for (std::size_t i = 0; i < kTopics; ++i) slots_[i].topic = options.prefix + "/" + kNames[i];
  slots_[kOrientation].retain = false;
}

MqttPublisher::~MqttPublisher() { stop(); }

bool MqttPublisher::start() {
  return thread_.start([this] { run(); });
}

void MqttPublisher::stop() {
  ends_ = true;
  static_cast<void>(::eventfd_write(news_.get(), 1));
  thread_.join();
}

void MqttPublisher::take_targets(std::shared_ptr<const std::string> json) {
  {
    const std::lock_guard<std::mutex> lock(targets_mutex_);
    if (offered_targets_) ++replaced_;
    offered_targets_ = std::move(json);
  }
  static_cast<void>(::eventfd_write(news_.get(), 1));
}

bool MqttPublisher::write(const OrientationRecord& record) {
  if (!wants_record_.exchange(false)) return true;
  {
    const std::lock_guard<PriorityMutex> lock(record_mutex_);
    offered_record_ = record;
  }
  static_cast<void>(::eventfd_write(news_.get(), 1));
  return true;
}

MqttCounters MqttPublisher::counters() const {
  return {connected_, connections_, published_, replaced_};
}

void MqttPublisher::run() {
  Backoff backoff(options_.max_backoff_s);
  while (!ends_) {
    const MqttConnection::Message will{slots_[kStatus].topic, "offline", true};
    MqttConnection connection(options_, &will, &errand_);
    connection.set_on_published([this](int id) { published(id); });
    if (connection.begin()) keep_connected(&connection);
    const bool was_connected = connected_.exchange(false);
    if (was_connected) backoff.reset();
    if (ends_) return;
    tell_of_failure(connection.error(), was_connected);
    pause(backoff.next_s());
  }
}

// Returns when the connection fails or the publisher ends.
void MqttPublisher::keep_connected(MqttConnection* connection) {
  while (connection->step()) {
    if (connection->is_connected() && !connected_) connection_begins();
    if (ends_) {
      if (connected_) say_farewell(connection);
      return;
    }
    const double now_s = monotonic_now_s();
    if (connected_) {
      gather(now_s);
      if (!send(connection)) return;
    }
    double until_s = now_s + connection->patience_s();
    if (connected_) until_s = std::min(until_s, next_due_s());
    wait_for(connection, until_s);
  }
}

void MqttPublisher::connection_begins() {
  connected_ = true;
  ++connections_;
  told_.clear();
  spdlog::info("MQTT: connected to {}, topics {}/...", options_.name(), options_.prefix);
  // Send again what was under way, or what replaced it since.
  for (Slot& slot : slots_) {
    slot.under_way.reset();
    slot.waits = slot.newest != nullptr;
  }
  // An old record is of no use, unlike old targets.
  slots_[kOrientation].waits = false;
  {
    const std::lock_guard<PriorityMutex> lock(record_mutex_);
    offered_record_.reset();
  }
  wants_record_ = options_.orientation_rate_hz > 0;
  put(kStatus, shared("online"));
  if (std::exchange(first_connection_, false) && !slots_[kTargets].newest)
    put(kTargets, shared(""));
  next_clock_s_ = 0;
}

double MqttPublisher::next_due_s() const {
  const bool counts_down = options_.orientation_rate_hz > 0 && !wants_record_;
  return counts_down ? std::min(next_clock_s_, next_record_s_) : next_clock_s_;
}

// Collects what is new since the last call.
void MqttPublisher::gather(double now_s) {
  std::shared_ptr<const std::string> targets;
  {
    const std::lock_guard<std::mutex> lock(targets_mutex_);
    targets.swap(offered_targets_);
  }
  if (targets) put(kTargets, std::move(targets));
  if (now_s >= next_clock_s_) {
    put(kClock, shared(clock_pair_json().dump()));
    next_clock_s_ = now_s + kClockPeriod_s;
  }
  if (options_.orientation_rate_hz == 0) return;
  std::optional<OrientationRecord> record;
  {
    const std::lock_guard<PriorityMutex> lock(record_mutex_);
    record.swap(offered_record_);
  }
  if (record) {
    std::string line = json_line(*record);
    line.pop_back();
    put(kOrientation, shared(std::move(line)));
    next_record_s_ = now_s + 1 / options_.orientation_rate_hz;
  } else if (now_s >= next_record_s_) {
    wants_record_ = true;
  }
}

void MqttPublisher::put(Topic topic, std::shared_ptr<const std::string> payload) {
  Slot& slot = slots_[topic];
  if (slot.waits) ++replaced_;
  slot.newest = std::move(payload);
  slot.waits = true;
}

bool MqttPublisher::send(MqttConnection* connection) {
  for (Slot& slot : slots_) {
    if (!slot.waits || slot.under_way) continue;
    int id = 0;
    if (!connection->publish(slot.topic, *slot.newest, slot.retain, &id)) return false;
    slot.waits = false;
    slot.under_way = id;
  }
  return true;
}

void MqttPublisher::published(int id) {
  for (Slot& slot : slots_) {
    if (slot.under_way != id) continue;
    slot.under_way.reset();
    ++published_;
  }
}

void MqttPublisher::say_farewell(MqttConnection* connection) {
  for (Slot& slot : slots_) slot.waits = false;
  put(kStatus, shared("offline"));
  const double until_s = monotonic_now_s() + kFarewell_s;
  const Slot& status = slots_[kStatus];
  while (status.waits || status.under_way) {
    if (!send(connection) || monotonic_now_s() > until_s) return;
    wait_for(connection, until_s);
    if (!connection->step()) return;
  }
  connection->end();
}

// Waits for the socket, for news, or until until_s.
void MqttPublisher::wait_for(const MqttConnection* connection, double until_s) {
  std::array<pollfd, 2> both = {{{news_.get(), POLLIN, 0}, {-1, POLLIN, 0}}};
  if (connection != nullptr) {
    both[1].fd = connection->socket();
    if (!connection->wants_to_read()) both[1].events = 0;
    if (connection->wants_to_write()) both[1].events |= POLLOUT;
  }
  constexpr double kMilli = 1000;
  const double left_ms = std::ceil(kMilli * std::max(0.0, until_s - monotonic_now_s()));
  static_cast<void>(::poll(both.data(), both.size(), static_cast<int>(left_ms)));
  eventfd_t count = 0;
  if (both[0].revents != 0) static_cast<void>(::eventfd_read(news_.get(), &count));
}

// News do not shorten the pause.
void MqttPublisher::pause(double seconds) {
  const double until_s = monotonic_now_s() + seconds;
  while (!ends_ && monotonic_now_s() < until_s) wait_for(nullptr, until_s);
}

// Logs a failure once, not at each attempt.
void MqttPublisher::tell_of_failure(const std::string& error, bool was_connected) {
  if (!was_connected && error == told_) return;
  told_ = error;
  spdlog::warn("MQTT: {}{}; tries again", was_connected ? "lost " : "", error);
}

}  // namespace alidade
