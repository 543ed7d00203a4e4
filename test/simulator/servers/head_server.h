#pragma once
// HeadServer: a SimulatedHead at the far end of a pseudo-terminal, a TCP or an UDP port, that can be
// unplugged and plugged in again at the same address, and that has bad days.

#include <atomic>
#include <memory>
#include <random>
#include <string>
#include <thread>

#include "test/simulator/servers/simulated_head.h"
#include "test/support/temporary_directory.h"

namespace alidade {

enum class LineFault {
  kNone,
  kNoise,        // random bytes before the answer
  kLostByte,     // one of the answer
  kChangedByte,  // one of the answer: the sum, if there is one, is wrong
  kMerged,       // an answer is held back, and comes together with the next one
  kRepeated,     // each answer comes twice
  kUnsolicited,  // a line of its own before the answer
  kLate,         // after the master has given up, now and then
  kSilence,
  kBabble  // random bytes in place of answers
};

class HeadServer {
 public:
  enum class Link { kSerial, kTcp, kUdp };

  HeadServer(Link link, std::unique_ptr<SimulatedHead> head);
  ~HeadServer() { unplug(); }
  HeadServer(const HeadServer&) = delete;
  HeadServer& operator=(const HeadServer&) = delete;

  // Path of the device, tcp://host:port or udp://host:port; the same for ever.
  std::string address() const { return address_; }

  void unplug();
  void plug();

  // Of each answer (silence, babble, repeats, lines of its own) or of one in four.
  std::atomic<LineFault> fault{LineFault::kNone};
  std::atomic<double> late_s{0.2};
  std::atomic<double> answer_s{0};   // that the head takes for each answer
  std::atomic<bool> nagle{false};    // TCP keeps small packets back, as where nobody thought of it
  std::atomic<bool> in_two{false};   // each answer comes in two pieces: of UDP, two datagrams
  std::atomic<double> between_s{0};  // these two
  std::atomic<int> queries{0};       // that the head took
  std::atomic<int> faults{0};        // that were done

 private:
  void open_serial();
  void open_socket();
  void serve();
  std::string receive();
  void answer(const std::string& reply);
  void send(const std::string& bytes);
  void send_piece(const std::string& bytes);
  std::string noise();
  bool wait(int fd) const;
  bool is_pulled(double seconds) const;

  Link link_;
  std::unique_ptr<SimulatedHead> head_;
  std::mt19937 random_{5};
  TemporaryDirectory directory_;
  std::string address_;
  int port_ = 0;
  int listener_ = -1;
  int line_ = -1;       // master of the pseudo-terminal, connection, or UDP socket
  int other_end_ = -1;  // keeps the pseudo-terminal alive while no source has it open
  int wake_ = -1;
  std::string held_;
  std::string master_;  // the address that datagrams come from
  std::thread thread_;
};

}  // namespace alidade
