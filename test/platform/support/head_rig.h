#pragma once
// HeadRig: a simulated head on its line, and sources that ask it, for each protocol and link.

#include <memory>
#include <mutex>
#include <string>

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

const char* to_string(HeadKind kind);
bool is_pelco_d(HeadKind kind);
bool is_ptu(HeadKind kind);
bool is_terse(HeadKind kind);

class HeadRig {
 public:
  explicit HeadRig(HeadKind kind, std::function<HeadPosition()> position = {});

  // Times out so slowly that a busy machine is no fault, asks as fast as the line can.
  QuerySourceOptions options() const;
  std::unique_ptr<QueryProtocol> protocol() const;
  std::unique_ptr<QuerySource> open() const { return open(options()); }
  std::unique_ptr<QuerySource> open(const QuerySourceOptions& options) const {
    return std::make_unique<QuerySource>(protocol(), options);
  }

  // A position as far from the true one as rounding to steps allows; degrees.
  double quantum_deg() const;

  HeadServer& server() { return *server_; }

 private:
  HeadKind kind_;
  std::unique_ptr<HeadServer> server_;
};

}  // namespace alidade
