#include "edge_app/verify/verification_report.h"

#include "edge_app/output/html_page.h"

namespace alidade {

std::string verification_report(const Verification& verification,
                                const VerificationOrigin& origin) {
  return html_page(origin.recording, verification.sentence);
}

}  // namespace alidade
