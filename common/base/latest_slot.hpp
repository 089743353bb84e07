// A wait-free mailbox in which only the newest value matters: one writer, one reader, three buffers.
//
// The writer fills back() and publishes it; the reader takes the newest published value or learns that there is none.
// Neither ever waits, copies or allocates. A value that is overtaken before it is taken is lost, by design.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace palpate {

template <class T>
class LatestSlot {
 public:
  /// Writer: returns the buffer to fill before publish(). Its old content is unspecified.
  T& back() { return buffers_[back_]; }
  /// Writer: makes back() the newest value.
  void publish() { back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex; }

  /// Reader: returns the newest value if one was published since the last call, otherwise nullptr. Valid until the next call.
  T* take() {
    if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return nullptr;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return &buffers_[front_];
  }

 private:
  static constexpr std::uint8_t kFresh = 4, kIndex = 3;
  std::array<T, 3> buffers_{};
  std::uint8_t back_ = 0;
  alignas(64) std::atomic<std::uint8_t> middle_{1};
  alignas(64) std::uint8_t front_ = 2;
};

}  // namespace palpate
