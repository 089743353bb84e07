#include "common/port/terms_pieces.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr float kLargest = 8192;  // of the numbers in their unit
constexpr float kUnitMax = 1e6F, kPortScaleMax = 1e6F, kRadiusMax = 1e4F, kStiffeningMax = 1e4F;

/// How many numbers of each kind there are.
struct Layout {
  int modes, turning;
  std::array<int, 5> count;
  int surface;
  int total() const { return count[0] + count[1] + count[2] + count[3] + count[4] + surface; }
  int pieces() const { return (total() + kPieceNumbers - 1) / kPieceNumbers; }
};

Layout layout(const PatchTerms& p) {
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), t = std::min<int>(p.leading, kTurning);
  const int surface = p.vertices * (9 + 3 * r) + 3 * p.triangles;
  if (p.springs > 0)
    return {r, 0, {3 * n * p.springs, 4 * p.springs, p.springs, p.springs, p.repaired ? pairs_of(n) : 0}, surface};
  return {r, t, {r * r, p.repaired ? pairs_of(n) : 0, triples_of(n), quadruples_of(p.leading), t * pairs_of(t)}, surface};
}

std::uint16_t to_half(float v) { return Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(v)); }
float from_half(std::uint16_t v) { return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(v)); }
bool finite_half(std::uint16_t v) { return (v & 0x7c00U) != 0x7c00U; }

/// Appends numbers in a unit that suits their largest.
template <class Values>
float append(const Values& values, std::vector<std::uint16_t>& out) {
  const float largest = values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0;
  const float unit = largest > 0 ? largest / kLargest : 1;
  for (Eigen::Index i = 0; i < values.size(); ++i) out.push_back(to_half(values[i] / unit));
  return unit;
}

/// The next numbers, in their unit.
Eigen::VectorXf take(const std::vector<std::uint16_t>& numbers, int& at, int count, float unit) {
  Eigen::VectorXf values(count);
  for (int i = 0; i < count; ++i) values[i] = unit * from_half(numbers[static_cast<std::size_t>(at++)]);
  return values;
}

void append_polynomials(const CubicTerms& terms, const Layout& l, PatchTerms& head, std::vector<std::uint16_t>& out) {
  if (terms.grasp)
    for (int i = 0; i < 3; ++i) head.port_scale[static_cast<std::size_t>(i)] = static_cast<float>(terms.scale(i, i));
  const Eigen::MatrixXf rows = terms.scale.bottomRightCorner(l.modes, l.modes).transpose().cast<float>();
  const Eigen::MatrixXf q = terms.q.topLeftCorner(l.turning, pairs_of(l.turning));
  head.unit = {append(rows.reshaped(), out), append(terms.e2, out), append(terms.e3, out), append(terms.e4, out),
               append(q.reshaped(), out)};
}

void append_springs(const CubicTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out) {
  const SampledSprings& springs = terms.springs;
  const Eigen::MatrixXf rows = springs.motion.transpose();
  Eigen::MatrixXf lengths(4, springs.count());
  lengths << springs.span, springs.rest_length.transpose();
  head.unit = {append(rows.reshaped(), out), append(lengths.reshaped(), out), append(springs.stiffness, out),
               append(springs.damping, out), append(terms.e2, out)};
}

void take_polynomials(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, CubicTerms& terms) {
  const Layout l = layout(head);
  if (terms.grasp)
    for (int i = 0; i < 3; ++i) terms.scale(i, i) = static_cast<double>(head.port_scale[static_cast<std::size_t>(i)]);
  terms.scale.bottomRightCorner(l.modes, l.modes) =
      take(numbers, at, l.count[0], head.unit[0]).reshaped(l.modes, l.modes).transpose().cast<double>();
  terms.e2 = take(numbers, at, l.count[1], head.unit[1]);
  terms.e3 = take(numbers, at, l.count[2], head.unit[2]);
  terms.e4 = take(numbers, at, l.count[3], head.unit[3]);
  terms.q.setZero(terms.leading, pairs_of(terms.leading));
  terms.q.topLeftCorner(l.turning, pairs_of(l.turning)) =
      take(numbers, at, l.count[4], head.unit[4]).reshaped(l.turning, pairs_of(l.turning));
}

