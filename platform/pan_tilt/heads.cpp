#include "platform/pan_tilt/heads.h"

namespace alidade {
namespace {

std::unique_ptr<QueryProtocol> protocol_of(const PelcoDOptions& options) {
  return std::make_unique<PelcoDProtocol>(options);
}
std::unique_ptr<QueryProtocol> protocol_of(const ViscaOptions& options) {
  return std::make_unique<ViscaProtocol>(options);
}
std::unique_ptr<QueryProtocol> protocol_of(const PtuOptions& options) {
  return std::make_unique<PtuProtocol>(options);
}

}  // namespace

std::unique_ptr<QueryProtocol> make_protocol(const HeadOptions& options) {
  return std::visit([](const auto& of_head) { return protocol_of(of_head); }, options);
}

}  // namespace alidade
