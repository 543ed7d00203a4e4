#pragma once
// The largest picture that anything here is made for. What a file or a configuration says is held against it before memory is taken.

namespace alidade {

inline constexpr int kMostPictureSide = 16384;  // px, as H.264's

}  // namespace alidade