/// False when one is not what a spring can be.
bool take_springs(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, CubicTerms& terms) {
  const Layout l = layout(head);
  const int n = head.variables, m = head.springs;
  SampledSprings& springs = terms.springs;
  terms.scale.setIdentity();
  springs.stiffening = head.stiffening;
  springs.motion = take(numbers, at, l.count[0], head.unit[0]).reshaped(n, 3 * m).transpose();
  const Eigen::VectorXf lengths = take(numbers, at, l.count[1], head.unit[1]);
  springs.span = lengths.reshaped(4, m).topRows<3>();
  springs.rest_length = lengths.reshaped(4, m).row(3).transpose();
  springs.stiffness = take(numbers, at, l.count[2], head.unit[2]);
  springs.damping = take(numbers, at, l.count[3], head.unit[3]);
  terms.e2 = take(numbers, at, l.count[4], head.unit[4]);
  return springs.rest_length.minCoeff() > 0 && springs.stiffness.minCoeff() >= 0 && springs.damping.minCoeff() >= 0;
}

constexpr double kPositionUnitM = 1.0 / 1024;

void append_surface(const CubicTerms& terms, std::vector<std::uint16_t>& out) {
  const auto add = [&](double v) {
    out.push_back(to_half(static_cast<float>(v)));
    return static_cast<double>(from_half(out.back()));
  };
  for (const PortVertex& vertex : terms.vertices) {
    for (const double x : vertex.position) add(x / kPositionUnitM - add(x / kPositionUnitM));
    for (const double x : vertex.normal) add(x);
    for (const double x : vertex.rows.reshaped()) add(x);
  }
  for (const Triangle& triangle : terms.triangles)
    for (const std::uint32_t corner : triangle) add(corner);
}

/// False when a corner is no vertex of any surface.
bool take_surface(const std::vector<std::uint16_t>& numbers, int at, const PatchTerms& head, CubicTerms& terms) {
  const auto next = [&] { return static_cast<double>(from_half(numbers[static_cast<std::size_t>(at++)])); };
  terms.vertices.resize(head.vertices);
  for (PortVertex& vertex : terms.vertices) {
    for (double& x : vertex.position) {
      x = next();
      x = kPositionUnitM * (x + next());
    }
    for (double& x : vertex.normal) x = next();
    vertex.rows.resize(3, layout(head).modes);
    for (double& x : vertex.rows.reshaped()) x = next();
  }
  terms.triangles.resize(head.triangles);
  for (Triangle& triangle : terms.triangles)
    for (std::uint32_t& corner : triangle) {
      const double index = next();
      if (!(index >= 0 && index < kMaxPortVertices)) return false;
      corner = static_cast<std::uint32_t>(index);
    }
  return true;
}

bool same_whole(const PatchTerms& a, const PatchTerms& b) {
  return a.patch_seq == b.patch_seq && a.pieces == b.pieces && a.variables == b.variables && a.leading == b.leading &&
         a.vertices == b.vertices && a.triangles == b.triangles && a.grasp == b.grasp && a.repaired == b.repaired &&
         a.springs == b.springs && a.stiffening == b.stiffening && a.radius == b.radius && a.port_scale == b.port_scale &&
         a.unit == b.unit;
}

}  // namespace

TermsFault check(const PatchTerms& p) {
  if (p.variables > kMaxVariables || p.springs > kMaxSprings) return TermsFault::sizes;
  if (p.springs > 0 ? p.leading > 0 : p.leading < 1 || p.leading > std::min<int>(kMaxLeading, p.variables))
    return TermsFault::sizes;
  if (p.vertices > (p.grasp ? 0 : kMaxPortVertices) || p.triangles > (p.grasp ? 0 : kMaxPortTriangles)) return TermsFault::sizes;
  const Layout l = layout(p);
  if (l.modes < 1 || l.modes > kMaxModes || p.pieces != l.pieces() || p.piece >= p.pieces) return TermsFault::sizes;
  if (static_cast<int>(p.numbers.size()) != std::min(kPieceNumbers, l.total() - p.piece * kPieceNumbers))
    return TermsFault::sizes;
  std::array<float, 10> reals{p.radius, p.stiffening};
  std::copy(p.port_scale.begin(), p.port_scale.end(), reals.begin() + 2);
  std::copy(p.unit.begin(), p.unit.end(), reals.begin() + 5);
  for (const float v : reals)
    if (!std::isfinite(v)) return TermsFault::not_finite;
  if (!std::all_of(p.numbers.begin(), p.numbers.end(), finite_half)) return TermsFault::not_finite;
  const auto within = [](float v, float high) { return v >= 0 && v <= high; };
  const bool fine = within(p.radius, kRadiusMax) && within(p.stiffening, kStiffeningMax) &&
                    std::all_of(p.port_scale.begin(), p.port_scale.end(), [&](float v) { return within(v, kPortScaleMax); }) &&
                    std::all_of(p.unit.begin(), p.unit.end(), [&](float v) { return within(v, kUnitMax); });
  return fine ? TermsFault::none : TermsFault::out_of_range;
}

