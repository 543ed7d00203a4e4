#pragma once
// SimulatedHead: the device's side of the heads on a line, written from the protocols' manuals and
// without the code that it tests: bytes of a master in, bytes of the head out. No I/O: head_server.h
// puts it on a line.

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace alidade {

struct HeadPosition {
  double pan_deg = 0;   // to the right
  double tilt_deg = 0;  // up
  int zoom = 0;         // as the protocol counts
};

class SimulatedHead {
 public:
  explicit SimulatedHead(std::function<HeadPosition()> position) : position_(std::move(position)) {}
  virtual ~SimulatedHead() = default;

  virtual void power_on() { received_.clear(); }
  // Answers to all queries that are complete with these bytes, with the present position. No answer is
  // empty.
  virtual std::vector<std::string> take(const std::string& bytes) = 0;
  // Something that nobody asked for.
  virtual std::string unsolicited() = 0;

 protected:
  std::function<HeadPosition()> position_;
  std::string received_;
};

struct PelcoDHead : SimulatedHead {
  explicit PelcoDHead(std::function<HeadPosition()> position, int its_address = 1)
      : SimulatedHead(std::move(position)), address(its_address) {}
  std::vector<std::string> take(const std::string& bytes) override;
  std::string unsolicited() override;
  int address;
  bool knows_tilt = true;  // a query that a head does not know gets no answer
  bool knows_zoom = true;
};

struct ViscaHead : SimulatedHead {
  using SimulatedHead::SimulatedHead;
  void power_on() override;
  std::vector<std::string> take(const std::string& bytes) override;
  std::string unsolicited() override;

  double steps_per_deg = 51.2;
  int pan_nibbles = 4;
  int tilt_nibbles = 4;
  bool header = false;  // of the datagrams
  // The sequence number of an answer, as devices other than Sony's have it.
  enum class Numbers { kOfTheQuery, kOne, kZero, kOneLess, kOneMore, kTurnedRound, kNoHeader };
  Numbers numbers = Numbers::kOfTheQuery;
  // Queries with a higher sequence number get no answer; a number may come again. 0: all are answered.
  unsigned highest_number = 0;
  // Errors about a sequence number have the payload type of a control reply (0201), not of a control
  // command (0200).
  bool error_is_reply = false;
  std::atomic<bool> forgets_numbering{false};  // until it is begun anew
  int error = 0;                               // code that answers every query; 0: none

 private:
  std::string reply_to(const std::string& query) const;
  std::string header_of(const std::string& sequence, long length) const;
  unsigned last_sequence_ = 0;
};

struct PtuHead : SimulatedHead {
  using SimulatedHead::SimulatedHead;
  void power_on() override;  // verbose, with echo
  std::vector<std::string> take(const std::string& bytes) override;
  std::string unsolicited() override { return "!P\r\n"; }

  // Counts to the left and up.
  static constexpr double kPanArcSeconds = 185.1428;
  static constexpr double kTiltArcSeconds = 92.5714;

 private:
  std::string reply_to(const std::string& command);
  bool terse_ = false;
  bool echo_ = true;
};

// A head as it comes out of its box.
struct HeadModel {
  const char* name;  // that configurations and command lines give it: pan_tilt.type
  std::unique_ptr<SimulatedHead> (*make)(std::function<HeadPosition()> position);
  int tele_zoom;  // what it tells at the tele end, 0 at the wide end; 0: it knows of no zoom
};

template <class Head>
std::unique_ptr<SimulatedHead> make_head(std::function<HeadPosition()> position) {
  return std::make_unique<Head>(std::move(position));
}

inline constexpr std::array kHeadModels = {HeadModel{"pelco_d", make_head<PelcoDHead>, 0xFFFF},
                                           HeadModel{"visca", make_head<ViscaHead>, 0x4000},
                                           HeadModel{"ptu", make_head<PtuHead>, 0}};

}  // namespace alidade
