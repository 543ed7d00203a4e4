#include "test/platform/support/head_rig.h"

#include <algorithm>

#include "test/platform/support/eventually.h"

namespace alidade {
namespace {

constexpr double kViscaStep_deg = 1 / 51.2;

std::unique_ptr<SimulatedHead> visca_head(const HeadKindRow& row,
                                          std::function<HeadPosition()> position) {
  auto head = std::make_unique<ViscaHead>(std::move(position));
  head->header = row.header;
  head->pan_nibbles = row.link == HeadServer::Link::kSerial ? 5 : 4;
  return head;
}

std::unique_ptr<SimulatedHead> simulated_head(HeadKind kind,
                                              std::function<HeadPosition()> position) {
  if (!position) {
    position = [] { return HeadPosition{-123.45, 30.5, 0x1234}; };
  }
  const HeadKindRow& row = row_of(kind);
  switch (row.type) {
    case HeadType::kPelcoD:
      return std::make_unique<PelcoDHead>(std::move(position));
    case HeadType::kVisca:
      return visca_head(row, std::move(position));
    case HeadType::kPtu:
      break;
  }
  return std::make_unique<PtuHead>(std::move(position));
}

// Which way the simulated head counts.
UsualSigns signs_of(HeadType type) {
  switch (type) {
    case HeadType::kPelcoD:
      return {1, -1};
    case HeadType::kVisca:
      return {1, 1};
    case HeadType::kPtu:
      break;
  }
  return {-1, 1};
}

}  // namespace

const HeadKindRow& row_of(HeadKind kind) { return kHeadKinds[static_cast<std::size_t>(kind)]; }

const char* to_string(HeadKind kind) { return row_of(kind).name; }

std::array<HeadKind, kHeadKinds.size()> all_head_kinds() {
  std::array<HeadKind, kHeadKinds.size()> kinds{};
  std::transform(kHeadKinds.begin(), kHeadKinds.end(), kinds.begin(),
                 [](const HeadKindRow& row) { return row.kind; });
  return kinds;
}

HeadAbilities abilities_of(HeadKind kind) {
  const HeadKindRow& row = row_of(kind);
  switch (row.type) {
    case HeadType::kPelcoD:
      return {true, true, true, true};
    case HeadType::kVisca:
      return {true, false, true, true};
    case HeadType::kPtu:
      break;
  }
  return {false, false, false, !row.terse};
}

HeadRig::HeadRig(HeadKind kind, std::function<HeadPosition()> position)
    : kind_(kind),
      server_(std::make_unique<HeadServer>(row_of(kind).link,
                                           simulated_head(kind, std::move(position)))) {}

QuerySourceOptions HeadRig::options() const {
  const UsualSigns signs = signs_of(row_of(kind_).type);
  QuerySourceOptions options;
  options.link = {server_->address(), 115200};
  options.rate_hz = 1000;
  options.timeout_s = 4 * kDeadline_s;
  options.max_backoff_s = 0.01;
  options.pan.sign = *signs.pan;
  options.tilt.sign = *signs.tilt;
  return options;
}

HeadOptions HeadRig::protocol_options() const {
  const HeadKindRow& row = row_of(kind_);
  switch (row.type) {
    case HeadType::kPelcoD: {
      PelcoDOptions options;
      options.read_zoom = true;
      return options;
    }
    case HeadType::kVisca: {
      ViscaOptions options;
      options.header = row.header;
      options.pan_deg_per_step = kViscaStep_deg;
      options.tilt_deg_per_step = kViscaStep_deg;
      options.read_zoom = true;
      return options;
    }
    case HeadType::kPtu:
      break;
  }
  PtuOptions options;
  options.verbose = !row.terse;
  return options;
}

double HeadRig::step_deg() const {
  switch (row_of(kind_).type) {
    case HeadType::kPelcoD:
      return 0.01;
    case HeadType::kVisca:
      return kViscaStep_deg;
    case HeadType::kPtu:
      break;
  }
  return PtuHead::kPanArcSeconds / 3600;
}

}  // namespace alidade
