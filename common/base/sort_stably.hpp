// Stable sorting for items of any alignment.
//
// std::stable_sort, std::stable_partition and std::inplace_merge of GCC 12 get their buffer from std::get_temporary_buffer, which
// ignores alignment beyond that of operator new: items with a larger one (an Eigen::Quaterniond has 32 bytes with AVX) may then
// be misaligned for vector instructions, depending on the heap. So nothing else in the project calls these functions
// (tests/style): here they sort iterators, and a std::vector, whose memory is aligned, holds the items.
#pragma once

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace palpate {

/// Sorts [first, last), random access, by `less`.
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
