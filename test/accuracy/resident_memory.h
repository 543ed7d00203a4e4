#pragma once
// What this process has in memory.

#include <unistd.h>

#include <fstream>

namespace alidade::test {

// Pages that are in memory, MiB.
inline double resident_mib() {
  std::ifstream statm("/proc/self/statm");
  double size = 0;
  double resident = 0;
  statm >> size >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

}  // namespace alidade::test
