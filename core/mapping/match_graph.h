#pragma once
// Which pictures are connected by landmarks in common. Pure.

#include <utility>
#include <vector>

namespace alidade {

// Indices of a picture and of a landmark that it sees.
using SeenIn = std::pair<int, int>;

// Groups of pictures: each shares `least_common` landmarks or more with another one of its group.
// The largest first, each in increasing order. A picture that shares with none is a group of its
// own. Pictures outside 0 to `pictures` - 1 are ignored.
[[nodiscard]] std::vector<std::vector<int>> connected_pictures(int pictures,
                                                               std::vector<SeenIn> seen,
                                                               int least_common);

}  // namespace alidade
