#pragma once
// Which pictures hang together by what they see in common. Pure.

#include <utility>
#include <vector>

namespace alidade {

// Which picture sees which landmark; both counted from 0.
using SeenIn = std::pair<int, int>;

// Groups of pictures of which each shares `least_common` landmarks or more with another one of its group; the largest first, within
// each in increasing order. A picture that shares with none is a group of its own. Pictures outside 0 to `pictures` are left out.
[[nodiscard]] std::vector<std::vector<int>> connected_pictures(int pictures,
                                                               std::vector<SeenIn> seen,
                                                               int least_common);

}  // namespace alidade
