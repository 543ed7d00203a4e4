#pragma once
// Fairness among the addresses that clients come from: what there is for all is shared alike by those that want some.
// Network thread.

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <map>
#include <vector>

namespace alidade {

// Whom a client is counted for: its IPv4 address, or the /64 of an IPv6 one, all of which one machine may use.
using HttpAddress = boost::asio::ip::address_v6;
[[nodiscard]] HttpAddress http_address(const boost::asio::ip::address& peer);

// Requests a second of all addresses together. Each that asked within the last second has the same share of them, at
// most a second's worth at once, and one at least; beyond it, what others leave, while more than half of a second's worth is
// left. Of more addresses than are kept apart the rest has one share.
class FairRate {
 public:
  explicit FairRate(double per_s);
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
  Account all_;  // together
  std::map<HttpAddress, Account> accounts_;
};

// Addresses that did something within the last ten minutes. Of more than are kept the one that did it longest ago goes.
class RecentAddresses {
 public:
  void add(const HttpAddress& address, double now_s);
  [[nodiscard]] bool has(const HttpAddress& address, double now_s) const;

  static constexpr std::size_t kMost = 1024;
  static constexpr double kRecentS = 600;

 private:
  std::map<HttpAddress, double> last_s_;
};

// So many places, held by the address and in the order in which they were taken. Nothing is allocated after construction.
template <typename Holder>
class FairPlaces {
 public:
  explicit FairPlaces(int most) : most_(static_cast<std::size_t>(std::max(1, most))) {
    places_.reserve(most_);
    shares_.reserve(most_);
  }

  [[nodiscard]] bool full() const { return places_.size() >= most_; }

  // Of the address that holds the most, of several the one with the oldest. Null: there is none.
  [[nodiscard]] Holder* oldest_of_the_greediest() const {
    const std::size_t most = largest_share();
    const auto found = std::find_if(places_.begin(), places_.end(), [&](const Place& place) {
      return held_by(place.address) == most;
    });
    return found == places_.end() ? nullptr : found->holder;
  }

  // Whose leaving would leave nobody worse off than the newcomer's address: the newest of the address that
  // holds the most, if that is at least two more. Null: there is none.
  [[nodiscard]] Holder* one_too_many(const HttpAddress& newcomer) const {
    const std::size_t most = largest_share();
    if (most < held_by(newcomer) + 2) return nullptr;
    const auto found = std::find_if(places_.rbegin(), places_.rend(), [&](const Place& place) {
      return held_by(place.address) == most;
    });
    return found->holder;
  }

  // Only where it is not full.
  void take(Holder* holder, const HttpAddress& address) {
    places_.push_back({holder, address});
    const auto share = share_of(address);
    if (share == shares_.end())
      shares_.push_back({address, 1});
    else
      ++share->places;
  }

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
  std::vector<Place> places_;  // the oldest first
  std::vector<Share> shares_;
};

}  // namespace alidade