std::vector<PatchTerms> to_pieces(const CubicTerms& terms, std::uint32_t patch_seq) {
  PatchTerms whole;
  whole.patch_seq = patch_seq;
  whole.variables = static_cast<std::uint8_t>(terms.variables);
  whole.leading = static_cast<std::uint8_t>(terms.leading);
  whole.grasp = terms.grasp;
  whole.repaired = terms.e2.size() > 0;
  whole.radius = static_cast<float>(terms.radius);
  whole.springs = static_cast<std::uint8_t>(terms.springs.count());
  whole.stiffening = terms.springs.stiffening;
  whole.vertices = static_cast<std::uint8_t>(terms.vertices.size());
  whole.triangles = static_cast<std::uint8_t>(terms.triangles.size());
  const Layout l = layout(whole);
  std::vector<std::uint16_t> numbers;
  whole.springs > 0 ? append_springs(terms, whole, numbers) : append_polynomials(terms, l, whole, numbers);
  append_surface(terms, numbers);
  whole.pieces = static_cast<std::uint8_t>(l.pieces());
  std::vector<PatchTerms> pieces;
  for (int k = 0; k < l.pieces(); ++k) {
    PatchTerms& piece = pieces.emplace_back(whole);
    piece.piece = static_cast<std::uint8_t>(k);
    const auto begin = numbers.begin() + k * kPieceNumbers;
    piece.numbers.assign(begin, begin + std::min<std::ptrdiff_t>(kPieceNumbers, numbers.end() - begin));
    if (check(piece) != TermsFault::none) return {};
  }
  return pieces;
}

Eigen::VectorXd stamp_rate(const CubicTerms& terms, const Patch& patch) {
  Eigen::VectorXd rate(terms.scale.cols());
  if (terms.grasp) rate.head<3>() = patch.tool_velocity;
  rate.tail(patch.modes()) = patch.q_rate;
  return terms.scale * rate;
}

bool TermsAssembly::take(const PatchTerms& piece) {
  if (!any_ || static_cast<std::int32_t>(piece.patch_seq - head_.patch_seq) > 0) {
    any_ = true;
    head_ = piece;
    missing_ = piece.pieces;
    there_.assign(piece.pieces, 0);
    numbers_.assign(static_cast<std::size_t>(layout(piece).total()), 0);
  }
  if (!same_whole(piece, head_) || there_[piece.piece]) return false;
  there_[piece.piece] = 1;
  --missing_;
  std::copy(piece.numbers.begin(), piece.numbers.end(), numbers_.begin() + piece.piece * kPieceNumbers);
  return true;
}

std::optional<CubicTerms> TermsAssembly::terms_for(const Patch& patch) const {
  const Layout l = layout(head_);
  const bool fits = patch.seq == head_.patch_seq && !patch.constant && patch.modes() == l.modes &&
                    (patch.contact == ContactKind::attach) == head_.grasp;
  if (!any_ || missing_ > 0 || !fits) return std::nullopt;
  CubicTerms terms;
  terms.variables = head_.variables;
  terms.leading = head_.leading;
  terms.grasp = head_.grasp;
  terms.radius = static_cast<double>(head_.radius);
  const int n = head_.variables;
  terms.scale.setZero(n, n);
  int at = 0;
  if (head_.springs > 0 && !take_springs(numbers_, at, head_, terms)) return std::nullopt;
  if (head_.springs == 0) take_polynomials(numbers_, at, head_, terms);
  terms.rate = stamp_rate(terms, patch);
  if (!take_surface(numbers_, at, head_, terms) || !has_room(patch.surface, terms)) return std::nullopt;
  if (terms.triangles.empty() && terms.vertices.empty()) return terms;
  return check(extended(patch, terms)) == PatchFault::none ? std::optional(std::move(terms)) : std::nullopt;
}

}  // namespace palpate
