#include "platform/system/service_manager.h"

#include <systemd/sd-daemon.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace alidade {
namespace {

constexpr int kKeepEnvironment = 0;

// Failure is ignored: nothing here depends on it.
void tell(const std::string& text) { static_cast<void>(sd_notify(kKeepEnvironment, text.c_str())); }

double half_of_the_watchdog_s() {
  std::uint64_t period_us = 0;
  if (sd_watchdog_enabled(kKeepEnvironment, &period_us) <= 0) {
    return std::numeric_limits<double>::infinity();
  }
  return 0.5e-6 * static_cast<double>(period_us);
}

}  // namespace

ServiceManager::ServiceManager()
    : is_there_(std::getenv("NOTIFY_SOCKET") != nullptr),
      alive_period_s_(is_there_ ? half_of_the_watchdog_s()
                                : std::numeric_limits<double>::infinity()) {}

void ServiceManager::ready() const { tell("READY=1"); }
void ServiceManager::status(const std::string& line) const { tell("STATUS=" + line); }
void ServiceManager::alive() const {
  if (std::isfinite(alive_period_s_)) tell("WATCHDOG=1");
}
void ServiceManager::stopping() const { tell("STOPPING=1"); }

}  // namespace alidade
