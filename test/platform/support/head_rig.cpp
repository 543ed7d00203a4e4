#include "test/platform/support/head_rig.h"

#include "platform/pan_tilt/pelco_d_protocol.h"
#include "platform/pan_tilt/ptu_protocol.h"
#include "platform/pan_tilt/visca_protocol.h"
#include "test/platform/support/eventually.h"

namespace alidade {
namespace {

HeadServer::Link link_of(HeadKind kind) {
  switch (kind) {
    case HeadKind::kPelcoDTcp:
    case HeadKind::kViscaTcp:
    case HeadKind::kPtuTcp:
    case HeadKind::kPtuTerseTcp:
      return HeadServer::Link::kTcp;
    case HeadKind::kPelcoDUdp:
    case HeadKind::kViscaUdp:
    case HeadKind::kViscaUdpHeader:
    case HeadKind::kPtuUdp:
      return HeadServer::Link::kUdp;
    default:
      return HeadServer::Link::kSerial;
  }
}

std::unique_ptr<SimulatedHead> head_of(HeadKind kind, std::function<HeadPosition()> position) {
  if (!position) {
    position = [] { return HeadPosition{-123.45, 30.5, 0x1234}; };
  }
  if (is_pelco_d(kind)) {
    return std::make_unique<PelcoDHead>(std::move(position));
  }
  if (is_ptu(kind)) {
    return std::make_unique<PtuHead>(std::move(position));
  }
  auto head = std::make_unique<ViscaHead>(std::move(position));
  head->header = kind == HeadKind::kViscaUdpHeader;
  head->pan_nibbles = kind == HeadKind::kViscaSerial ? 5 : 4;
  return head;
}

}  // namespace

const char* to_string(HeadKind kind) {
  switch (kind) {
    case HeadKind::kPelcoDSerial:
      return "PelcoDSerial";
    case HeadKind::kPelcoDTcp:
      return "PelcoDTcp";
    case HeadKind::kPelcoDUdp:
      return "PelcoDUdp";
    case HeadKind::kViscaSerial:
      return "ViscaSerial";
    case HeadKind::kViscaTcp:
      return "ViscaTcp";
    case HeadKind::kViscaUdp:
      return "ViscaUdp";
    case HeadKind::kViscaUdpHeader:
      return "ViscaUdpHeader";
    case HeadKind::kPtuSerial:
      return "PtuSerial";
    case HeadKind::kPtuTcp:
      return "PtuTcp";
    case HeadKind::kPtuUdp:
      return "PtuUdp";
    case HeadKind::kPtuTerseSerial:
      return "PtuTerseSerial";
    case HeadKind::kPtuTerseTcp:
      return "PtuTerseTcp";
  }
  return "";
}

bool is_pelco_d(HeadKind kind) {
  return kind == HeadKind::kPelcoDSerial || kind == HeadKind::kPelcoDTcp ||
         kind == HeadKind::kPelcoDUdp;
}

bool is_ptu(HeadKind kind) {
  return kind == HeadKind::kPtuSerial || kind == HeadKind::kPtuTcp || kind == HeadKind::kPtuUdp ||
         is_terse(kind);
}

bool is_terse(HeadKind kind) {
  return kind == HeadKind::kPtuTerseSerial || kind == HeadKind::kPtuTerseTcp;
}

HeadRig::HeadRig(HeadKind kind, std::function<HeadPosition()> position)
    : kind_(kind),
      server_(std::make_unique<HeadServer>(link_of(kind), head_of(kind, std::move(position)))) {}

QuerySourceOptions HeadRig::options() const {
  QuerySourceOptions options;
  options.link = {server_->address(), 115200};
  options.rate_hz = 1000;
  options.timeout_s = 4 * kDeadline_s;
  options.max_backoff_s = 0.01;
  options.tilt.sign = is_pelco_d(kind_) ? -1 : 1;
  options.pan.sign = is_ptu(kind_) ? -1 : 1;
  return options;
}

std::unique_ptr<QueryProtocol> HeadRig::protocol() const {
  if (is_pelco_d(kind_)) {
    PelcoDOptions options;
    options.read_zoom = true;
    return std::make_unique<PelcoDProtocol>(options);
  }
  if (is_ptu(kind_)) {
    PtuOptions options;
    options.verbose = !is_terse(kind_);
    return std::make_unique<PtuProtocol>(options);
  }
  ViscaOptions options;
  options.header = kind_ == HeadKind::kViscaUdpHeader;
  options.pan_deg_per_step = 1 / 51.2;
  options.tilt_deg_per_step = 1 / 51.2;
  options.read_zoom = true;
  return std::make_unique<ViscaProtocol>(options);
}

double HeadRig::quantum_deg() const {
  return is_pelco_d(kind_) ? 0.01 : is_ptu(kind_) ? PtuHead::kPanArcSeconds / 3600 : 1 / 51.2;
}

}  // namespace alidade
