#include "platform/discovery/network_search.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>

#include "platform/system/clock.h"
#include "platform/system/file_descriptor.h"
#include "platform/system/random.h"
#include "platform/system/shown.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

// s after the beginning. A device may wait half a second before it answers.
constexpr double kQuestionTimes_s[] = {0, 0.4, 1.2};
constexpr std::size_t kMostDatagramBytes = 65536;
constexpr int kMostAnswers = 4096;
constexpr std::size_t kMostNotes = 8;

// Axis; newer devices offer the latter two besides.
const std::vector<std::string>& vapix_services() {
  static const std::vector<std::string> kServices = {
      "_axis-video._tcp.local", "_vapix-http._tcp.local", "_vapix-https._tcp.local"};
  return kServices;
}

// A version 4 UUID.
std::string new_uuid() {
  const std::string digits = random_hex(30);
  return digits.substr(0, 8) + "-" + digits.substr(8, 4) + "-4" + digits.substr(12, 3) + "-8" +
         digits.substr(15, 3) + "-" + digits.substr(18, 12);
}

struct Place {
  std::string interface;
  unsigned index = 0;
  int family = AF_INET;
  sockaddr_storage own{};  // this machine's address there
};

socklen_t size_of(int family) {
  return family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
}

// One for each interface and family.
std::vector<Place> places(const std::string& only, std::string* error) {
  std::vector<Place> places;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) {
    *error = std::string("the network's interfaces cannot be listed: ") + std::strerror(errno);
    return places;
  }
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owner(list, &::freeifaddrs);
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    constexpr unsigned kNeeded = IFF_UP | IFF_MULTICAST;
    if (entry->ifa_addr == nullptr || (entry->ifa_flags & kNeeded) != kNeeded ||
        (entry->ifa_flags & IFF_LOOPBACK) != 0 || (!only.empty() && only != entry->ifa_name))
      continue;
    Place place;
    place.interface = entry->ifa_name;
    place.index = ::if_nametoindex(entry->ifa_name);
    place.family = entry->ifa_addr->sa_family;
    if (place.family != AF_INET && place.family != AF_INET6) continue;
    std::memcpy(&place.own, entry->ifa_addr, size_of(place.family));
    const auto* own6 = reinterpret_cast<const sockaddr_in6*>(&place.own);
    if (place.family == AF_INET6 && !IN6_IS_ADDR_LINKLOCAL(&own6->sin6_addr)) continue;
    const bool known = std::any_of(places.begin(), places.end(), [&place](const Place& other) {
      return other.index == place.index && other.family == place.family;
    });
    if (!known) places.push_back(place);
  }
  return places;
}

// A group and what is asked there.
struct Question {
  bool is_dns = false;
  std::vector<std::string> messages;
};

class Asker {
 public:
  Asker(const Place& place, const Question& question) : place_(place), question_(&question) {}

  // False: the reason is in errno.
  [[nodiscard]] bool open() {
    socket_.reset(::socket(place_.family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!socket_.is_open()) return false;
    const int hops = question_->is_dns ? 255 : 1;  // RFC 6762; SOAP over UDP
    if (place_.family == AF_INET) {
      ip_mreqn request{};
      request.imr_ifindex = static_cast<int>(place_.index);
      if (!set(IPPROTO_IP, IP_MULTICAST_IF, request) || !set(IPPROTO_IP, IP_MULTICAST_TTL, hops))
        return false;
    } else if (!set(IPPROTO_IPV6, IPV6_MULTICAST_IF, static_cast<int>(place_.index)) ||
               !set(IPPROTO_IPV6, IPV6_MULTICAST_HOPS, hops)) {
      return false;
    }
    return ::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&place_.own),
                  size_of(place_.family)) == 0;
  }

  // False: the reason is in errno.
  [[nodiscard]] bool ask() const {
    sockaddr_storage group{};
    group.ss_family = static_cast<sa_family_t>(place_.family);
    const std::uint16_t port = htons(question_->is_dns ? kMulticastDnsPort : kWsDiscoveryPort);
    if (place_.family == AF_INET) {
      auto* address = reinterpret_cast<sockaddr_in*>(&group);
      address->sin_port = port;
      ::inet_pton(AF_INET, question_->is_dns ? kMulticastDnsGroup4 : kWsDiscoveryGroup4,
                  &address->sin_addr);
    } else {
      auto* address = reinterpret_cast<sockaddr_in6*>(&group);
      address->sin6_port = port;
      address->sin6_scope_id = place_.index;
      ::inet_pton(AF_INET6, question_->is_dns ? kMulticastDnsGroup6 : kWsDiscoveryGroup6,
                  &address->sin6_addr);
    }
    bool sent = true;
    for (const std::string& message : question_->messages) {
      sent = ::sendto(socket_.get(), message.data(), message.size(), 0,
                      reinterpret_cast<const sockaddr*>(&group), size_of(place_.family)) >= 0 &&
             sent;
    }
    return sent;
  }

  // False: no datagram waits.
  [[nodiscard]] bool receive(std::string* datagram, AnswerOrigin* origin) const {
    sockaddr_storage sender{};
    socklen_t size = sizeof sender;
    datagram->resize(kMostDatagramBytes);
    const ssize_t bytes = ::recvfrom(socket_.get(), datagram->data(), datagram->size(), 0,
                                     reinterpret_cast<sockaddr*>(&sender), &size);
    if (bytes < 0) return false;
    datagram->resize(static_cast<std::size_t>(bytes));
    std::array<char, NI_MAXHOST> host{};
    if (::getnameinfo(reinterpret_cast<const sockaddr*>(&sender), size, host.data(), host.size(),
                      nullptr, 0, NI_NUMERICHOST) != 0)
      host.front() = '\0';
    *origin = {host.data(), place_.interface};
    return true;
  }

  [[nodiscard]] int fd() const { return socket_.get(); }
  [[nodiscard]] bool is_dns() const { return question_->is_dns; }
  [[nodiscard]] const std::string& interface() const { return place_.interface; }

 private:
  template <class Value>
  [[nodiscard]] bool set(int level, int name, const Value& value) const {
    return ::setsockopt(socket_.get(), level, name, &value, sizeof value) == 0;
  }

  Place place_;
  const Question* question_;
  FileDescriptor socket_;
};

