#include "common/port/terms_pieces.hpp"

#include <algorithm>
#include <cmath>

#include "common/port/packed_numbers.hpp"

namespace palpate {

using namespace packed;

namespace {

constexpr float kUnitMax = 1e6F, kPortScaleMax = 1e6F, kRadiusMax = 1e4F, kStiffeningMax = 1e4F;

constexpr unsigned kCornerBits = 5;
static_assert(kMaxPortVertices <= 1 << kCornerBits);

/// How many numbers of each kind there are, and words of 16 bits that are not halves: those stand behind `first` halves, and at
/// the end.
struct Layout {
  int modes, turning;
  std::array<int, 5> count;
  int first, packed, after, last;
  int total() const { return first + packed + after + last; }
  int pieces() const { return (total() + kPieceNumbers - 1) / kPieceNumbers; }
  bool is_half(int at) const { return at < first || (at >= first + packed && at < first + packed + after); }
};

constexpr int kHalvesOfSurface = 7, kHalvesOfVertex = 4;  // a length and a place; a step and a normal

/// With the surface behind what there is of the terms.
Layout with_surface(Layout l, const PatchTerms& p) {
  if (p.vertices > 0) {
    l.after += kHalvesOfSurface + l.modes + kHalvesOfVertex * p.vertices;
    l.last += words_of_bytes(3 * l.modes * p.vertices) + words_of_bytes(p.vertices) + 3 * p.vertices;
  }
  l.last += p.triangles;
  return l;
}

Layout springs_layout(const PatchTerms& p) {
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), m = p.springs;
  const int packed = words_of_bytes(3 * r * p.nodes) + words_of_bytes(p.nodes) + 3 * p.nodes + 2 * m +
                     (p.stiffening > 0 ? words_of_bytes(m) : 0);
  const int e2 = p.repaired ? pairs_of(n) : 0;
  return with_surface({r, 0, {r, 0, m, m, e2}, r + p.nodes + 2 * m, packed, e2, 0}, p);
}

Layout tetrahedra_layout(const PatchTerms& p) {
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), m = p.tetrahedra;
  const int packed = words_of_bytes(3 * r * p.nodes) + words_of_bytes(p.nodes) + 6 * p.nodes + 2 * m;
  const int e2 = p.repaired ? pairs_of(n) : 0;
  return with_surface({r, 0, {r, 0, m, m, e2}, r + p.nodes + 3 * m, packed, e2, 0}, p);
}

Layout layout(const PatchTerms& p) {
  if (p.springs > 0) return springs_layout(p);
  if (p.tetrahedra > 0) return tetrahedra_layout(p);
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), t = std::min<int>(p.leading, kTurning);
  const std::array<int, 5> count{r * r, p.repaired ? pairs_of(n) : 0, triples_of(n), quadruples_of(p.leading), t * pairs_of(t)};
  const int packed = words_of_twelve(count[2]) + words_of_twelve(count[3]) + words_of_twelve(count[4]);
  return with_surface({r, t, count, r * r + count[1], packed, 0, 0}, p);
}

/// Nothing of the terms yet, the largest surface that a touch may bring.
PatchTerms surface_for(const TermsRoom& room) {
  PatchTerms whole;
  whole.variables = static_cast<std::uint8_t>(room.variables);
  whole.grasp = room.grasp;
  whole.repaired = room.repaired;
  whole.vertices = static_cast<std::uint8_t>(room.grasp ? 0 : kMaxPortVertices - room.vertices);
  whole.triangles = static_cast<std::uint8_t>(room.grasp ? 0 : kMaxPortTriangles - 1);
  return whole;
}

void append_polynomials(const CubicTerms& terms, const Layout& l, PatchTerms& head, std::vector<std::uint16_t>& out) {
  if (terms.grasp)
    for (int i = 0; i < 3; ++i) head.port_scale[static_cast<std::size_t>(i)] = static_cast<float>(terms.scale(i, i));
  const Eigen::MatrixXf rows = terms.scale.bottomRightCorner(l.modes, l.modes).transpose().cast<float>();
  const Eigen::MatrixXf q = terms.q.topLeftCorner(l.turning, pairs_of(l.turning));
  head.unit = {append(rows.reshaped(), out), append(terms.e2, out), append_twelve(terms.e3, out), append_twelve(terms.e4, out),
               append_twelve(q.reshaped(), out)};
}

