#pragma once
// The heads of heads.h as tests meet them, each as it comes and with what may be unusual about it, over each link: the
// simulated device, how it is configured, and what of a bad line its answers show. From here follow the tests of
// QuerySource, of the configuration and of `alidade check`, and the soak; what a row says is held against the simulated
// device by heads_test.cpp. No I/O: head_rig.h puts a kind on its line.

#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "platform/pan_tilt/axis_mapping.h"
#include "platform/pan_tilt/heads.h"
#include "test/simulator/servers/head_server.h"

namespace alidade {

// What a receiver can and cannot do with the answers of a head.
struct HeadAbilities {
  bool tells_zoom = false;
  bool shows_changed_bytes = false;  // by a check sum
  bool shows_lost_bytes = false;     // by a sum, or a length
  bool shows_repeats = false;  // an answer that comes twice is not taken for that to the next query
};

struct HeadVariant {
  HeadType type{};   // that of its head in kHeads
  std::string name;  // of test cases, before the link's
  std::vector<HeadServer::Link> links;
  HeadOptions options;   // of its protocol; with the zoom, if it tells it
  std::string settings;  // the same without the zoom, as keys of the configuration: "a: 1, b: 2"
  // Which way the simulated head counts: 1 to the right and up, -1 to the left and down.
  double pan_sign = 0;
  double tilt_sign = 0;
  double step_deg = 0;  // of the coarser axis
  HeadAbilities abilities;
  std::function<void(SimulatedHead&, HeadServer::Link)> set_up;  // none: as it comes
};

struct HeadKind {
  const HeadVariant* head;  // lives for ever
  HeadServer::Link link;

  [[nodiscard]] std::string name() const;  // "ViscaHeaderUdp"
};
void PrintTo(const HeadKind& kind, std::ostream* out);

std::vector<HeadKind> all_head_kinds();
// Of each head the first of its kinds over this link.
std::vector<HeadKind> head_kinds_over(HeadServer::Link link);
// One kind of each head, the first over serial line, the next over UDP, then TCP, in turn: the first of its variants
// that has the link, or the last.
std::vector<HeadKind> first_kinds_in_turn();
std::vector<HeadKind> last_kinds_in_turn();

constexpr HeadPosition kPositionOfHeads{-123.45, 30.5, 0x1234};

// The one of kHeadModels with the head's key. Throws std::logic_error where there is none.
std::unique_ptr<SimulatedHead> simulated_head(const HeadKind& kind,
                                              std::function<HeadPosition()> position);

// As the protocol defines the signs, or as the simulated head counts where it does not.
AxisMapping pan_axis_of(const HeadKind& kind);
AxisMapping tilt_axis_of(const HeadKind& kind);

// Section pan_tilt for a head at this address, but for the signs; and these, where the configuration has to tell them
// (else empty).
std::string settings_of(const HeadKind& kind, const std::string& address);
std::string signs_of(const HeadKind& kind);

// Whether a line with this fault costs answers only.
bool shows(const HeadAbilities& abilities, LineFault fault);

}  // namespace alidade
