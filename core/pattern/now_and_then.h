#pragma once
// For what takes long and rarely helps: light and distance change slowly, so that what did not help in the last images is tried in
// some of the next ones only.

namespace alidade::internal {

class NowAndThen {
 public:
  // find: is what was looked for there? False without looking, in most images after some in vain.
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
