#include "test/platform/support/head_kinds.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

namespace alidade {
namespace {

using Link = HeadServer::Link;

const std::vector<Link> kAllLinks = {Link::kSerial, Link::kTcp, Link::kUdp};

HeadVariant pelco_d() {
  PelcoDOptions options;
  options.read_zoom = true;
  HeadVariant head;
  head.name = "PelcoD";
  head.links = kAllLinks;
  head.options = options;
  head.pan_sign = 1;
  head.tilt_sign = -1;
  head.step_deg = 0.01;
  head.abilities.tells_zoom = true;
  head.abilities.shows_changed_bytes = true;
  head.abilities.shows_lost_bytes = true;
  head.abilities.shows_repeats = true;
  return head;
}

HeadVariant visca() {
  ViscaOptions options;
  options.pan_deg_per_step = options.tilt_deg_per_step = 1 / 51.2;
  options.read_zoom = true;
  HeadVariant head;
  head.name = "Visca";
  head.links = {Link::kSerial, Link::kTcp};
  head.options = options;
  head.settings = "pan_deg_per_step: 0.01953125, tilt_deg_per_step: 0.01953125";
  head.pan_sign = 1;
  head.tilt_sign = 1;
  head.step_deg = 1 / 51.2;
  head.abilities.tells_zoom = true;
  head.abilities.shows_lost_bytes = true;
  head.set_up = [](SimulatedHead& simulated, Link link) {
    dynamic_cast<ViscaHead&>(simulated).pan_nibbles = link == Link::kSerial ? 5 : 4;
  };
  return head;
}

// In datagrams the header has to be told: there or not.
HeadVariant visca_without_header() {
  HeadVariant head = visca();
  head.links = {Link::kUdp};
  head.settings = "header: false, " + head.settings;
  return head;
}

HeadVariant visca_with_header() {
  HeadVariant head = visca();
  head.name = "ViscaHeader";
  head.links = {Link::kUdp};
  std::get<ViscaOptions>(head.options).header = true;
  head.settings = "header: true, " + head.settings;
  head.abilities.shows_repeats = true;
  head.set_up = [](SimulatedHead& simulated, Link) {
    dynamic_cast<ViscaHead&>(simulated).header = true;
  };
  return head;
}

HeadVariant ptu() {
  HeadVariant head;
  head.name = "Ptu";
  head.links = kAllLinks;
  head.options = PtuOptions{};
  head.pan_sign = -1;
  head.tilt_sign = 1;
  head.step_deg = PtuHead::kPanArcSeconds / 3600;
  head.abilities.shows_repeats = true;
  return head;
}

HeadVariant terse_ptu() {
  HeadVariant head = ptu();
  head.name = "PtuTerse";
  head.links = {Link::kSerial, Link::kTcp};
  std::get<PtuOptions>(head.options).verbose = false;
  head.settings = "feedback: terse";
  head.abilities.shows_repeats = false;
  return head;
}

// The most usual one first. Each link once at least.
std::vector<HeadVariant> variants_of(HeadType type) {
  switch (type) {
    case HeadType::kPelcoD:
      return {pelco_d()};
    case HeadType::kVisca:
      return {visca(), visca_with_header(), visca_without_header()};
    case HeadType::kPtu:
      return {ptu(), terse_ptu()};
  }
  throw std::logic_error("a head without a row");
}

const std::vector<HeadVariant>& all_variants() {
  static const std::vector<HeadVariant> kVariants = [] {
    std::vector<HeadVariant> all;
    for (const Head& head : kHeads) {
      for (HeadVariant& variant : variants_of(head.type)) {
        variant.type = head.type;
        all.push_back(std::move(variant));
      }
    }
    return all;
  }();
  return kVariants;
}

std::vector<HeadKind> kinds_of(HeadType type, Link link) {
  std::vector<HeadKind> kinds = all_head_kinds();
  kinds.erase(std::remove_if(kinds.begin(), kinds.end(),
                             [&](const HeadKind& kind) {
                               return kind.head->type != type || kind.link != link;
                             }),
              kinds.end());
  if (kinds.empty())
    throw std::logic_error(std::string(head_of(type).key) +
                           ": head_kinds.cpp lacks one of its three links");
  return kinds;
}

Link link_in_turn(std::size_t head) {
  constexpr std::array<Link, 3> kTurn = {Link::kSerial, Link::kUdp, Link::kTcp};
  return kTurn[head % kTurn.size()];
}

}  // namespace

std::string HeadKind::name() const {
  return head->name + (link == Link::kSerial ? "Serial" : link == Link::kTcp ? "Tcp" : "Udp");
}

void PrintTo(const HeadKind& kind, std::ostream* out) { *out << kind.name(); }

std::vector<HeadKind> all_head_kinds() {
  std::vector<HeadKind> kinds;
  for (const HeadVariant& variant : all_variants()) {
    for (const Link link : variant.links) kinds.push_back({&variant, link});
  }
  return kinds;
}

std::vector<HeadKind> head_kinds_over(Link link) {
  std::vector<HeadKind> kinds;
  for (const Head& head : kHeads) kinds.push_back(kinds_of(head.type, link).front());
  return kinds;
}

std::vector<HeadKind> first_kinds_in_turn() {
  std::vector<HeadKind> kinds;
  for (std::size_t i = 0; i < kHeads.size(); ++i) {
    kinds.push_back(kinds_of(kHeads[i].type, link_in_turn(i)).front());
  }
  return kinds;
}

std::vector<HeadKind> last_kinds_in_turn() {
  std::vector<HeadKind> kinds;
  for (std::size_t i = 0; i < kHeads.size(); ++i) {
    kinds.push_back(kinds_of(kHeads[i].type, link_in_turn(i)).back());
  }
  return kinds;
}

std::unique_ptr<SimulatedHead> simulated_head(const HeadKind& kind,
                                              std::function<HeadPosition()> position) {
  const std::string key = head_of(kind.head->type).key;
  for (const HeadModel& model : kHeadModels) {
    if (model.name != key) continue;
    auto head = model.make(std::move(position));
    if (kind.head->set_up) kind.head->set_up(*head, kind.link);
    return head;
  }
  throw std::logic_error("kHeadModels (simulated_head.h) has no " + key);
}

AxisMapping pan_axis_of(const HeadKind& kind) {
  return {head_of(kind.head->type).signs.pan.value_or(kind.head->pan_sign), 0};
}

AxisMapping tilt_axis_of(const HeadKind& kind) {
  return {head_of(kind.head->type).signs.tilt.value_or(kind.head->tilt_sign), 0};
}

std::string settings_of(const HeadKind& kind, const std::string& address) {
  std::string settings = std::string("type: ") + head_of(kind.head->type).key;
  settings += kind.link == Link::kSerial ? ", device: '" + address + "', baud: 115200"
                                         : ", url: '" + address + "'";
  return kind.head->settings.empty() ? settings : settings + ", " + kind.head->settings;
}

std::string signs_of(const HeadKind& kind) {
  const UsualSigns& usual = head_of(kind.head->type).signs;
  std::string signs;
  if (!usual.pan) {
    signs += std::string(", pan_positive: ") + (kind.head->pan_sign > 0 ? "right" : "left");
  }
  if (!usual.tilt) {
    signs += std::string(", tilt_positive: ") + (kind.head->tilt_sign > 0 ? "up" : "down");
  }
  return signs;
}

bool shows(const HeadAbilities& abilities, LineFault fault) {
  return (fault != LineFault::kRepeated || abilities.shows_repeats) &&
         (fault != LineFault::kChangedByte || abilities.shows_changed_bytes) &&
         (fault != LineFault::kLostByte || abilities.shows_lost_bytes);
}

}  // namespace alidade