constexpr float kPlaceMost = 32767;

void append_steps(const NodeMotion& motion, PatchTerms& head, std::vector<std::uint16_t>& out) {
  head.unit[0] = append(motion.scale, out);
  for (const float step : motion.step) out.push_back(to_half(step));
}

void append_motion(const NodeMotion& motion, std::vector<std::uint16_t>& out) {
  const auto bytes = motion.bytes.reshaped();
  append_bytes(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), out);
  append_bytes(motion.parent, out);
}

/// From the middle of all.
Eigen::Matrix3Xf places_of(const Eigen::Matrix3Xf& position) {
  const Eigen::Vector3f middle = 0.5F * (position.rowwise().minCoeff() + position.rowwise().maxCoeff());
  return position.colwise() - middle;
}

float length_unit(float most) { return std::exp2(std::ceil(std::log2(std::max(most, 1e-20F)))); }

void append_places(const Eigen::Matrix3Xf& place, float unit, std::vector<std::uint16_t>& out) {
  for (const float x : place.reshaped())
    out.push_back(static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(x / unit))));
}

void append_springs(const CubicTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out) {
  constexpr float kLengthMost = 65535;
  const SampledSprings& springs = terms.springs;
  append_steps(springs.motion, head, out);
  head.unit[2] = append(springs.stiffness, out);
  head.unit[3] = append(springs.damping, out);
  append_motion(springs.motion, out);
  const Eigen::Matrix3Xf place = places_of(springs.position);
  const float unit = head.unit[1] =
      length_unit(std::max(place.cwiseAbs().maxCoeff() / kPlaceMost, springs.rest_length.maxCoeff() / kLengthMost));
  append_places(place, unit, out);
  for (const float length : springs.rest_length)
    out.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(length / unit, 0.0F, kLengthMost))));
  for (const auto& ends : springs.ends.colwise()) out.push_back(static_cast<std::uint16_t>(ends[0] | ends[1] << 8U));
  append_bytes(springs.steep, out);
  head.unit[4] = append(terms.e2, out);
}

