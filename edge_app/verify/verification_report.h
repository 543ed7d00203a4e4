#pragma once
// verification.html: a verification for people to judge, as one self-contained page (html_page.h):
// the verdict, the known directions, and, if pairs of pictures were compared, tables and plots of
// these. Pure; allocates.

#include <string>

#include "edge_app/verify/verification.h"

namespace alidade {

struct VerificationOrigin {
  std::string recording;  // its name, plain text, as all here
  std::string version;    // of the program
  std::string date;       // date, time and zone of the report
};

// The whole page as HTML.
[[nodiscard]] std::string verification_report(const Verification& verification,
                                              const VerificationOrigin& origin);

}  // namespace alidade
