// Sorting in which what compares equal stays in its order, for items of any alignment.
//
// std::stable_sort, std::stable_partition and std::inplace_merge of GCC 12 take their buffer from std::get_temporary_buffer,
// which knows no alignment beyond that of operator new: items with more of it (an Eigen::Quaterniond has 32 bytes where AVX is
// on) then lie where no aligned instruction may reach them, by chance of the heap. So nothing else in the project calls these
// (tests/style): here they sort places, and a std::vector, whose memory is aligned, takes the items.
#pragma once

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace palpate {

/// By `less` over [first, last), random access.
template <class Iterator, class Less>
void sort_stably(Iterator first, Iterator last, const Less& less) {
  std::vector<Iterator> order;
  order.reserve(static_cast<std::size_t>(last - first));
  for (auto item = first; item != last; ++item) order.push_back(item);
  std::stable_sort(order.begin(), order.end(), [&](Iterator p, Iterator q) { return less(*p, *q); });
  std::vector<std::iter_value_t<Iterator>> sorted;
  sorted.reserve(order.size());
  for (const Iterator item : order) sorted.push_back(std::move(*item));
  std::move(sorted.begin(), sorted.end(), first);
}

}  // namespace palpate
