#pragma once
// Times as streams tell them, made of an input: mostly a step of a regular stream, sometimes any number
// at all, for a device or a file can tell anything.

#include "test/fuzz/fuzz_target.h"

namespace alidade {

// The time after before_s. One byte: low six bits a step of up to 0.315 s, the two above them say what
// kind: forward, backward, forward by a thousandth of it, or the eight bytes that follow as a number.
inline double next_stamp(double before_s, FuzzInput* input) {
  const unsigned bits = input->byte();
  const double step_s = 0.005 * (bits & 63U);
  switch (bits >> 6U) {
    case 0:
      return before_s + step_s;
    case 1:
      return before_s - step_s;
    case 2:
      return before_s + 1e-3 * step_s;
    default:
      return input->number();
  }
}

}  // namespace alidade