class Search {
 public:
  NetworkSearchResult run(const NetworkSearchOptions& options);

 private:
  void open(const std::vector<Place>& places);
  void ask();
  void gather(double until_s);
  void take(const std::string& datagram, const AnswerOrigin& origin, bool is_dns);
  void note(const std::string& text) {
    if (result_.notes.size() < kMostNotes &&
        std::find(result_.notes.begin(), result_.notes.end(), text) == result_.notes.end())
      result_.notes.push_back(text);
  }

  Question onvif_;
  Question vapix_;
  std::vector<std::string> message_ids_;
  std::uint16_t dns_id_ = 0;
  std::vector<Asker> askers_;
  FoundDevices found_;
  int answers_ = 0;
  NetworkSearchResult result_;
};

void Search::open(const std::vector<Place>& places) {
  for (const Place& place : places) {
    for (const Question* question : {&onvif_, &vapix_}) {
      Asker asker(place, *question);
      if (asker.open()) {
        askers_.push_back(std::move(asker));
      } else {
        note(place.interface + ": cannot be asked on: " + std::strerror(errno));
      }
    }
    if (std::find(result_.interfaces.begin(), result_.interfaces.end(), place.interface) ==
        result_.interfaces.end())
      result_.interfaces.push_back(place.interface);
  }
}

void Search::ask() {
  for (const Asker& asker : askers_) {
    if (!asker.ask())
      note(asker.interface() + ": a question could not be sent: " + std::strerror(errno));
  }
}

void Search::take(const std::string& datagram, const AnswerOrigin& origin, bool is_dns) {
  std::string error;
  if (is_dns) {
    std::vector<DnsService> services;
    if (parse_dns_sd_answer(datagram, vapix_services(), dns_id_, &services, &error)) {
      for (const DnsService& service : services) found_.add(service, origin);
      return;
    }
  } else {
    std::vector<ProbeMatch> matches;
    if (parse_probe_matches(datagram, message_ids_, &matches, &error)) {
      for (const ProbeMatch& match : matches) found_.add(match, origin);
      return;
    }
  }
  note(shown(origin.address) + " (" + origin.interface + ") sends " + error + "; left out");
}

void Search::gather(double until_s) {
  std::vector<pollfd> waiting;
  for (const Asker& asker : askers_) waiting.push_back({asker.fd(), POLLIN, 0});
  for (double now_s = monotonic_now_s(); now_s < until_s && answers_ < kMostAnswers;
       now_s = monotonic_now_s()) {
    const int ready = ::poll(waiting.data(), waiting.size(),
                             static_cast<int>(std::ceil(1e3 * (until_s - now_s))));
    if (ready <= 0) continue;
    for (std::size_t i = 0; i < waiting.size(); ++i) {
      std::string datagram;
      AnswerOrigin origin;
      while (waiting[i].revents != 0 && answers_ < kMostAnswers &&
             askers_[i].receive(&datagram, &origin)) {
        ++answers_;
        take(datagram, origin, askers_[i].is_dns());
      }
    }
  }
}

NetworkSearchResult Search::run(const NetworkSearchOptions& options) {
  // Some devices want "urn:uuid:", others answer to "uuid:" only.
  message_ids_ = {"uuid:" + new_uuid(), "urn:uuid:" + new_uuid()};
  onvif_.messages = {probe_message(message_ids_[0], true), probe_message(message_ids_[1], false)};
  dns_id_ = static_cast<std::uint16_t>(std::stoul(random_hex(4), nullptr, 16) | 1U);
  vapix_.is_dns = true;
  vapix_.messages = {dns_sd_question(vapix_services(), dns_id_)};

  std::string error;
  open(places(options.interface, &error));
  if (!error.empty()) note(error);
  if (askers_.empty()) {
    note(options.interface.empty()
             ? "no network of this machine carries multicast; is its cable plugged in?"
             : options.interface + ": no interface of this name carries multicast (ip address)");
    return std::move(result_);
  }
  const double begin_s = monotonic_now_s();
  const double end_s = begin_s + options.duration_s;
  for (const double at_s : kQuestionTimes_s) {
    gather(std::min(begin_s + at_s, end_s));
    ask();
  }
  gather(end_s);
  result_.devices = found_.list();
  return std::move(result_);
}

}  // namespace

NetworkSearchResult search_network(const NetworkSearchOptions& options) {
  return Search().run(options);
}

}  // namespace alidade
