#include "platform/video/sender_choice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "platform/video/rtp_packet.h"

namespace alidade {
namespace {

constexpr int kMostDoublings = 6;

}  // namespace

void SenderChoice::begin(int payload_type, std::optional<std::uint32_t> source, bool by_address,
                         double now_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  payload_type_ = payload_type;
  source_ = source;
  by_address_ = by_address;
  ++trial_;
  foreign_ = 0;
  foreign_kind_.clear();
  if (kept_ && is_heard(known_[*followed_], now_s)) return;
  kept_ = false;
  followed_.reset();
  const auto silent = [&](const Sender& sender) { return !is_heard(sender, now_s); };
  known_.erase(std::remove_if(known_.begin(), known_.end(), silent), known_.end());
  const auto next =
      std::min_element(known_.begin(), known_.end(),
                       [](const Sender& a, const Sender& b) { return a.trials < b.trials; });
  if (next != known_.end()) follow(static_cast<std::size_t>(next - known_.begin()), now_s);
}

void SenderChoice::follow(std::size_t which, double now_s) {
  followed_ = which;
  since_s_ = now_s;
  ++known_[which].trials;
}

bool SenderChoice::take(const sockaddr_storage& from, const std::uint8_t* data, std::size_t size,
                        double now_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const UdpSenders::Bytes address = UdpSenders::bytes_of(from).value_or(UdpSenders::Bytes{});
  const std::optional<std::uint32_t> reporter = reporting_source(data, size);
  const std::optional<RtpHeader> header = reporter ? std::nullopt : parse_rtp_header(data, size);
  const std::optional<std::uint32_t> source =
      header ? std::optional<std::uint32_t>(header->source) : reporter;
  if (source_ && source && source != source_) return leave_out(address, *source);
  if (!by_address_) return true;
  if (header && (payload_type_ < 0 || header->payload_type == payload_type_)) {
    return hear(address, header->source, now_s);
  }
  if (!followed_ || known_[*followed_].address == address) return true;
  return leave_out(address, source.value_or(0));
}

bool SenderChoice::hear(const UdpSenders::Bytes& address, std::uint32_t source, double now_s) {
  if (kept_) {
    Sender& sender = known_[*followed_];
    if (sender.address != address) {
      // After a long silence it is the next connection that chooses.
      return leave_out(address, source);
    }
    sender.heard_s = now_s;
    return true;
  }
  auto found = std::find_if(known_.begin(), known_.end(), [&](const Sender& sender) {
    return sender.address == address && sender.source == source;
  });
  if (found == known_.end() && known_.size() < kMostKnown) {
    found = known_.insert(known_.end(), {address, source, now_s, 0});
  }
  if (found == known_.end()) return leave_out(address, source);
  found->heard_s = now_s;
  const auto which = static_cast<std::size_t>(found - known_.begin());
  if (!followed_) follow(which, now_s);
  return which == *followed_ || leave_out(address, source);
}

bool SenderChoice::trial_is_over(double now_s, std::string* error) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (kept_ || !followed_ || !by_address_) return false;
  const Sender& sender = known_[*followed_];
  const double lasts_s = timeout_s_ * std::exp2(std::clamp(sender.trials - 1, 0, kMostDoublings));
  if (now_s - since_s_ <= lasts_s) return false;
  const auto is_other = [&](const Sender& other) {
    return &other != &sender && is_heard(other, now_s);
  };
  const auto other = std::find_if(known_.begin(), known_.end(), is_other);
  if (other == known_.end()) return false;
  *error = "no picture of " + name_of(sender.address, sender.source) +
           " can be decoded; others send, too, such as " + name_of(other->address, other->source) +
           ": they are tried in turn";
  return true;
}

int SenderChoice::trial() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return trial_;
}

void SenderChoice::keep(int trial) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (trial != trial_ || !followed_ || kept_) return;
  kept_ = true;
  known_ = {known_[*followed_]};
  followed_ = 0;
}

void SenderChoice::give_up() {
  const std::lock_guard<std::mutex> lock(mutex_);
  kept_ = false;
}

std::int64_t SenderChoice::foreign() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return foreign_;
}

std::string SenderChoice::foreign_kind() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return foreign_kind_;
}

bool SenderChoice::leave_out(const UdpSenders::Bytes& address, std::uint32_t source) {
  // A flood's packets are not described one by one.
  if (foreign_++ % 1024 == 0 || foreign_kind_.empty()) {
    foreign_kind_ = "another sender (" + name_of(address, source) + ")";
  }
  return false;
}

std::string SenderChoice::name_of(const UdpSenders::Bytes& address, std::uint32_t source) {
  char text[32];
  std::snprintf(text, sizeof text, ", SSRC %08X", static_cast<unsigned>(source));
  return UdpSenders::text_of(address) + text;
}

}  // namespace alidade
