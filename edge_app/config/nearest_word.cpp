#include "edge_app/config/nearest_word.h"

#include <algorithm>

namespace alidade {
namespace {

// Damerau-Levenshtein distance in which no letter is edited twice ("optimal string alignment").
std::size_t slips_between(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> slips(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) slips[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) slips[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = slips[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      slips[i][j] = std::min({slips[i - 1][j] + 1, slips[i][j - 1] + 1, replaced});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        slips[i][j] = std::min(slips[i][j], slips[i - 2][j - 2] + 1);
      }
    }
  }
  return slips[a.size()][b.size()];
}

}  // namespace

std::optional<std::string> nearest_word(const std::string& typed,
                                        const std::vector<std::string>& known) {
  constexpr std::size_t kLettersOfASlip = 3;
  std::optional<std::string> nearest;
  std::size_t fewest = 0;
  for (const std::string& word : known) {
    const std::size_t longer = std::max(typed.size(), word.size());
    const std::size_t shorter = std::min(typed.size(), word.size());
    // The lengths alone differ too much. This skips the quadratic work for a long text.
    if (kLettersOfASlip * (longer - shorter) > longer) continue;
    const std::size_t slips = slips_between(typed, word);
    if (kLettersOfASlip * slips > longer || (nearest && slips >= fewest)) continue;
    nearest = word;
    fewest = slips;
  }
  return nearest;
}

std::string did_you_mean(const std::string& typed, const std::vector<std::string>& known) {
  const std::optional<std::string> meant = nearest_word(typed, known);
  return meant ? "; did you mean " + *meant + "?" : "";
}

}  // namespace alidade
