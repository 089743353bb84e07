// Datagrams in flight: items in the order of their due moment, and of their entry where moments are equal.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/types.hpp"

namespace palpate {

template <class T>
class DelayQueue {
 public:
  void push(Micros due, T item) {
    heap_.push_back({due, entered_++, std::move(item)});
    std::push_heap(heap_.begin(), heap_.end(), later);
  }
  bool empty() const { return heap_.empty(); }
  std::size_t size() const { return heap_.size(); }
  /// Time at which the next item is due; only when not empty.
  Micros next_due() const { return heap_.front().due; }
  /// Returns the next item with a due time of at most `now`.
  std::optional<T> pop(Micros now) {
    if (heap_.empty() || heap_.front().due > now) return std::nullopt;
    std::pop_heap(heap_.begin(), heap_.end(), later);
    std::optional<T> item(std::move(heap_.back().item));
    heap_.pop_back();
    return item;
  }

 private:
  struct Entry {
    Micros due;
    std::uint64_t order;
    T item;
  };
  static bool later(const Entry& a, const Entry& b) { return a.due != b.due ? a.due > b.due : a.order > b.order; }

  std::vector<Entry> heap_;
  std::uint64_t entered_ = 0;
};

}  // namespace palpate
