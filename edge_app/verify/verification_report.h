#pragma once
// verification.html: a verification for people to judge, as one self-contained page (html_page.h)
// with a picture for each kind of comparison. Pure; allocates.

#include <string>

#include "edge_app/verify/verification.h"

namespace alidade {

struct VerificationOrigin {
  std::string recording;
  std::string version;  // of the program
  std::string date;     // date, time and zone of the report
};

[[nodiscard]] std::string verification_report(const Verification& verification,
                                              const VerificationOrigin& origin);

}  // namespace alidade
