#pragma once
// A verification in words: names, sizes with their units, a sentence for each comparison and for
// the whole. Pure; allocates.

#include <string>
#include <vector>

#include "edge_app/verify/verification.h"

namespace alidade {

[[nodiscard]] const char* to_string(Verdict verdict);
[[nodiscard]] const char* name_of(ReturnKind kind);

// "clock offset"
[[nodiscard]] const char* name_of(Departure departure);
// The size of a departure, with its sigma and unit: "off by 3.02 +- 0.05 ms".
[[nodiscard]] std::string size_of(const DepartureTest& test);

// "OE" or "PT".
[[nodiscard]] const char* mode_of(OrientationFrom from);
// Null: it is not among them.
[[nodiscard]] const DepartureTest* test_of(const std::vector<DepartureTest>& found,
                                           Departure departure);
[[nodiscard]] std::string sentence_of(const ClaimComparison& comparison);
// found: ModelCheckResult::found. One error makes many departures improbable: those that are not
// among the found ones are said to be explained by them.
[[nodiscard]] std::string sentence_of(const ModelComparison& comparison,
                                      const std::vector<DepartureTest>& found);
[[nodiscard]] std::string sentence_of(const KnownComparison& comparison);
[[nodiscard]] std::string sentence_of(const JudgedZooms& zooms);
[[nodiscard]] std::string sentence_of(const VerifiedLink& link);
// The verdict, with the number that matters and the likeliest causes.
[[nodiscard]] std::string summary_of(const Verification& verification);

// The verdict with its comparisons, for the terminal.
[[nodiscard]] std::string verification_text(const Verification& verification);

}  // namespace alidade
