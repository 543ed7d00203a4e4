#pragma once
// HeadRig: a simulated head on its line, and sources that ask it, for each protocol and link.

#include <array>
#include <memory>
#include <mutex>
#include <string>

#include "platform/pan_tilt/heads.h"
#include "platform/pan_tilt/query_source.h"
#include "test/simulator/servers/head_server.h"

namespace alidade {

enum class HeadKind {
  kPelcoDSerial,
  kPelcoDTcp,
  kPelcoDUdp,
  kViscaSerial,
  kViscaTcp,
  kViscaUdp,
  kViscaUdpHeader,
  kPtuSerial,
  kPtuTcp,
  kPtuUdp,
  kPtuTerseSerial,
  kPtuTerseTcp
};

// What a kind is: a head, its link, and the one thing that may be unusual about it.
struct HeadKindRow {
  HeadKind kind;
  const char* name;
  HeadType type;
  HeadServer::Link link;
  bool header = false;  // VISCA's, of datagrams
  bool terse = false;   // PTU
};

// Each head over each link at least once (heads_test.cpp).
inline constexpr std::array<HeadKindRow, 12> kHeadKinds = {{
    {HeadKind::kPelcoDSerial, "PelcoDSerial", HeadType::kPelcoD, HeadServer::Link::kSerial},
    {HeadKind::kPelcoDTcp, "PelcoDTcp", HeadType::kPelcoD, HeadServer::Link::kTcp},
    {HeadKind::kPelcoDUdp, "PelcoDUdp", HeadType::kPelcoD, HeadServer::Link::kUdp},
    {HeadKind::kViscaSerial, "ViscaSerial", HeadType::kVisca, HeadServer::Link::kSerial},
    {HeadKind::kViscaTcp, "ViscaTcp", HeadType::kVisca, HeadServer::Link::kTcp},
    {HeadKind::kViscaUdp, "ViscaUdp", HeadType::kVisca, HeadServer::Link::kUdp},
    {HeadKind::kViscaUdpHeader, "ViscaUdpHeader", HeadType::kVisca, HeadServer::Link::kUdp, true},
    {HeadKind::kPtuSerial, "PtuSerial", HeadType::kPtu, HeadServer::Link::kSerial},
    {HeadKind::kPtuTcp, "PtuTcp", HeadType::kPtu, HeadServer::Link::kTcp},
    {HeadKind::kPtuUdp, "PtuUdp", HeadType::kPtu, HeadServer::Link::kUdp},
    {HeadKind::kPtuTerseSerial, "PtuTerseSerial", HeadType::kPtu, HeadServer::Link::kSerial, false,
     true},
    {HeadKind::kPtuTerseTcp, "PtuTerseTcp", HeadType::kPtu, HeadServer::Link::kTcp, false, true},
}};

const HeadKindRow& row_of(HeadKind kind);
const char* to_string(HeadKind kind);
std::array<HeadKind, kHeadKinds.size()> all_head_kinds();

// What a receiver can and cannot do with the answers of a kind.
struct HeadAbilities {
  bool tells_zoom;
  bool shows_changed_bytes;  // by a check sum
  bool shows_lost_bytes;     // by a sum, or a length
  bool shows_repeats;        // an answer that comes twice is not taken for that to the next query
};
HeadAbilities abilities_of(HeadKind kind);

class HeadRig {
 public:
  explicit HeadRig(HeadKind kind, std::function<HeadPosition()> position = {});

  // Times out so slowly that a busy machine is no fault, asks as fast as the line can.
  QuerySourceOptions options() const;
  std::unique_ptr<QueryProtocol> protocol() const { return make_protocol(protocol_options()); }
  std::unique_ptr<QuerySource> open() const { return open(options()); }
  std::unique_ptr<QuerySource> open(const QuerySourceOptions& options) const {
    return std::make_unique<QuerySource>(protocol(), options);
  }

  // A position as far from the true one as rounding to steps allows; degrees.
  double step_deg() const;

  HeadServer& server() { return *server_; }

 private:
  HeadOptions protocol_options() const;

  HeadKind kind_;
  std::unique_ptr<HeadServer> server_;
};

}  // namespace alidade
