#include "common/patch/suture.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr int kRounds = 60, kSweeps = 3;
constexpr double kSlideToleranceM = 1e-13, kBoundToleranceN = 1e-10;

/// A thread while its lengths find their bounds.
class Slides {
 public:
  Slides(const SutureLaw& law, const SutureShape& shape, OfSpans& length_m)
      : law_(law), shape_(shape), length_m_(length_m), n_(static_cast<std::size_t>(law.bites)) {}

  bool is_tail(std::size_t i) const { return i == 0 || (i == n_ && !shape_.held); }
  bool is_tied(std::size_t j) const { return (j == 0 && law_.first_tied) || (j + 1 == n_ && law_.last_tied); }
  double tension_n(std::size_t i) const {
    return is_tail(i) ? 0.0 : law_.stiffness_n_m * std::max(0.0, shape_.distance_m[i] - length_m_[i]);
  }

  void settle() {
    for (int round = 0; round < kRounds; ++round) {
      direction_.fill(0);
      double most = 0;
      for (int sweep = 0; sweep < kSweeps; ++sweep) most = sweep_once(sweep % 2 == 0);
      if (most < kSlideToleranceM || solve_groups()) return;
    }
  }

 private:
  /// Lets each bite slide by itself. Returns the longest way.
  double sweep_once(bool from_hand) {
    double most = 0;
    for (std::size_t at = 0; at < n_; ++at) {
      const std::size_t j = from_hand ? n_ - 1 - at : at;
      if (is_tied(j)) continue;
      double way = slide(j, j, j + 1);
      if (way > 0) direction_[j] = 1;
      if (way == 0 && !law_.barbed) {
        way = slide(j, j + 1, j);
        if (way > 0) direction_[j] = -1;
      }
      most = std::max(most, way);
    }
    return most;
  }

  /// Slides length from span `from` to span `to`, if that pulls too hard, through bite j. Returns how much.
  double slide(std::size_t j, std::size_t from, std::size_t to) {
    const double k = law_.stiffness_n_m, r = shape_.ratio[j];
    const double too_far = (tension_n(to) - r * tension_n(from) - law_.drag_n) / k;
    if (!(too_far > 0)) return 0;
    // Slack of `from` passes before its tension grows.
    const double slack = is_tail(from) ? length_m_[from] : std::max(0.0, length_m_[from] - shape_.distance_m[from]);
    double way = std::min(slack, too_far);
    if (!is_tail(from) && too_far > slack) way = slack + (too_far - slack) / (1 + r);
    way = std::min(way, length_m_[from]);
    length_m_[from] -= way;
    length_m_[to] += way;
    return way;
  }

  /// Takes the bites that slid last as sliding, all others as stuck. Returns true, with their lengths, if that obeys all bounds
  /// and takes no energy from anywhere.
  bool solve_groups() {
    const OfSpans before = length_m_;
    const double energy_before = energy();
    bool good = true;
    for (std::size_t first = 0, end = 0; first <= n_; first = end) {
      end = first + 1;
      while (end <= n_ && direction_[end - 1] != 0) ++end;
      if (end > first + 1) good = good && solve_group(first, end);
    }
    for (std::size_t j = 0; j < n_ && good; ++j) {
      if (is_tied(j)) continue;
      const double low = tension_n(j), high = tension_n(j + 1), r = shape_.ratio[j], d = law_.drag_n + kBoundToleranceN;
      good = (high <= r * low + d || length_m_[j] == 0) && (low <= r * high + d || length_m_[j + 1] == 0 || law_.barbed);
    }
    good = good && energy() <= energy_before;
    if (!good) length_m_ = before;
    return good;
  }

  /// Times 2 k.
  double energy() const {
    double sum = 0;
    for (std::size_t i = 0; i <= n_; ++i) sum += tension_n(i) * tension_n(i);
    return sum;
  }

