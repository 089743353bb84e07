#include "common/port/terms_pieces.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr float kLargest = 8192;  // of the numbers in their unit
constexpr float kUnitMax = 1e6F, kPortScaleMax = 1e6F, kRadiusMax = 1e4F, kStiffeningMax = 1e4F;

constexpr float kByteMost = 127;
constexpr unsigned kCornerBits = 5;
static_assert(kMaxPortVertices <= 1 << kCornerBits);

/// How many numbers of each kind there are, and words of 16 bits that hold several: those stand behind `first` halves, triangles
/// at the end.
struct Layout {
  int modes, turning;
  std::array<int, 5> count;
  int first, packed, after, triangles;
  int total() const { return first + packed + after + triangles; }
  int pieces() const { return (total() + kPieceNumbers - 1) / kPieceNumbers; }
  bool is_half(int at) const { return at < first || (at >= first + packed && at < first + packed + after); }
};

constexpr int words_of_twelve(int count) { return (3 * count + 3) / 4; }

Layout layout(const PatchTerms& p) {
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), t = std::min<int>(p.leading, kTurning), m = p.springs;
  const int vertices = p.vertices * (9 + 3 * r), e2 = p.repaired ? pairs_of(n) : 0;
  if (m > 0) return {r, 0, {n + m, 4 * m, m, m, e2}, n + m, (3 * n * m + 1) / 2, 6 * m + e2 + vertices, p.triangles};
  const std::array<int, 5> count{r * r, e2, triples_of(n), quadruples_of(p.leading), t * pairs_of(t)};
  const int packed = words_of_twelve(count[2]) + words_of_twelve(count[3]) + words_of_twelve(count[4]);
  return {r, t, count, r * r + e2, packed, vertices, p.triangles};
}

/// The largest `value` up to `most` with which the whole fits into kUsualPieces.
int most_that_fits(const TermsRoom& room, int most, std::uint8_t PatchTerms::*value) {
  PatchTerms whole;
  whole.variables = static_cast<std::uint8_t>(room.variables);
  whole.grasp = room.grasp;
  whole.repaired = room.repaired;
  whole.vertices = static_cast<std::uint8_t>(room.grasp ? 0 : kMaxPortVertices - room.vertices);
  whole.triangles = static_cast<std::uint8_t>(room.grasp ? 0 : kMaxPortTriangles - 1);
  for (; most > 0; --most) {
    whole.*value = static_cast<std::uint8_t>(most);
    if (layout(whole).pieces() <= kUsualPieces) break;
  }
  return most;
}

std::uint16_t to_half(float v) { return Eigen::numext::bit_cast<std::uint16_t>(Eigen::half(v)); }
float from_half(std::uint16_t v) { return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(v)); }
bool finite_half(std::uint16_t v) { return (v & 0x7c00U) != 0x7c00U; }

template <class Values>
float unit_of(const Values& values) {
  const float largest = values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0;
  return largest > 0 ? largest / kLargest : 1;
}

/// Appends numbers in a unit that suits their largest.
template <class Values>
float append(const Values& values, std::vector<std::uint16_t>& out) {
  const float unit = unit_of(values);
  for (Eigen::Index i = 0; i < values.size(); ++i) out.push_back(to_half(values[i] / unit));
  return unit;
}

/// The next numbers, in their unit.
Eigen::VectorXf take(const std::vector<std::uint16_t>& numbers, int& at, int count, float unit) {
  Eigen::VectorXf values(count);
  for (int i = 0; i < count; ++i) values[i] = unit * from_half(numbers[static_cast<std::size_t>(at++)]);
  return values;
}

