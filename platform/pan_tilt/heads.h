#pragma once
// The heads that QuerySource can poll, one row each. Sources, configuration, tests, fuzz targets
// and the soak test take their lists from here. The simulated heads have a list of their own,
// kHeadModels; a test compares the two lists. A switch over HeadType or a visit of HeadOptions that
// lacks a head does not compile, and CMake names a missing file. How to add a head: README.md of
// this folder.

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
  const char* key;   // pan_tilt.type in the configuration; also in file names: KEY_protocol.h,
                     // KEY_fuzz.cpp ...
  UsualSigns signs;  // as defined by the protocol
};

// cmake/AlidadeHeads.cmake parses these lines, too: one line a head.
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

// nullopt: there is no head of this name.
[[nodiscard]] inline std::optional<HeadType> head_type_of(std::string_view key) {
  for (const Head& head : kHeads) {
    if (head.key == key) return head.type;
  }
  return std::nullopt;
}

[[nodiscard]] std::unique_ptr<QueryProtocol> make_protocol(const HeadOptions& options);

}  // namespace alidade