  /// Spans first ... end - 1 slide on each other: T_i = c_i T_first + e_i. One that feeds the others, a tail or slack, has T = 0;
  /// where it has not enough the others share what it had.
  bool solve_group(std::size_t first, std::size_t end) {
    std::size_t source = end;
    for (std::size_t i = first; i < end; ++i)
      if (is_tail(i) || tension_n(i) == 0) source = i;
    const OfSpans begun = length_m_;
    if (solve_group(first, end, source)) return true;
    if (source == end) return false;
    length_m_ = begun;
    if (!is_tail(source)) return solve_group(first, end, end);
    length_m_[source == first ? first + 1 : source - 1] += length_m_[source];
    length_m_[source] = 0;
    return source == first ? solve_group(first + 1, end) : solve_group(first, end - 1);
  }

  bool solve_group(std::size_t first, std::size_t end, std::size_t source) {
    const double k = law_.stiffness_n_m;
    OfSpans c{}, e{};
    c[first] = 1;
    double length_m = length_m_[first], sum_c = 1, sum_e = 0, distance_m = shape_.distance_m[first];
    for (std::size_t i = first + 1; i < end; ++i) {
      const double r = shape_.ratio[i - 1];
      const bool up = direction_[i - 1] > 0;
      c[i] = up ? r * c[i - 1] : c[i - 1] / r;
      e[i] = up ? r * e[i - 1] + law_.drag_n : (e[i - 1] - law_.drag_n) / r;
      length_m += length_m_[i];
      distance_m += shape_.distance_m[i];
      sum_c += c[i];
      sum_e += e[i];
    }
    const double at_first = source < end ? -e[source] / c[source] : (k * (distance_m - length_m) - sum_e) / sum_c;
    double rest_m = length_m;
    for (std::size_t i = first; i < end; ++i) {
      if (i == source) continue;
      const double tension = c[i] * at_first + e[i];
      length_m_[i] = shape_.distance_m[i] - tension / k;
      rest_m -= length_m_[i];
      if (tension < -kBoundToleranceN || length_m_[i] < 0) return false;
    }
    length_m_[std::min(source, end - 1)] += source < end ? rest_m - length_m_[source] : rest_m;  // or rounding
    return source == end || rest_m >= (is_tail(source) ? 0 : shape_.distance_m[source]);
  }

  const SutureLaw& law_;
  const SutureShape& shape_;
  OfSpans& length_m_;
  std::size_t n_;
  std::array<int, kMaxBites> direction_{};  // 1: to the higher span
};

constexpr double kSoftest = 1e-3;  // of the stiffness without slides

/// A thread that has slid, with what it does to its bites.
struct Settled {
  SutureShape shape;
  SuturePull pull;
  double energy_j = 0;

  Settled(const SutureLaw& law, const OfSpans& begun_m, const SuturePlace& place) noexcept
      : shape(shape_of(law, place)), pull(pull_of(law, begun_m, shape)) {
    for (const double tension_n : pull.tension_n) energy_j += 0.5 * tension_n * tension_n / law.stiffness_n_m;
  }

  /// f_j.
  Vec3 force(std::size_t j) const { return pull.tension_n[j + 1] * shape.along[j + 1] - pull.tension_n[j] * shape.along[j]; }

  /// Returns how far bite j goes this way until it bears `less_n` less, by the tangent; not beyond the other end of a taut span.
  double way_m(const SutureLaw& law, std::size_t j, const Vec3& towards, double less_n) const {
    double stiffness_n_m = 0, most_m = 1e-3;
    const double grows[] = {towards.dot(shape.along[j]), -towards.dot(shape.along[j + 1])};
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
      if (!(pull.tension_n[j + i] > 0)) continue;
      stiffness_n_m += pull.tension_n[j + i] / shape.distance_m[j + i] * (1 - grows[i] * grows[i]);
      for (const std::size_t m : {std::size_t{0}, std::size_t{1}})
        stiffness_n_m += grows[i] * pull.tangent(j + i, j + m) * grows[m];
      most_m = std::min(most_m, shape.distance_m[j + i]);
    }
    return std::min(most_m, less_n / std::max(stiffness_n_m, kSoftest * law.stiffness_n_m));
  }
};

}  // namespace

