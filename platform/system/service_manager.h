#pragma once
// ServiceManager: reports to systemd (sd_notify(3), Type=notify) that this process has started,
// what it does, that it is alive, and that it ends. Without $NOTIFY_SOCKET every call does nothing.
// A call blocks only if systemd does not read its socket. A message that cannot be sent is lost.
// Used by one thread.

#include <string>

namespace alidade {

class ServiceManager {
 public:
  // Reads the environment: $NOTIFY_SOCKET, $WATCHDOG_USEC, $WATCHDOG_PID.
  ServiceManager();

  [[nodiscard]] bool is_there() const { return is_there_; }
  // s; how often to call alive(): half the time after which systemd kills a silent process.
  // Infinity: no watchdog is set.
  [[nodiscard]] double alive_period_s() const { return alive_period_s_; }

  void ready() const;
  void status(const std::string& line) const;  // shown by `systemctl status`
  void alive() const;                          // does nothing without a watchdog
  void stopping() const;

 private:
  bool is_there_;
  double alive_period_s_;
};

}  // namespace alidade
