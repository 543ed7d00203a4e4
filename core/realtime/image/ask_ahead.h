#pragma once
// ask_ahead: asks memory for what is needed soon, and does not wait for it. A frame and its map are larger than the cache: what the
// last frame has used is gone, and waiting for it is a third of a frame's time.
// Nothing is read: any address will do. No allocation.

namespace alidade {

inline constexpr int kCacheLine = 64;  // bytes; where lines are longer some are asked for twice

// The line that holds this address.
inline void ask_ahead(const void* address) {
  constexpr int kRead = 0;
  constexpr int kOfUseForLong =
      2;  // into the second cache: the first is too small to hold it until then
  __builtin_prefetch(address, kRead, kOfUseForLong);
}

// All lines from one address up to another.
inline void ask_ahead(const void* begin, const void* end) {
  for (const auto* at = static_cast<const char*>(begin); at < end; at += kCacheLine) ask_ahead(at);
}

}  // namespace alidade
