// A sum over nodes in several lanes of floats: a few terms in single precision, the sums of these in double.
#pragma once

#include <array>
#include <cstddef>

namespace palpate {

/// Lanes::Term: a vector of floats.
template <class Lanes>
class NodeSum {
 public:
  using Term = typename Lanes::Term;
  static constexpr std::size_t kLanes = sizeof(Term) / sizeof(float);
  [[gnu::always_inline]] void add(const Term& term) {
    few_ += term;
    if (++count_ == kFew) flush();
  }
  std::array<double, kLanes> total() {
    flush();
    return total_;
  }

 private:
  static constexpr int kFew = 16;
  void flush() {
    for (std::size_t k = 0; k < kLanes; ++k) total_[k] += static_cast<double>(few_[k]);
    few_ = Term{};
    count_ = 0;
  }
  Term few_{};
  std::array<double, kLanes> total_{};
  int count_ = 0;
};

}  // namespace palpate
