#pragma once
// Which pictures are connected by landmarks in common. Pure.

#include <utility>
#include <vector>

namespace alidade {

// Indices of a picture and of a landmark that it sees.
using SeenIn = std::pair<int, int>;

// Groups of pictures: each picture shares `least_common` landmarks or more with another one of its
// group. The largest group comes first; the pictures of a group are in increasing order. A picture
// that shares with no other is a group of its own. pictures: their number; indices that are not
// below it are ignored.
[[nodiscard]] std::vector<std::vector<int>> connected_pictures(int pictures,
                                                               std::vector<SeenIn> seen,
                                                               int least_common);

}  // namespace alidade