void append_tetrahedra(const CubicTerms& terms, PatchTerms& head, std::vector<std::uint16_t>& out) {
  const SampledTetrahedra& solid = terms.solid;
  append_steps(solid.motion, head, out);
  head.unit[2] = append(solid.shear, out);
  head.unit[3] = append(solid.dilation, out);
  for (const float t : solid.damping_s) out.push_back(to_half(t));
  append_motion(solid.motion, out);
  const Eigen::Matrix3Xf place = places_of(solid.position), rest = places_of(solid.rest);
  head.unit[1] = length_unit(std::max(place.cwiseAbs().maxCoeff(), rest.cwiseAbs().maxCoeff()) / kPlaceMost);
  append_places(place, head.unit[1], out);
  append_places(rest, head.unit[1], out);
  for (const auto& nodes : solid.nodes.colwise()) {
    out.push_back(static_cast<std::uint16_t>(nodes[0] | nodes[1] << 8U));
    out.push_back(static_cast<std::uint16_t>(nodes[2] | nodes[3] << 8U));
  }
  head.unit[4] = append(terms.e2, out);
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

void take_steps(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, NodeMotion& motion) {
  motion.tool = head.tool == kNoNode ? -1 : head.tool;
  motion.tool_axes = head.tool_axes;
  motion.scale = take(numbers, at, layout(head).modes, head.unit[0]);
  motion.step = take(numbers, at, head.nodes, 1);
}

/// False when a node is no node's.
bool take_motion(const std::vector<std::uint16_t>& numbers, int& at, int modes, int nodes, NodeMotion& motion) {
  motion.bytes.resize(modes, 3 * nodes);
  const std::vector<std::uint8_t> bytes = take_bytes(numbers, at, 3 * modes * nodes);
  std::transform(bytes.begin(), bytes.end(), motion.bytes.reshaped().begin(),
                 [](std::uint8_t b) { return static_cast<std::int8_t>(b); });
  motion.parent = take_bytes(numbers, at, nodes);
  bool fine = motion.tool < nodes;
  for (int i = 0; i < nodes; ++i) fine &= motion.parent[static_cast<std::size_t>(i)] <= i;
  return fine;
}

Eigen::Matrix3Xf take_places(const std::vector<std::uint16_t>& numbers, int& at, int nodes, float unit) {
  Eigen::Matrix3Xf places(3, nodes);
  for (float& x : places.reshaped())
    x = unit * static_cast<float>(static_cast<std::int16_t>(numbers[static_cast<std::size_t>(at++)]));
  return places;
}

/// False when one is not what a spring, or a node, can be.
bool take_springs(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, CubicTerms& terms) {
  const Layout l = layout(head);
  const int m = head.springs, nodes = head.nodes;
  SampledSprings& springs = terms.springs;
  terms.scale.setIdentity();
  springs.stiffening = head.stiffening;
  take_steps(numbers, at, head, springs.motion);
  springs.stiffness = take(numbers, at, m, head.unit[2]);
  springs.damping = take(numbers, at, m, head.unit[3]);
  const bool fine = take_motion(numbers, at, l.modes, nodes, springs.motion);
  springs.position = take_places(numbers, at, head.nodes, head.unit[1]);
  const auto next = [&] { return numbers[static_cast<std::size_t>(at++)]; };
  springs.rest_length.resize(m);
  for (float& length : springs.rest_length) length = head.unit[1] * static_cast<float>(next());
  springs.ends.resize(2, m);
  for (int e = 0; e < m; ++e) {
    const unsigned word = next();
    springs.ends(0, e) = static_cast<int>(word & 0xffU);
    springs.ends(1, e) = static_cast<int>(word >> 8U);
  }
  if (springs.stiffening > 0) springs.steep = take_bytes(numbers, at, m);
  terms.e2 = take(numbers, at, l.count[4], head.unit[4]);
  return fine && springs.ends.maxCoeff() < nodes && springs.rest_length.minCoeff() > 0 && springs.stiffness.minCoeff() >= 0 &&
         springs.damping.minCoeff() >= 0;
}

/// False when one is not what a tetrahedron, or a node, can be.
bool take_tetrahedra(const std::vector<std::uint16_t>& numbers, int& at, const PatchTerms& head, CubicTerms& terms) {
  const Layout l = layout(head);
  const int m = head.tetrahedra, nodes = head.nodes;
  SampledTetrahedra& solid = terms.solid;
  terms.scale.setIdentity();
  solid.law = head.corotational ? SolidLaw::corotational : SolidLaw::neo_hookean;
  take_steps(numbers, at, head, solid.motion);
  solid.shear = take(numbers, at, m, head.unit[2]);
  solid.dilation = take(numbers, at, m, head.unit[3]);
  solid.damping_s = take(numbers, at, m, 1);
  if (!take_motion(numbers, at, l.modes, nodes, solid.motion)) return false;
  solid.position = take_places(numbers, at, head.nodes, head.unit[1]);
  solid.rest = take_places(numbers, at, head.nodes, head.unit[1]);
  solid.nodes.resize(4, m);
  for (int e = 0; e < m; ++e)
    for (int pair = 0; pair < 2; ++pair) {
      const unsigned word = numbers[static_cast<std::size_t>(at++)];
      solid.nodes(2 * pair, e) = static_cast<int>(word & 0xffU);
      solid.nodes(2 * pair + 1, e) = static_cast<int>(word >> 8U);
    }
  terms.e2 = take(numbers, at, l.count[4], head.unit[4]);
  if (solid.nodes.maxCoeff() >= nodes || solid.shear.minCoeff() < 0 || solid.dilation.minCoeff() < 0 ||
      solid.damping_s.minCoeff() < 0)
    return false;
  for (int e = 0; e < m; ++e) {
    float volume = 0;
    if (!solid.gradients(e, volume).allFinite() || !(volume > 0)) return false;
  }
  return true;
}

Eigen::Matrix3Xd positions_of(const std::vector<PortVertex>& vertices) {
  Eigen::Matrix3Xd x(3, vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) x.col(static_cast<Eigen::Index>(i)) = vertices[i].position;
  return x;
}

/// 3 rows a vertex.
Eigen::MatrixXf rows_of(const std::vector<PortVertex>& vertices, int modes) {
  Eigen::MatrixXf rows(3 * vertices.size(), modes);
  for (std::size_t i = 0; i < vertices.size(); ++i)
    rows.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = vertices[i].rows.cast<float>();
  return rows;
}

bool is_finite(const std::vector<PortVertex>& vertices) {
  return std::all_of(vertices.begin(), vertices.end(),
                     [](const PortVertex& v) { return v.position.allFinite() && v.rows.allFinite(); });
}

constexpr double kPlaceUnitM = 1.0 / 1024;

void append_surface(const CubicTerms& terms, std::vector<std::uint16_t>& out) {
  const auto add = [&](double v) {
    out.push_back(to_half(static_cast<float>(v)));
    return static_cast<double>(from_half(out.back()));
  };
  if (!terms.vertices.empty()) {
    const Eigen::Matrix3Xd x = positions_of(terms.vertices);
    const Vec3 low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff();
    constexpr double kLeastUnitM = 0x1p-24;
    const double reach = (high - low).maxCoeff() / 2 + kPlaceUnitM;  // of what may be rounded away from the middle
    const double unit = add(std::max<double>(length_unit(static_cast<float>(reach) / kPlaceMost), kLeastUnitM));
    Vec3 middle;
    for (int axis = 0; axis < 3; ++axis) {
      const double m = (low[axis] + high[axis]) / (2 * kPlaceUnitM), most = add(m);
      middle[axis] = kPlaceUnitM * (most + add(m - most));
    }
    const NodeMotion motion = rounded(rows_of(terms.vertices, static_cast<int>(terms.vertices.front().rows.cols())), -1);
    for (const float scale : motion.scale) add(scale);
    for (const float step : motion.step) add(step);
    for (const PortVertex& vertex : terms.vertices)
      for (const double n : vertex.normal) add(n);
    append_motion(motion, out);
    append_places((x.colwise() - middle).cast<float>(), static_cast<float>(unit), out);
  }
  for (const Triangle& triangle : terms.triangles) out.push_back(pack_corners(triangle));
}

/// False when a corner is no vertex of any surface, or a vertex moves with one that is none before it.
bool take_surface(const std::vector<std::uint16_t>& numbers, int at, const PatchTerms& head, CubicTerms& terms) {
  const auto next = [&] { return static_cast<double>(from_half(numbers[static_cast<std::size_t>(at++)])); };
  const int modes = layout(head).modes, count = head.vertices;
  terms.vertices.resize(head.vertices);
  if (count > 0) {
    const double unit = next();
    Vec3 middle;
    for (double& m : middle) {
      m = next();
      m = kPlaceUnitM * (m + next());
    }
    NodeMotion motion;
    motion.scale = take(numbers, at, modes, 1);
    motion.step = take(numbers, at, count, 1);
    for (PortVertex& vertex : terms.vertices)
      for (double& n : vertex.normal) n = next();
    if (!take_motion(numbers, at, modes, count, motion)) return false;
    const Eigen::MatrixXd rows = motion.rows(0).cast<double>();
    const Eigen::Matrix3Xd places = take_places(numbers, at, count, static_cast<float>(unit)).cast<double>();
    for (int i = 0; i < count; ++i) {
      PortVertex& vertex = terms.vertices[static_cast<std::size_t>(i)];
      vertex.position = middle + places.col(i);
      vertex.rows = rows.middleRows<3>(3 * i);
    }
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
         a.springs == b.springs && a.tetrahedra == b.tetrahedra && a.corotational == b.corotational && a.nodes == b.nodes &&
         a.tool == b.tool && a.tool_axes == b.tool_axes && a.stiffening == b.stiffening && a.radius == b.radius &&
         a.port_scale == b.port_scale && a.unit == b.unit;
}

}  // namespace

TermsFault check(const PatchTerms& p) {
  if (p.variables > kMaxVariables || p.springs > kMaxSprings || p.tetrahedra > kMaxTetrahedra) return TermsFault::sizes;
  if ((p.springs > 0 && p.tetrahedra > 0) || (p.corotational && p.tetrahedra == 0)) return TermsFault::sizes;
  if (p.sampled() ? p.nodes == 0 || p.nodes > kMaxSpringNodes || p.tool_axes > 3 : p.nodes > 0) return TermsFault::sizes;
  if (p.sampled() ? p.leading > 0 : p.leading < 1 || p.leading > std::min<int>(kMaxLeading, p.variables))
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

int leading_that_fit(const TermsRoom& room, int most) {
  PatchTerms whole = surface_for(room);
  for (; most > 0; --most) {
    whole.leading = static_cast<std::uint8_t>(most);
    if (layout(whole).pieces() <= kUsualPieces) break;
  }
  return most;
}

int numbers_of_springs(const TermsRoom& room, int nodes, int springs) {
  PatchTerms whole = surface_for(room);
  whole.nodes = static_cast<std::uint8_t>(nodes);
  whole.springs = static_cast<std::uint8_t>(springs);
  whole.stiffening = room.stiffens ? 1 : 0;
  return springs_layout(whole).total();
}

int numbers_of_tetrahedra(const TermsRoom& room, int nodes, int tetrahedra) {
  PatchTerms whole = surface_for(room);
  whole.nodes = static_cast<std::uint8_t>(nodes);
  whole.tetrahedra = static_cast<std::uint8_t>(tetrahedra);
  return tetrahedra_layout(whole).total();
}

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
  whole.tetrahedra = static_cast<std::uint8_t>(terms.solid.count());
  whole.corotational = whole.tetrahedra > 0 && terms.solid.law == SolidLaw::corotational;
  whole.stiffening = terms.springs.stiffening;
  const NodeMotion& motion = whole.tetrahedra > 0 ? terms.solid.motion : terms.springs.motion;
  whole.nodes = static_cast<std::uint8_t>(motion.nodes());
  whole.tool_axes = static_cast<std::uint8_t>(motion.tool_axes);
  whole.tool = motion.tool < 0 ? kNoNode : static_cast<std::uint8_t>(motion.tool);
  whole.vertices = static_cast<std::uint8_t>(terms.vertices.size());
  whole.triangles = static_cast<std::uint8_t>(terms.triangles.size());
  const Layout l = layout(whole);
  // Those whose bits are not all looked at by check().
  if (!terms.e3.allFinite() || !terms.e4.allFinite() || !terms.q.allFinite() || !terms.springs.position.allFinite() ||
      !terms.springs.rest_length.allFinite() || (whole.stiffening > 0 && terms.springs.steep.size() != whole.springs) ||
      !terms.solid.position.allFinite() || !terms.solid.rest.allFinite() || !is_finite(terms.vertices))
    return {};
  std::vector<std::uint16_t> numbers;
  if (whole.springs > 0)
    append_springs(terms, whole, numbers);
  else if (whole.tetrahedra > 0)
    append_tetrahedra(terms, whole, numbers);
  else
    append_polynomials(terms, l, whole, numbers);
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
  const auto take_terms = head_.springs > 0 ? take_springs : head_.tetrahedra > 0 ? take_tetrahedra : take_polynomials;
  if (!take_terms(numbers_, at, head_, terms)) return std::nullopt;
  terms.rate = stamp_rate(terms, patch);
  if (!take_surface(numbers_, at, head_, terms) || !has_room(patch.surface, terms)) return std::nullopt;
  if (terms.triangles.empty() && terms.vertices.empty()) return terms;
  return check(extended(patch, terms)) == PatchFault::none ? std::optional(std::move(terms)) : std::nullopt;
}

}  // namespace palpate
