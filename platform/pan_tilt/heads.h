#pragma once
// The heads that QuerySource can ask, each with one row. Sources, configuration, tests, fuzz targets and soak
// take their lists from here, but for the simulated ones, kHeadModels, which a test holds against it; a switch over HeadType or a visit of HeadOptions that lacks one does not
// compile, and CMake names a file that one lacks. How to add a head: README.md of this folder.

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>
#include <variant>

#include "platform/pan_tilt/axis_mapping.h"
#include "platform/pan_tilt/pelco_d_protocol.h"
#include "platform/pan_tilt/ptu_protocol.h"
#include "platform/pan_tilt/query_protocol.h"
#include "platform/pan_tilt/visca_protocol.h"

namespace alidade {

enum class HeadType { kPelcoD, kVisca, kPtu };

// In the order of HeadType.
using HeadOptions = std::variant<PelcoDOptions, ViscaOptions, PtuOptions>;

struct Head {
  HeadType type;
  const char* key;   // pan_tilt.type of the configuration; KEY_protocol.h, .cpp, KEY_fuzz.cpp ...
  UsualSigns signs;  // as the protocol defines them
};

// cmake/AlidadeHeads.cmake reads these lines, too: one a head.
inline constexpr std::array<Head, std::variant_size_v<HeadOptions>> kHeads = {{
    {HeadType::kPelcoD, "pelco_d", {1, -1}},
    {HeadType::kVisca, "visca", kSignsOfTheMaker},
    {HeadType::kPtu, "ptu", kSignsOfTheMaker},
}};

[[nodiscard]] constexpr const Head& head_of(HeadType type) {
  return kHeads[static_cast<std::size_t>(type)];
}

namespace internal {

constexpr bool has_a_row_for_each_head() {
  for (std::size_t i = 0; i < kHeads.size(); ++i) {
    if (kHeads[i].key == nullptr || kHeads[i].type != static_cast<HeadType>(i)) return false;
  }
  return true;
}
static_assert(has_a_row_for_each_head(), "kHeads and HeadType must have one order");

}  // namespace internal

// None: no head is called so.
[[nodiscard]] inline std::optional<HeadType> head_type_of(std::string_view key) {
  for (const Head& head : kHeads) {
    if (head.key == key) return head.type;
  }
  return std::nullopt;
}

[[nodiscard]] std::unique_ptr<QueryProtocol> make_protocol(const HeadOptions& options);

}  // namespace alidade
