#include <Eigen/OrderingMethods>
#include <algorithm>
#include <numeric>

#include "bench/paper/symmetric_factor.hpp"

namespace palpate {
namespace {

using Lists = std::vector<std::vector<int>>;

/// Returns the rows above the diagonal of every column, in the given order of elimination.
Lists upper_rows(const SparseMatrix& a, const std::vector<int>& original, const std::vector<int>& place) {
  Lists upper(original.size());
  for (std::size_t j = 0; j < original.size(); ++j)
    for (SparseMatrix::InnerIterator it(a, original[j]); it; ++it) {
      const int i = place[static_cast<std::size_t>(it.row())];
      if (i < static_cast<int>(j)) upper[j].push_back(i);
    }
  return upper;
}

/// Returns the elimination tree (Liu): the parent of a column is the first one that it updates.
std::vector<int> elimination_tree(const Lists& upper) {
  std::vector<int> parent(upper.size(), -1), ancestor(upper.size(), -1);
  for (std::size_t j = 0; j < upper.size(); ++j)
    for (int i : upper[j])
      while (i != -1 && i < static_cast<int>(j)) {
        const auto at = static_cast<std::size_t>(i);
        const int next = ancestor[at];
        ancestor[at] = static_cast<int>(j);
        if (next == -1) parent[at] = static_cast<int>(j);
        i = next;
      }
  return parent;
}

std::vector<int> postorder(const std::vector<int>& parent) {
  Lists children(parent.size());
  std::vector<int> order, stack;
  for (std::size_t j = 0; j < parent.size(); ++j)
    if (parent[j] >= 0) children[static_cast<std::size_t>(parent[j])].push_back(static_cast<int>(j));
  for (std::size_t root = 0; root < parent.size(); ++root) {
    if (parent[root] >= 0) continue;
    stack.push_back(static_cast<int>(root));
    while (!stack.empty()) {
      auto& left = children[static_cast<std::size_t>(stack.back())];
      if (left.empty()) {
        order.push_back(stack.back());
        stack.pop_back();
      } else {
        stack.push_back(left.back());
        left.pop_back();
      }
    }
  }
  return order;
}

std::vector<int> inverse(const std::vector<int>& order) {
  std::vector<int> place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[static_cast<std::size_t>(order[k])] = static_cast<int>(k);
  return place;
}

/// Returns the rows below the diagonal of every column of L.
Lists factor_rows(const Lists& upper, const std::vector<int>& parent) {
  const std::size_t n = upper.size();
  Lists rows(n), children(n);
  for (std::size_t j = 0; j < n; ++j)
    for (const int i : upper[j]) rows[static_cast<std::size_t>(i)].push_back(static_cast<int>(j));
  std::vector<int> merged;
  for (std::size_t j = 0; j < n; ++j) {
    for (const int child : children[j]) {
      const auto& below = rows[static_cast<std::size_t>(child)];
      merged.clear();
      std::set_union(rows[j].begin(), rows[j].end(), std::upper_bound(below.begin(), below.end(), static_cast<int>(j)),
                     below.end(), std::back_inserter(merged));
      rows[j] = merged;
    }
    if (parent[j] >= 0) children[static_cast<std::size_t>(parent[j])].push_back(static_cast<int>(j));
  }
  return rows;
}

/// Joins columns of nearly the same pattern into one front: wide fronts are fast, and a few zeros in them cost little.
std::vector<SymmetricAnalysis::Front> make_fronts(Lists rows, const std::vector<int>& parent) {
  constexpr double kZerosMax = 0.15;
  std::vector<SymmetricAnalysis::Front> fronts;
  const auto joins = [&](const SymmetricAnalysis::Front& f, int j) {
    // Column j is the parent of the front's last column; joined, the front's columns reach all rows of j.
    if (parent[static_cast<std::size_t>(j) - 1] != j) return false;
    const auto reach = static_cast<double>(rows[static_cast<std::size_t>(j)].size() + 1);
    const double zeros = static_cast<double>(f.width) * (reach - static_cast<double>(f.rows.size()));
    return zeros <= kZerosMax * (f.width + 1) * (reach + f.width);
  };
  for (int j = 0; j < static_cast<int>(rows.size()); ++j) {
    auto& below = rows[static_cast<std::size_t>(j)];
    if (!fronts.empty() && joins(fronts.back(), j)) {
      ++fronts.back().width;
      fronts.back().rows = std::move(below);
    } else {
      fronts.push_back({j, 1, -1, std::move(below), {}});
    }
  }
  std::vector<int> front_of(rows.size());
  for (std::size_t k = 0; k < fronts.size(); ++k)
    std::fill_n(front_of.begin() + fronts[k].first, fronts[k].width, static_cast<int>(k));
  for (std::size_t k = 0; k < fronts.size(); ++k)
    if (!fronts[k].rows.empty()) {
      fronts[k].parent = front_of[static_cast<std::size_t>(fronts[k].rows.front())];
      fronts[static_cast<std::size_t>(fronts[k].parent)].children.push_back(static_cast<int>(k));
    }
  return fronts;
}

}  // namespace

SymmetricAnalysis::SymmetricAnalysis(const SparseMatrix& pattern) : size(static_cast<int>(pattern.rows())) {
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern, order);
  original.assign(order.indices().data(), order.indices().data() + size);
  const std::vector<int> post = postorder(elimination_tree(upper_rows(pattern, original, inverse(original))));
  std::vector<int> sorted;
  for (const int k : post) sorted.push_back(original[static_cast<std::size_t>(k)]);
  original = std::move(sorted);

  const std::vector<int> place = inverse(original);
  const Lists upper = upper_rows(pattern, original, place);
  const std::vector<int> parent = elimination_tree(upper);
  fronts = make_fronts(factor_rows(upper, parent), parent);

  column_begin.push_back(0);
  for (int j = 0; j < size; ++j) {
    for (SparseMatrix::InnerIterator it(pattern, original[static_cast<std::size_t>(j)]); it; ++it)
      if (const int row = place[static_cast<std::size_t>(it.row())]; row >= j)
        entries.push_back({row, static_cast<int>(&it.valueRef() - pattern.valuePtr())});
    column_begin.push_back(static_cast<int>(entries.size()));
  }
}

}  // namespace palpate
