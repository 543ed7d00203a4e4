#include "edge_app/commands/stop_signals.h"

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "platform/system/clock.h"

namespace alidade {

StopSignals::StopSignals() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  descriptor_ = ::signalfd(-1, &signals_, SFD_CLOEXEC);
  if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "signalfd");
}

StopSignals::~StopSignals() {
  ::close(descriptor_);
  pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
}

StopSignals::Event StopSignals::wait(int descriptor, double timeout_s) {
  constexpr double kLongestPoll_s = 3600;  // poll() counts milliseconds in an int
  const double deadline_s = monotonic_now_s() + timeout_s;
  while (true) {
    pollfd descriptors[] = {{descriptor_, POLLIN, 0}, {descriptor, POLLIN, 0}};
    const double left_s = std::clamp(deadline_s - monotonic_now_s(), 0.0, kLongestPoll_s);
    const int ready = ::poll(descriptors, 2, static_cast<int>(std::ceil(left_s * 1e3)));
    if (ready < 0 && errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "poll");
    }
    if (ready > 0 && descriptors[0].revents != 0) {
      signalfd_siginfo information{};
      if (::read(descriptor_, &information, sizeof information) < 0) {
        throw std::system_error(errno, std::generic_category(), "signalfd");
      }
      pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
      seen_ = information.ssi_signo == SIGINT ? "SIGINT" : "SIGTERM";
      return Event::kSignal;
    }
    if (ready > 0) return Event::kDescriptor;
    if (monotonic_now_s() >= deadline_s) return Event::kTimeout;
  }
}

}  // namespace alidade