SutureShape shape_of(const SutureLaw& law, const SuturePlace& place) noexcept {
  SutureShape shape;
  shape.held = place.held;
  shape.along.fill(Vec3::Zero());
  const auto n = static_cast<std::size_t>(law.bites);
  for (std::size_t i = 1; i < n + (place.held ? 1 : 0); ++i) {
    const Vec3 way = place.points[i] - place.points[i - 1];
    shape.distance_m[i] = way.norm();
    if (shape.distance_m[i] > 0) shape.along[i] = way / shape.distance_m[i];
  }
  for (std::size_t j = 0; j < n; ++j) {
    const Vec3 &in = shape.along[j], &out = shape.along[j + 1];
    shape.ratio[j] = std::exp(law.friction * std::atan2(in.cross(out).norm(), in.dot(out)));
  }
  return shape;
}

SuturePull pull_of(const SutureLaw& law, const OfSpans& length_m, const SutureShape& shape) noexcept {
  constexpr double kSlidM = 1e-12;
  SuturePull pull;
  pull.length_m = length_m;
  Slides slides(law, shape, pull.length_m);
  slides.settle();
  const auto n = static_cast<std::size_t>(law.bites);
  for (std::size_t i = 0; i <= n; ++i) pull.tension_n[i] = slides.tension_n(i);
  std::array<double, kMaxBites> slid{};  // to the higher spans
  double beyond = 0;
  for (std::size_t j = n; j-- > 0;) slid[j] = beyond += pull.length_m[j + 1] - length_m[j + 1];
  int groups = 0;
  for (std::size_t first = 0, end = 0; first <= n; first = end, ++groups) {
    end = first + 1;
    pull.share[first] = 1;
    for (; end <= n && std::abs(slid[end - 1]) > kSlidM; ++end)
      pull.share[end] = pull.share[end - 1] * (slid[end - 1] > 0 ? shape.ratio[end - 1] : 1 / shape.ratio[end - 1]);
    double compliance = 0;
    bool fed = false;
    for (std::size_t i = first; i < end; ++i) {
      compliance += pull.share[i] / law.stiffness_n_m;
      fed |= slides.is_tail(i) || pull.tension_n[i] == 0;
    }
    for (std::size_t i = first; i < end; ++i) {
      pull.group[i] = groups;
      pull.group_n_m[i] = fed ? 0 : 1 / compliance;
    }
  }
  return pull;
}

SutureTear tear_of(const SutureLaw& law, const OfSpans& length_m, SuturePlace place, int most_settled) noexcept {
  constexpr double kLess = 0.5, kLeast = 2e-4;  // of the way by the tangent, where the thread does not give what it takes
  // Bites yield together: one that went all its way before the others begin would go too far.
  constexpr double kAtOnce = 0.5, kWholly = 0.02;  // of what a bite bears too much; of J d
  constexpr double kTooMuchN = 1e-6;
  SutureTear tear;
  tear.way.fill(Vec3::Zero());
  tear.spans_m = length_m;
  if (!(law.tear_n > 0)) return tear;
  Settled at(law, length_m, place);
  tear.settled = 1;
  std::array<double, kMaxBites> share;  // of its way that a bite tries next
  share.fill(1);
  const auto n = static_cast<std::size_t>(law.bites);
  while (tear.settled < most_settled) {
    std::size_t most = n;  // the bite that bears the most
    double too_much = kTooMuchN;
    for (std::size_t j = 0; j < n; ++j) {
      const double beyond = share[j] * (at.force(j).norm() - law.tear_n);
      if (!(beyond > too_much) || share[j] < kLeast) continue;
      most = j;
      too_much = beyond;
    }
    if (most == n) break;
    const Vec3 force = at.force(most), from = place.points[most], towards = force.normalized();
    const double beyond_n = force.norm() - law.tear_n;
    const double less_n = std::min(beyond_n, std::max(kAtOnce * beyond_n, kWholly * law.tear_n));
    const double way = share[most] * at.way_m(law, most, towards, less_n);
    place.points[most] = from + way * towards;
    const Settled then(law, at.pull.length_m, place);
    ++tear.settled;
    if (at.energy_j - then.energy_j >= law.tear_n * way) {
      tear.way[most] += way * towards;
      tear.length_m += way;
      at = then;
      share.fill(1);
    } else {
      place.points[most] = from;
      share[most] *= kLess;
    }
  }
  tear.spans_m = at.pull.length_m;
  return tear;
}

}  // namespace palpate
