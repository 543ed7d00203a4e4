#pragma once
// NowAndThen: skips an expensive step that rarely helps. Light and distance change slowly, so a
// step that did not help in the last images is tried in some of the next ones only.

namespace alidade::internal {

class NowAndThen {
 public:
  // find: looks for something and returns whether it is there. After four images in vain it is
  // called in every eighth one only; in the others the result is false.
  template <class Find>
  bool operator()(const Find& find) {
    constexpr int kPatience = 4;
    constexpr int kEvery = 8;
    const bool skip = in_vain_ >= kPatience && in_vain_ % kEvery != 0;
    ++in_vain_;
    if (skip || !find()) return false;
    in_vain_ = 0;
    return true;
  }

 private:
  int in_vain_ = 0;  // images in a row
};

}  // namespace alidade::internal
