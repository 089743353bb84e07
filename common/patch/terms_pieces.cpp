#include "common/patch/terms_pieces.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/patch/packed_numbers.hpp"
#include "common/patch/terms_numbers.hpp"

namespace palpate {

using namespace packed;

namespace {

constexpr float kUnitMax = 1e6F, kStiffeningMax = 1e4F;  // unit and c: ranges of the format (docs/reference/wire.md)

/// Returns a head without elements, with the largest surface that a touch may add.
PatchTerms surface_for(const TermsBudget& budget) {
  PatchTerms whole;
  whole.variables = static_cast<std::uint8_t>(budget.variables);
  whole.grasp = budget.grasp;
  whole.repaired = budget.repaired;
  whole.vertices = static_cast<std::uint8_t>(budget.grasp ? 0 : kMaxPortVertices - budget.vertices);
  whole.triangles = static_cast<std::uint8_t>(budget.grasp ? 0 : kMaxPortTriangles - 1);
  return whole;
}

bool is_finite(const std::vector<PortVertex>& vertices) {
  return std::all_of(vertices.begin(), vertices.end(),
                     [](const PortVertex& v) { return v.position.allFinite() && v.rows.allFinite(); });
}

bool same_whole(const PatchTerms& a, const PatchTerms& b) {
  return a.patch_seq == b.patch_seq && a.pieces == b.pieces && a.variables == b.variables && a.vertices == b.vertices &&
         a.triangles == b.triangles && a.grasp == b.grasp && a.repaired == b.repaired && a.solid == b.solid &&
         a.elements == b.elements && a.law == b.law && a.nodes == b.nodes && a.tool == b.tool && a.tool_axes == b.tool_axes &&
         a.stiffening == b.stiffening && a.unit == b.unit;
}

int words_in(int piece, const TermsLayout& l) { return std::min(kPieceNumbers, l.total() - piece * kPieceNumbers); }

/// Checks a law. Parameters that are not sent are 0.
TermsFault check(const LawParameters& law) {
  const Fibres& fibres = law.fibres;
  const std::array<double, 8> all{law.shape,           law.exponents[0],    law.exponents[1], fibres.direction[0],
                                  fibres.direction[1], fibres.direction[2], fibres.share,     fibres.exponent};
  if (!std::all_of(all.begin(), all.end(), [](double v) { return std::isfinite(v); })) return TermsFault::not_finite;
  constexpr double kLengthRounding = 1e-3;  // halves of a direction have a relative error of 5e-4
  const auto within = [](double v, double high) { return v >= 0 && v <= high; };
  constexpr double kFloatRounding = 1e-6;  // the shape is sent in single precision
  const ShapeRange range = shape_range(law.kind);
  bool fine = law.kind < SolidLaw::membrane && law.shape >= (1 - kFloatRounding) * range.low &&
              law.shape <= (1 + kFloatRounding) * range.high && within(fibres.share, kMaxFibreShare) &&
              within(fibres.exponent, kMaxExponent) &&
              std::abs(std::hypot(fibres.direction[0], fibres.direction[1], fibres.direction[2]) - 1) < kLengthRounding;
  for (const double exponent : law.exponents) {
    const double size = std::abs(exponent);
    fine &= law.kind == SolidLaw::ogden ? size >= kMinOgdenExponent && size <= kMaxOgdenExponent : size == 0;
  }
  return fine ? TermsFault::none : TermsFault::out_of_range;
}

}  // namespace

TermsFault check(const PatchTerms& p) {
  if (p.variables > kMaxVariables || p.elements > (p.solid ? kMaxFiniteElements : kMaxSprings)) return TermsFault::sizes;
  if (p.elements == 0 && (p.grasp || p.solid || p.repaired || p.stiffening != 0)) return TermsFault::sizes;  // a surface alone
  if (p.law != LawParameters() && !p.solid) return TermsFault::sizes;
  if ((p.nodes == 0) != (p.elements == 0) || p.nodes > kMaxSampledNodes || p.tool_axes > 3) return TermsFault::sizes;
  if (p.vertices > (p.grasp ? 0 : kMaxPortVertices) || p.triangles > (p.grasp ? 0 : kMaxPortTriangles)) return TermsFault::sizes;
  const TermsLayout l = layout(p);
  if (l.modes < 1 || l.modes > kMaxModes || p.pieces != l.pieces() || p.piece >= p.pieces) return TermsFault::sizes;
  if (static_cast<int>(p.numbers.size()) != words_in(p.piece, l)) return TermsFault::sizes;
  const auto finite = [](float v) { return std::isfinite(v); };
  if (!finite(p.stiffening) || !std::all_of(p.unit.begin(), p.unit.end(), finite)) return TermsFault::not_finite;
  for (std::size_t k = 0; k < p.numbers.size(); ++k)
    if (l.is_half(p.piece * kPieceNumbers + static_cast<int>(k)) && !finite_half(p.numbers[k])) return TermsFault::not_finite;
  if (const TermsFault fault = check(p.law); fault != TermsFault::none) return fault;
  const auto within = [](float v, float high) { return v >= 0 && v <= high; };
  const bool fine = within(p.stiffening, p.solid ? 0 : kStiffeningMax) &&
                    std::all_of(p.unit.begin(), p.unit.end(), [&](float v) { return within(v, kUnitMax); });
  return fine ? TermsFault::none : TermsFault::out_of_range;
}

int numbers_of(const TermsBudget& budget, int nodes, int elements) {
  PatchTerms whole = surface_for(budget);
  whole.nodes = static_cast<std::uint8_t>(nodes);
  whole.solid = budget.solid;
  whole.elements = static_cast<std::uint8_t>(elements);
  whole.stiffening = budget.stiffens ? 1 : 0;
  return layout(whole).total();
}

std::vector<PatchTerms> to_pieces(const NonlinearTerms& terms, std::uint32_t patch_seq) {
  PatchTerms whole;
  whole.patch_seq = patch_seq;
  whole.variables = static_cast<std::uint8_t>(terms.variables);
  whole.grasp = terms.grasp;
  whole.repaired = terms.e2.size() > 0;
  const SampledElements& elements = terms.elements;
  whole.solid = elements.is_solid();
  whole.elements = static_cast<std::uint8_t>(elements.count());
  whole.law = elements.law;
  whole.stiffening = elements.stiffening;
  const NodeMotion& motion = elements.motion;
  whole.nodes = static_cast<std::uint8_t>(motion.nodes());
  whole.tool_axes = static_cast<std::uint8_t>(motion.tool_axes);
  whole.tool = motion.tool < 0 ? kNoHeldNode : static_cast<std::uint8_t>(motion.tool);
  whole.vertices = static_cast<std::uint8_t>(terms.vertices.size());
  whole.triangles = static_cast<std::uint8_t>(terms.triangles.size());
  const TermsLayout l = layout(whole);
  // those whose bits check() does not inspect completely
  if (!elements.position.allFinite() || !elements.rest_length.allFinite() || !elements.rest.allFinite() ||
      (elements.stiffening > 0 && elements.max_slope.size() != whole.elements) || !is_finite(terms.vertices))
    return {};
  std::vector<std::uint16_t> numbers;
  if (whole.elements > 0) append_elements(terms, whole, numbers);
  append_surface(terms, numbers);
  assert(static_cast<int>(numbers.size()) == l.total());
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

Eigen::VectorXd stamp_rate(const Patch& patch) {
  const bool grasp = patch.contact == ContactKind::attach;
  Eigen::VectorXd rate(patch.modes() + (grasp ? 3 : 0));
  if (grasp) rate.head<3>() = patch.tool_velocity;
  rate.tail(patch.modes()) = patch.q_rate;
  return rate;
}

bool TermsAssembly::take(const PatchTerms& piece) {
  if (!any_ || static_cast<std::int32_t>(piece.patch_seq - head_.patch_seq) > 0) {
    any_ = true;
    head_ = piece;
    missing_ = piece.pieces;
    there_.assign(piece.pieces, 0);
    numbers_.assign(there_.size() * kPieceNumbers, 0);
  }
  if (missing_ == 0 || !same_whole(piece, head_) || there_[piece.piece]) return false;
  there_[piece.piece] = 1;
  --missing_;
  std::copy(piece.numbers.begin(), piece.numbers.end(), numbers_.begin() + piece.piece * kPieceNumbers);
  return true;
}

std::optional<NonlinearTerms> TermsAssembly::terms_for(const Patch& patch) const {
  const TermsLayout l = layout(head_);
  const bool fits = patch.seq == head_.patch_seq && !patch.constant && patch.modes() == l.modes &&
                    (patch.contact == ContactKind::attach) == head_.grasp;
  if (!any_ || missing_ > 0 || !fits) return std::nullopt;
  NonlinearTerms terms;
  terms.variables = head_.variables;
  terms.grasp = head_.grasp;
  int at = 0;
  if (head_.elements > 0 && !take_elements(numbers_, at, head_, terms)) return std::nullopt;
  terms.rate = stamp_rate(patch);
  if (!take_surface(numbers_, at, head_, terms) || !has_room(patch.surface, terms)) return std::nullopt;
  if (terms.triangles.empty() && terms.vertices.empty()) return terms;
  return check(extended(patch, terms)) == PatchFault::none ? std::optional(std::move(terms)) : std::nullopt;
}

}  // namespace palpate
