// A target with a defect, to show that the runs find one: three bytes it cannot bear.

#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size >= 3 && data[0] == 'b' && data[1] == 'a' && data[2] == 'd') {
    std::fputs("the planted defect is found\n", stderr);
    std::abort();
  }
  return 0;
}