/// G^T, three columns a spring. Returns the unit of the variables' scales.
float append_motion(const Eigen::MatrixXf& g, std::vector<std::uint16_t>& out) {
  const Eigen::Index springs = g.cols() / 3;
  const auto first = static_cast<int>(out.size());
  const float unit = append(Eigen::VectorXf(g.cwiseAbs().rowwise().maxCoeff()), out);
  int at = first;
  const Eigen::VectorXf scale = take(out, at, static_cast<int>(g.rows()), unit);  // as it travels
  const Eigen::MatrixXf of_scale = scale.unaryExpr([](float v) { return v > 0 ? 1 / v : 0.0F; }).asDiagonal() * g;
  std::vector<std::int8_t> bytes;
  for (Eigen::Index e = 0; e < springs; ++e) {
    const auto part = of_scale.middleCols<3>(3 * e);
    out.push_back(to_half(part.cwiseAbs().maxCoeff()));
    const float step = from_half(out.back()) / kByteMost;
    for (const float v : part.reshaped())
      bytes.push_back(static_cast<std::int8_t>(step > 0 ? std::clamp(std::round(v / step), -kByteMost, kByteMost) : 0.0F));
  }
  bytes.resize((bytes.size() + 1) / 2 * 2);
  for (std::size_t k = 0; k < bytes.size(); k += 2)
    out.push_back(
        static_cast<std::uint16_t>(static_cast<std::uint8_t>(bytes[k]) | static_cast<std::uint8_t>(bytes[k + 1]) << 8U));
  return unit;
}

/// G.
Eigen::MatrixXf take_motion(const std::vector<std::uint16_t>& numbers, int& at, int variables, int springs, float unit) {
  const Eigen::VectorXf scale = take(numbers, at, variables, unit), largest = take(numbers, at, springs, 1);
  Eigen::MatrixXf g(variables, 3 * springs);
  for (Eigen::Index k = 0; k < g.size(); ++k) {
    const auto two = numbers[static_cast<std::size_t>(at + k / 2)];
    const auto byte = static_cast<std::int8_t>(static_cast<std::uint8_t>(k % 2 == 0 ? two : two >> 8U));
    g.reshaped()[k] = byte * (largest[k / (3 * variables)] / kByteMost) * scale[k % variables];
  }
  at += static_cast<int>((g.size() + 1) / 2);
  return g.transpose();
}

/// Appends numbers of 12 bits, four in three words, the first lowest.
template <class Values>
float append_twelve(const Values& values, std::vector<std::uint16_t>& out) {
  const float unit = unit_of(values);
  std::uint32_t bits = 0;
  int filled = 0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    bits |= ((to_half(values[i] / unit) + 8U) >> 4U) << filled;  // to the nearest
    filled += 12;
    if (filled < 16) continue;
    out.push_back(static_cast<std::uint16_t>(bits));
    bits >>= 16U;
    filled -= 16;
  }
  if (filled > 0) out.push_back(static_cast<std::uint16_t>(bits));
  return unit;
}

Eigen::VectorXf take_twelve(const std::vector<std::uint16_t>& numbers, int& at, int count, float unit) {
  Eigen::VectorXf values(count);
  for (int i = 0; i < count; ++i) {
    const auto word = static_cast<std::size_t>(at + 3 * i / 4);
    const unsigned low = static_cast<unsigned>(i) % 4 * 12 % 16, two = low > 4 ? numbers[word + 1] : 0U;
    values[i] = unit * from_half(static_cast<std::uint16_t>(((numbers[word] | two << 16U) >> low) << 4U));
  }
  at += words_of_twelve(count);
  return values;
}

void append_polynomials(const CubicTerms& terms, const Layout& l, PatchTerms& head, std::vector<std::uint16_t>& out) {
  if (terms.grasp)
    for (int i = 0; i < 3; ++i) head.port_scale[static_cast<std::size_t>(i)] = static_cast<float>(terms.scale(i, i));
  const Eigen::MatrixXf rows = terms.scale.bottomRightCorner(l.modes, l.modes).transpose().cast<float>();
  const Eigen::MatrixXf q = terms.q.topLeftCorner(l.turning, pairs_of(l.turning));
  head.unit = {append(rows.reshaped(), out), append(terms.e2, out), append_twelve(terms.e3, out), append_twelve(terms.e4, out),
               append_twelve(q.reshaped(), out)};
}

void append_springs(const CubicTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out) {
  const SampledSprings& springs = terms.springs;
  Eigen::MatrixXf lengths(4, springs.count());
  lengths << springs.span, springs.rest_length.transpose();
  head.unit = {append_motion(springs.motion.transpose(), out), append(lengths.reshaped(), out), append(springs.stiffness, out),
               append(springs.damping, out), append(terms.e2, out)};
}

