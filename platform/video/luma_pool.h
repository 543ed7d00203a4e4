#pragma once
// LumaPool: reuses the memory of luma planes. Fresh memory for each picture would cost hundreds of
// page faults, each filled with zeros by the kernel. A plane returns to the pool when its last
// owner releases it, on any thread, even after the pool is gone. The pool frees planes of another
// size than the last one taken, and planes beyond kKept.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "platform/system/priority_mutex.h"

namespace alidade {

class LumaPool {
 public:
  static constexpr std::size_t kKept = 4;  // unused planes

  // A plane of `size` bytes with undefined content.
  [[nodiscard]] std::shared_ptr<std::uint8_t> take(std::size_t size) {
    std::unique_ptr<std::uint8_t[]> plane = shelf_->take(size);
    if (plane == nullptr) plane.reset(new std::uint8_t[size]);
    const auto put_back = [shelf = shelf_, size](std::uint8_t* bytes) {
      shelf->put(std::unique_ptr<std::uint8_t[]>(bytes), size);
    };
    return {plane.release(), put_back};
  }

 private:
  class Shelf {
   public:
    Shelf() { planes_.reserve(kKept); }
    std::unique_ptr<std::uint8_t[]> take(std::size_t size) {
      const std::lock_guard<PriorityMutex> lock(mutex_);
      if (size != size_) planes_.clear();
      size_ = size;
      if (planes_.empty()) return nullptr;
      std::unique_ptr<std::uint8_t[]> plane = std::move(planes_.back());
      planes_.pop_back();
      return plane;
    }
    void put(std::unique_ptr<std::uint8_t[]> plane, std::size_t size) {
      const std::lock_guard<PriorityMutex> lock(mutex_);
      if (size == size_ && planes_.size() < kKept) planes_.push_back(std::move(plane));
    }

   private:
    PriorityMutex mutex_;
    std::size_t size_ = 0;  // bytes of each plane
    std::vector<std::unique_ptr<std::uint8_t[]>> planes_;
  };

  std::shared_ptr<Shelf> shelf_ = std::make_shared<Shelf>();
};

}  // namespace alidade
