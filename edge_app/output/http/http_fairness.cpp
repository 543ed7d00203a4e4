#include "edge_app/output/http/http_fairness.h"

#include <iterator>

namespace alidade {
namespace {

constexpr double kForgottenS = 1;  // without a request; after that an account is full again
constexpr double kSweepS = 0.1;

}  // namespace

HttpAddress http_address(const boost::asio::ip::address& peer) {
  namespace ip = boost::asio::ip;
  if (peer.is_v4()) return ip::make_address_v6(ip::v4_mapped, peer.to_v4());
  if (peer.to_v6().is_v4_mapped()) return peer.to_v6();
  HttpAddress::bytes_type bytes = peer.to_v6().to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), static_cast<unsigned char>(0));
  return HttpAddress(bytes);
}

FairRate::FairRate(double per_s) : per_s_(per_s) { all_.left = per_s; }

bool FairRate::take(const HttpAddress& address, double now_s) {
  forget_the_idle(now_s);
  const bool apart = accounts_.count(address) > 0 || accounts_.size() < kMaxAddresses;
  const auto [place, is_new] =
      accounts_.try_emplace(apart ? address : HttpAddress::any(), Account{1e9, now_s});
  const double share_per_s = per_s_ / static_cast<double>(accounts_.size());
  Account& account = place->second;
  account.left = std::min(std::max(1.0, share_per_s),
                          account.left + share_per_s * std::max(0.0, now_s - account.last_s));
  account.last_s = now_s;
  all_.left = std::min(per_s_, all_.left + per_s_ * std::max(0.0, now_s - all_.last_s));
  all_.last_s = now_s;
  const bool is_own = account.left >= 1;
  if (!is_own && all_.left - 1 < per_s_ / 2) return false;
  if (is_own) account.left -= 1;
  all_.left = std::max(0.0, all_.left - 1);
  return true;
}

void RecentAddresses::add(const HttpAddress& address, double now_s) {
  last_s_[address] = now_s;
  if (last_s_.size() <= kMost) return;
  last_s_.erase(std::min_element(last_s_.begin(), last_s_.end(),
                                 [](const auto& a, const auto& b) { return a.second < b.second; }));
}

bool RecentAddresses::has(const HttpAddress& address, double now_s) const {
  const auto found = last_s_.find(address);
  return found != last_s_.end() && now_s <= found->second + kRecentS;
}

void FairRate::forget_the_idle(double now_s) {
  if (now_s < swept_s_ + kSweepS) return;
  swept_s_ = now_s;
  for (auto one = accounts_.begin(); one != accounts_.end();)
    one = now_s > one->second.last_s + kForgottenS ? accounts_.erase(one) : std::next(one);
}

}  // namespace alidade
