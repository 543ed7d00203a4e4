#pragma once
// ask_ahead: prefetches memory that is needed soon, without waiting. A frame and its map are larger
// than the cache; without prefetching, waiting for memory takes a third of a frame's time. Reads
// nothing, so any address is valid. No allocation.

namespace alidade {

inline constexpr int kCacheLine = 64;  // bytes; longer lines are partly requested twice

// The cache line of this address.
inline void ask_ahead(const void* address) {
  constexpr int kRead = 0;
  constexpr int kOfUseForLong = 2;  // second-level cache: the first is too small to keep it
  __builtin_prefetch(address, kRead, kOfUseForLong);
}

// One request every kCacheLine bytes, from begin up to end. If begin is not the first byte of a
// line, the last line may not be requested.
inline void ask_ahead(const void* begin, const void* end) {
  for (const auto* at = static_cast<const char*>(begin); at < end; at += kCacheLine) ask_ahead(at);
}

}  // namespace alidade
