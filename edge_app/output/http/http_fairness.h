#pragma once
// Fairness among the addresses of clients: a resource is shared equally by the addresses that want
// some of it. For the network thread.

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <map>
#include <vector>

namespace alidade {

// The address under which a client is counted: its IPv4 address, or the /64 of its IPv6 address, as
// one machine may use all of a /64.
using HttpAddress = boost::asio::ip::address_v6;
[[nodiscard]] HttpAddress http_address(const boost::asio::ip::address& peer);

// Limits the requests a second of all addresses together. All addresses that asked within the last
// second have equal shares. An address may use its share of one second in a burst, or one request
// if the share is less. It may use more while others leave more than half of a second's requests.
// Beyond kMaxAddresses, all further addresses have one share together. The first request of an
// address with a share of its own is always allowed, so many new addresses at the same time may
// exceed per_s.
class FairRate {
 public:
  // per_s: requests a second, more than 0.
  explicit FairRate(double per_s);
  // Counts one request. False: beyond the limit, to be refused. now_s: s, monotonic, as below.
  [[nodiscard]] bool take(const HttpAddress& address, double now_s);
  [[nodiscard]] std::size_t addresses() const { return accounts_.size(); }

  static constexpr std::size_t kMaxAddresses = 1024;

 private:
  struct Account {
    double left = 0;
    double last_s = 0;
  };

  void forget_the_idle(double now_s);

  const double per_s_;
  double swept_s_ = 0;
  Account all_;  // of all addresses together
  std::map<HttpAddress, Account> accounts_;
};

// The addresses that did something within the last ten minutes, at most kMost. Beyond kMost the
// address whose action is longest ago is forgotten.
class RecentAddresses {
 public:
  void add(const HttpAddress& address, double now_s);
  // True if the address was added within kRecentS and is not forgotten.
  [[nodiscard]] bool has(const HttpAddress& address, double now_s) const;

  static constexpr std::size_t kMost = 1024;
  static constexpr double kRecentS = 600;

 private:
  std::map<HttpAddress, double> last_s_;
};

// A limited number of places, in the order in which they were taken, each with its holder and the
// address that holds it. Does not allocate after construction.
template <typename Holder>
class FairPlaces {
 public:
  // most: number of places; less than 1 is taken for 1.
  explicit FairPlaces(int most) : most_(static_cast<std::size_t>(std::max(1, most))) {
    places_.reserve(most_);
    shares_.reserve(most_);
  }

  [[nodiscard]] bool full() const { return places_.size() >= most_; }

  // The holder of the oldest place of the address that holds the most places. If several addresses
  // hold equally many, the oldest place of all of them. Null: no place is taken.
  [[nodiscard]] Holder* oldest_of_the_greediest() const {
    const std::size_t most = largest_share();
    const auto found = std::find_if(places_.begin(), places_.end(), [&](const Place& place) {
      return held_by(place.address) == most;
    });
    return found == places_.end() ? nullptr : found->holder;
  }

  // The holder of the place that may be taken away for the newcomer: the newest place of the
  // address that holds the most, if that address holds at least two more than the newcomer's. So
  // the address that loses a place still has as many as the newcomer then has, or more. Null: there
  // is no such place.
  [[nodiscard]] Holder* one_too_many(const HttpAddress& newcomer) const {
    const std::size_t most = largest_share();
    if (most < held_by(newcomer) + 2) return nullptr;
    const auto found = std::find_if(places_.rbegin(), places_.rend(), [&](const Place& place) {
      return held_by(place.address) == most;
    });
    return found->holder;
  }

  // Only if not full().
  void take(Holder* holder, const HttpAddress& address) {
    places_.push_back({holder, address});
    const auto share = share_of(address);
    if (share == shares_.end())
      shares_.push_back({address, 1});
    else
      ++share->places;
  }

  // Does nothing if the holder has no place.
  void leave(const Holder* holder) {
    const auto found = std::find_if(places_.begin(), places_.end(),
                                    [&](const Place& place) { return place.holder == holder; });
    if (found == places_.end()) return;
    const auto share = share_of(found->address);
    if (--share->places == 0) shares_.erase(share);
    places_.erase(found);
  }

  template <typename Visit>
  void for_each(Visit visit) const {
    for (const Place& place : places_) visit(place.holder);
  }

  [[nodiscard]] std::size_t held_by(const HttpAddress& address) const {
    for (const Share& share : shares_) {
      if (share.address == address) return share.places;
    }
    return 0;
  }

 private:
  struct Place {
    Holder* holder;
    HttpAddress address;
  };
  struct Share {
    HttpAddress address;
    std::size_t places;
  };

  [[nodiscard]] auto share_of(const HttpAddress& address) {
    return std::find_if(shares_.begin(), shares_.end(),
                        [&](const Share& share) { return share.address == address; });
  }
  [[nodiscard]] std::size_t largest_share() const {
    std::size_t most = 0;
    for (const Share& share : shares_) most = std::max(most, share.places);
    return most;
  }

  const std::size_t most_;
  std::vector<Place> places_;  // oldest first
  std::vector<Share> shares_;
};

}  // namespace alidade
