#pragma once
// A head's side of a conversation, made of an input: after each query some bytes come, in pieces, until
// the protocol finds an answer or gives up. Each piece begins with a byte that tells its length (low
// seven bits) and whether it is the last before the query is given up (high bit).

#include "platform/pan_tilt/query_protocol.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {

inline void require_sound(const Answer& answer, std::string_view bytes) {
  FUZZ_REQUIRE(answer.kind == Answer::Kind::kNone || answer.begin < bytes.size());
  FUZZ_REQUIRE(answer.problem.empty() || is_one_line(answer.problem));
  FUZZ_REQUIRE(answer.problem.size() < longest_error(120));
  switch (answer.kind) {
    case Answer::Kind::kNone:
    case Answer::Kind::kDone:
      return;
    case Answer::Kind::kRefused:
      FUZZ_REQUIRE(!answer.problem.empty());
      return;
    case Answer::Kind::kPan:
      FUZZ_REQUIRE(is_within_a_turn(answer.pan_deg));
      return;
    case Answer::Kind::kTilt:
      FUZZ_REQUIRE(is_within_a_turn(answer.tilt_deg));
      return;
    case Answer::Kind::kPanTilt:
      FUZZ_REQUIRE(is_within_a_turn(answer.pan_deg) && is_within_a_turn(answer.tilt_deg));
      return;
    case Answer::Kind::kZoom:
      FUZZ_REQUIRE(answer.zoom >= 0 && answer.zoom <= 65535);
      return;
  }
  FUZZ_REQUIRE(answer.kind == Answer::Kind::kNone);  // no other is left
}

// Ends with the input, or after so many pieces: each costs a search through all that has come.
inline void converse(QueryProtocol* protocol, FuzzInput* input) {
  int pieces = 32;
  protocol->restart();
  while (!input->empty() && pieces > 0) {
    const Query query = protocol->next();
    FUZZ_REQUIRE(!query.bytes.empty());
    std::string come;
    for (bool waiting = true; waiting;) {
      const unsigned piece = input->byte();
      --pieces;
      come += input->bytes(piece & 0x7FU);
      come.erase(0, come.size() - std::min(come.size(), kMaxAnswer));
      const Answer answer = protocol->find(come);
      require_sound(answer, come);
      if (answer.kind != Answer::Kind::kNone) {
        waiting = false;
      } else if ((piece & 0x80U) != 0 || input->empty() || pieces <= 0) {
        static_cast<void>(protocol->give_up());
        waiting = false;
      }
    }
  }
}

}  // namespace alidade
