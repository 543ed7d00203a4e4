#pragma once
// ServiceManager: what systemd is told of this process (sd_notify(3), Type=notify): that it has started, what it
// does, that it lives, that it ends. Without $NOTIFY_SOCKET nobody is there, and every call does nothing.
// Messages go into systemd's socket, which waits only if systemd does not read. One that cannot be sent is lost.
// One thread uses it.

#include <string>

namespace alidade {

class ServiceManager {
 public:
  // Reads the environment: $NOTIFY_SOCKET, $WATCHDOG_USEC, $WATCHDOG_PID.
  ServiceManager();

  [[nodiscard]] bool is_there() const { return is_there_; }
  // How often to call alive(): half of the time after which a silent process is killed. Infinity: nobody watches.
  [[nodiscard]] double alive_period_s() const { return alive_period_s_; }

  void ready() const;
  void status(const std::string& line) const;  // shown by `systemctl status`
  void alive() const;                          // nothing, if nobody watches
  void stopping() const;

 private:
  bool is_there_;
  double alive_period_s_;
};

}  // namespace alidade