/// False when a number is not finite.
bool take_polynomials(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, CubicTerms& terms) {
  const Layout l = layout(head);
  if (terms.grasp)
    for (int i = 0; i < 3; ++i) terms.scale(i, i) = static_cast<double>(head.port_scale[static_cast<std::size_t>(i)]);
  terms.scale.bottomRightCorner(l.modes, l.modes) =
      take(numbers, at, l.count[0], head.unit[0]).reshaped(l.modes, l.modes).transpose().cast<double>();
  terms.e2 = take(numbers, at, l.count[1], head.unit[1]);
  terms.e3 = take_twelve(numbers, at, l.count[2], head.unit[2]);
  terms.e4 = take_twelve(numbers, at, l.count[3], head.unit[3]);
  terms.q.setZero(terms.leading, pairs_of(terms.leading));
  terms.q.topLeftCorner(l.turning, pairs_of(l.turning)) =
      take_twelve(numbers, at, l.count[4], head.unit[4]).reshaped(l.turning, pairs_of(l.turning));
  return terms.e3.allFinite() && terms.e4.allFinite() && terms.q.allFinite();
}

/// False when one is not what a spring can be.
bool take_springs(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, CubicTerms& terms) {
  const Layout l = layout(head);
  const int n = head.variables, m = head.springs;
  SampledSprings& springs = terms.springs;
  terms.scale.setIdentity();
  springs.stiffening = head.stiffening;
  springs.motion = take_motion(numbers, at, n, m, head.unit[0]);
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
  for (const Triangle& triangle : terms.triangles) out.push_back(pack_corners(triangle));
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
  for (Triangle& triangle : terms.triangles) {
    triangle = unpack_corners(numbers[static_cast<std::size_t>(at++)]);
    for (const std::uint32_t corner : triangle)
      if (corner >= static_cast<std::uint32_t>(kMaxPortVertices)) return false;
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
  for (std::size_t k = 0; k < p.numbers.size(); ++k)
    if (l.is_half(p.piece * kPieceNumbers + static_cast<int>(k)) && !finite_half(p.numbers[k])) return TermsFault::not_finite;
  const auto within = [](float v, float high) { return v >= 0 && v <= high; };
  const bool fine = within(p.radius, kRadiusMax) && within(p.stiffening, kStiffeningMax) &&
                    std::all_of(p.port_scale.begin(), p.port_scale.end(), [&](float v) { return within(v, kPortScaleMax); }) &&
                    std::all_of(p.unit.begin(), p.unit.end(), [&](float v) { return within(v, kUnitMax); });
  return fine ? TermsFault::none : TermsFault::out_of_range;
}

int springs_that_fit(const TermsRoom& room) { return most_that_fits(room, kMaxSprings, &PatchTerms::springs); }
int leading_that_fit(const TermsRoom& room, int most) { return most_that_fits(room, most, &PatchTerms::leading); }

std::uint16_t pack_corners(const Triangle& triangle) {
  return static_cast<std::uint16_t>(triangle[0] | triangle[1] << kCornerBits | triangle[2] << 2 * kCornerBits);
}
Triangle unpack_corners(std::uint16_t bits) {
  constexpr std::uint32_t mask = (1U << kCornerBits) - 1;
  return {bits & mask, bits >> kCornerBits & mask, bits >> 2 * kCornerBits & mask};
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
  // Those whose bits are not all looked at by check().
  if (!terms.e3.allFinite() || !terms.e4.allFinite() || !terms.q.allFinite() || !terms.springs.motion.allFinite()) return {};
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
  if (!(head_.springs > 0 ? take_springs : take_polynomials)(numbers_, at, head_, terms)) return std::nullopt;
  terms.rate = stamp_rate(terms, patch);
  if (!take_surface(numbers_, at, head_, terms) || !has_room(patch.surface, terms)) return std::nullopt;
  if (terms.triangles.empty() && terms.vertices.empty()) return terms;
  return check(extended(patch, terms)) == PatchFault::none ? std::optional(std::move(terms)) : std::nullopt;
}

}  // namespace palpate
