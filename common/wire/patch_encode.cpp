#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "common/patch/packed_numbers.hpp"
#include "common/wire/patch_wire.hpp"

namespace palpate {
namespace {

template <class T, std::size_t n>
class Bounded {
 public:
  void add(T value) { items_[count_++] = value; }
  std::size_t size() const { return count_; }
  const T* data() const { return items_.data(); }

 private:
  std::array<T, n> items_{};
  std::size_t count_ = 0;
};
using Floats = Bounded<float, static_cast<std::size_t>(attach_floats(kMaxModes))>;
using Normals = Bounded<std::uint16_t, 2 * static_cast<std::size_t>(kMaxPortVertices)>;
using Shorts = Bounded<std::int16_t, static_cast<std::size_t>(mode_shorts(kMaxModes) +
                                                              surface_shorts(kMaxModes, kMaxPortVertices) + kMaxPortTriangles)>;

using OtherRows = Bounded<std::int16_t, static_cast<std::size_t>(3 * kMaxModes * kMaxOtherContacts)>;
using NeedleRows = Bounded<std::int16_t, static_cast<std::size_t>(3 * kMaxModes * kNeedlePoints)>;
using SutureRows = Bounded<std::int16_t, static_cast<std::size_t>(3 * kMaxModes * kMaxBites)>;

bool has_modes_in_order(const Patch& patch) {
  const auto r = patch.stiffness.size();
  if (patch.damping.rows() != r || patch.damping.cols() != r || patch.g.size() != r || patch.q_rate.size() != r) return false;
  if (patch.load_rate.size() != 0 && patch.load_rate.size() != r) return false;
  for (const PatchBranch& branch : patch.fading.branches())
    if (branch.pull.size() != (patch.contact == ContactKind::attach ? r + 3 : r) || !branch.pull.allFinite()) return false;
  if (patch.contact == ContactKind::attach) return patch.b_k.rows() == r && patch.b_d.rows() == r;
  const auto& surface = patch.surface;
  if (surface.vertex_count < 1 || surface.vertex_count > kMaxPortVertices) return false;
  if (surface.triangle_count < 0 || surface.triangle_count > kMaxPortTriangles) return false;
  for (int i = 0; i < surface.vertex_count; ++i)
    if (surface.vertices[static_cast<std::size_t>(i)].rows.cols() != r) return false;
  if (patch.others.count < 0 || patch.others.count > kMaxOtherContacts) return false;
  if (patch.others.own < 0 || patch.others.own > (patch.turn ? patch.others.count : 0)) return false;
  if (patch.needle.layers.count < 0 || patch.needle.layers.count > (patch.turn ? kMaxNeedleLayers : 0)) return false;
  for (const PatchNeedle::Point& point : patch.needle.points)
    if (!patch.needle.empty() && point.rows.cols() != r) return false;
  if (patch.suture.law.bites < 0 || patch.suture.law.bites > kMaxBites) return false;
  for (const PatchSuture::Bite& bite : patch.suture.all())
    if (bite.rows.cols() != r) return false;
  return std::ranges::all_of(patch.others.tools(), [&](const OtherContact& other) { return other.rows.cols() == r; });
}

/// Checked before numbers are scaled to 16 bits: their maximum is meaningless when one is not finite.
bool has_finite_surface(const Patch& patch) {
  if (!patch.q_rate.allFinite() || !patch.point.weight.allFinite()) return false;
  for (const auto& vertex : std::span(patch.surface.vertices).first(static_cast<std::size_t>(patch.surface.vertex_count)))
    if (!vertex.position.allFinite() || !vertex.rows.allFinite() || !vertex.normal.allFinite()) return false;
  for (const PatchNeedle::Point& point : patch.needle.points)
    if (!patch.needle.empty() && !point.rows.allFinite()) return false;
  for (const PatchSuture::Bite& bite : patch.suture.all())
    if (!bite.rows.allFinite()) return false;
  return std::ranges::all_of(patch.others.tools(), [](const OtherContact& other) {
    return other.rows.allFinite() && other.normal.allFinite() && other.velocity.allFinite() && other.acceleration.allFinite();
  });
}

void add_modes(Floats& floats, Shorts& shorts, pack::Packer& packer, const Patch& patch) {
  const int r = patch.modes();
  if (r == 0) return;
  for (int i = 0; i < r; ++i) floats.add(packer.number(patch.stiffness[i]));
  Eigen::Matrix<float, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxModes, 1> own(r);
  for (int i = 0; i < r; ++i) own[i] = packer.number(patch.damping(i, i));
  const float unit = packed::unit_of(own);
  floats.add(unit);
  for (float& d : own) {
    std::uint16_t half = packed::to_half(d / unit);
    if (unit * packed::from_half(half) < d) ++half;  // upwards: more damping keeps D, and D with B_d, semi-definite
    shorts.add(static_cast<std::int16_t>(half));
    d = unit * packed::from_half(half);  // as received
  }
  for (const ModeVector* v : {&patch.g, &patch.q_rate}) {
    const float step = pack::short_step(packer.number(v->cwiseAbs().maxCoeff()));
    floats.add(step);
    for (int i = 0; i < r; ++i) shorts.add(packer.ok() ? pack::to_short((*v)[i], step) : std::int16_t{0});
  }
  for (int i = 0; i < r; ++i)
    for (int j = 0; j < i; ++j) {
      const double both = std::sqrt(static_cast<double>(own[i]) * own[j]);
      const double coupling = 0.5 * (patch.damping(i, j) + patch.damping(j, i));
      packer.require(std::isfinite(coupling));
      shorts.add(both > 0 && packer.ok() ? pack::to_short(coupling / both, pack::kCouplingStep) : std::int16_t{0});
    }
}

void add_port(Floats& floats, pack::Packer& packer, const ModePort& port) {
  for (int i = 0; i < port.rows(); ++i)
    for (int k = 0; k < 3; ++k) floats.add(packer.number(port(i, k)));
}

std::int16_t pack_triangle(pack::Packer& packer, const Triangle& triangle) {
  for (const auto index : triangle) packer.require(index < kMaxPortVertices);
  return packer.ok() ? static_cast<std::int16_t>(pack_corners(triangle)) : std::int16_t{0};
}

/// Returns no normals at all where every vertex has the normal of its triangles.
Normals normals_of(const PortSurface& surface) {
  const auto vertices = std::span(surface.vertices).first(static_cast<std::size_t>(surface.vertex_count));
  Normals normals;
  if (std::all_of(vertices.begin(), vertices.end(), [](const PortVertex& vertex) { return vertex.normal.isZero(0); }))
    return normals;
  for (const PortVertex& vertex : vertices)
    for (const std::uint16_t part : pack_normal(vertex.normal)) normals.add(part);
  return normals;
}

/// Returns the exponent of the least power of two that a number of `most` needs as the step of its short.
int step_exponent(double most) { return static_cast<int>(std::ceil(std::log2(pack::short_step(most)))); }

/// Adds the moving surface. Returns the step of positions.
float add_surface(Shorts& shorts, OtherRows& other_rows, NeedleRows& needle_rows, SutureRows& suture_rows, pack::Packer& packer,
                  const Patch& patch, const Vec3& origin) {
  const int r = patch.modes();
  const auto vertices = std::span(patch.surface.vertices).first(static_cast<std::size_t>(patch.surface.vertex_count));
  std::array<float, kMaxModes> row_step{};
  for (int m = 0; m < r; ++m) {
    double largest = 0;
    for (const auto& vertex : vertices) largest = std::max(largest, vertex.rows.col(m).cwiseAbs().maxCoeff());
    for (const OtherContact& other : patch.others.of_other_tools())
      largest = std::max(largest, other.rows.col(m).cwiseAbs().maxCoeff());
    for (const PatchNeedle::Point& point : patch.needle.points)
      if (!patch.needle.empty()) largest = std::max(largest, point.rows.col(m).cwiseAbs().maxCoeff());
    for (const PatchSuture::Bite& bite : patch.suture.all()) largest = std::max(largest, bite.rows.col(m).cwiseAbs().maxCoeff());
    const int exponent = step_exponent(packer.number(largest));
    shorts.add(static_cast<std::int16_t>(exponent));
    row_step[static_cast<std::size_t>(m)] = std::ldexp(1.0F, exponent);
  }
  double reach = 0;
  for (const auto& vertex : vertices.subspan(1)) reach = std::max(reach, (vertex.position - origin).cwiseAbs().maxCoeff());
  const float step = pack::short_step(packer.number(reach));
  for (const auto& vertex : vertices.subspan(1))
    for (int k = 0; k < 3; ++k) shorts.add(pack::to_short(vertex.position[k] - origin[k], step));
  for (const auto& vertex : vertices)
    for (int m = 0; m < r; ++m)
      for (int k = 0; k < 3; ++k) shorts.add(pack::to_short(vertex.rows(k, m), row_step[static_cast<std::size_t>(m)]));
  for (int t = 0; t < patch.surface.triangle_count; ++t)
    shorts.add(pack_triangle(packer, patch.surface.triangles[static_cast<std::size_t>(t)]));
  for (const OtherContact& other : patch.others.of_other_tools())
    for (int m = 0; m < r; ++m)
      for (int k = 0; k < 3; ++k) other_rows.add(pack::to_short(other.rows(k, m), row_step[static_cast<std::size_t>(m)]));
  for (const PatchNeedle::Point& point : patch.needle.points)
    for (int m = 0; m < r && !patch.needle.empty(); ++m)
      for (int k = 0; k < 3; ++k) needle_rows.add(pack::to_short(point.rows(k, m), row_step[static_cast<std::size_t>(m)]));
  for (const PatchSuture::Bite& bite : patch.suture.all())
    for (int m = 0; m < r; ++m)
      for (int k = 0; k < 3; ++k) suture_rows.add(pack::to_short(bite.rows(k, m), row_step[static_cast<std::size_t>(m)]));
  return step;
}

using OtherContacts = Bounded<wire::OtherContact, kMaxOtherContacts>;
OtherContacts contacts_of_other_tools(pack::Packer& packer, const PatchOthers& others) {
  OtherContacts sent;
  for (const OtherContact& other : others.of_other_tools()) {
    const auto normal = pack_normal(other.normal);
    sent.add({packer.vec(other.gap), packer.sym(other.c_static), pack::to_steps(other.velocity, pack::kVelocityStep),
              pack::to_steps(other.acceleration, pack::kAccelerationStep), normal[0], normal[1],
              static_cast<std::uint16_t>(other.touching ? 1 : 0)});
  }
  return sent;
}

using ContactLaws = Bounded<wire::ContactLaw, kMaxOtherContacts>;
/// None if all have that of the patch's tool.
ContactLaws laws_of(pack::Packer& packer, const Patch& patch) {
  ContactLaws sent;
  const auto others = patch.others.of_other_tools();
  if (std::ranges::none_of(others, [](const OtherContact& other) { return other.law.has_value(); })) return sent;
  for (const OtherContact& other : others) {
    const ContactParameters law = other.law.value_or(ContactParameters{patch.contact_stiffness_n_m, patch.friction});
    sent.add({packer.number(law.contact_stiffness_n_m), packer.number(law.friction)});
  }
  return sent;
}

std::uint16_t to_compliance(double c_m_n) {
  constexpr float kHalfMost = 65504;
  return packed::to_half(std::clamp(static_cast<float>(c_m_n / pack::kComplianceUnit_m_n), 0.0F, kHalfMost));
}

using OwnContacts = Bounded<wire::OwnContact, kMaxOtherContacts>;
OwnContacts own_contacts(pack::Packer& packer, const PatchOthers& others) {
  OwnContacts sent;
  for (const OtherContact& own : others.of_this_tool()) {
    const auto normal = pack_normal(own.normal);
    const int exponent = step_exponent(packer.number(own.gap.cwiseAbs().maxCoeff()));
    const double along = packer.number(own.normal.dot(own.c_static * own.normal)), trace = packer.number(own.c_static.trace());
    if (!packer.ok()) return sent;
    sent.add({pack::to_steps(own.gap, std::ldexp(1.0F, exponent)), static_cast<std::int8_t>(exponent),
              static_cast<std::uint8_t>(own.touching ? 1 : 0), normal[0], normal[1], to_compliance(along),
              to_compliance(0.5 * (trace - along))});
  }
  return sent;
}

using Spheres = Bounded<wire::Sphere, kMaxToolSpheres>;
using Jaws = Bounded<wire::Jaw, kMaxToolSpheres>;
/// Calls `visit` with each sphere that has a contact in the patch.
template <class Visit>
void each_sphere(const Patch& patch, const Visit& visit) {
  if (!patch.turn || patch.constant || patch.contact != ContactKind::touch) return;
  visit(patch.sphere);
  for (int j = 0; j < patch.others.own; ++j) visit(patch.others.of[static_cast<std::size_t>(j)].sphere);
}

wire::ToolBody body_of(pack::Packer& packer, const Patch& patch) {
  if (!patch.turn) return {};
  return {packer.vec(patch.torque), packer.turn(*patch.turn), static_cast<std::uint16_t>(patch.constant ? 0 : patch.others.own)};
}

flatbuffers::Offset<wire::Needle> write_needle(flatbuffers::FlatBufferBuilder& builder, pack::Packer& packer,
                                               const PatchNeedle& needle, const NeedleRows& rows) {
  Bounded<wire::NeedleLayer, kMaxNeedleLayers> layers;
  for (const NeedleLayer& layer : needle.layers.all())
    layers.add({packer.number(layer.begins_m), packer.number(layer.puncture_n), packer.number(layer.cutting_n),
                packer.number(layer.friction_n_m)});
  Bounded<wire::NeedlePoint, kNeedlePoints> points;
  for (const PatchNeedle::Point& point : needle.points) points.add({packer.vec(point.position), packer.number(point.bond_m)});
  const float length = packer.number(needle.layers.length_m), front = std::min(packer.number(needle.tip.front_m), length),
              depth = std::min(packer.number(needle.tip.depth_m), front);
  const auto layers_at = builder.CreateVectorOfStructs(layers.data(), layers.size());
  const auto points_at = builder.CreateVectorOfStructs(points.data(), points.size());
  const auto rows_at = rows.size() > 0 ? builder.CreateVector(rows.data(), rows.size()) : 0;
  return wire::CreateNeedle(builder, length, depth, front, static_cast<std::uint8_t>(needle.tip.layer), needle.tip.inside,
                            layers_at, points_at, rows_at);
}

flatbuffers::Offset<wire::Suture> write_suture(flatbuffers::FlatBufferBuilder& builder, pack::Packer& packer,
                                               const PatchSuture& suture, const SutureRows& rows) {
  Bounded<float, kMaxSpans> lengths;
  Bounded<wire::Vec, kMaxBites> bites;
  for (std::size_t i = 0; i <= suture.all().size(); ++i) lengths.add(packer.number(suture.length_m[i]));
  for (const PatchSuture::Bite& bite : suture.all()) bites.add(packer.vec(bite.position));
  const auto lengths_at = builder.CreateVector(lengths.data(), lengths.size());
  const auto bites_at = builder.CreateVectorOfStructs(bites.data(), bites.size());
  const auto rows_at = rows.size() > 0 ? builder.CreateVector(rows.data(), rows.size()) : 0;
  const SutureLaw& law = suture.law;
  return wire::CreateSuture(builder, packer.number(law.stiffness_n_m), packer.number(law.friction), packer.number(law.drag_n),
                            static_cast<std::uint8_t>((law.first_tied ? kFirstTiedFlag : 0) |
                                                      (law.last_tied ? kLastTiedFlag : 0) | (law.barbed ? kBarbedFlag : 0)),
                            lengths_at, bites_at, rows_at, packer.number(law.tear_n));
}

std::uint16_t to_weight(double weight) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(weight, 0.0, 1.0) * pack::kWeightMax));
}

wire::PatchHead head_of(const Patch& patch, pack::Packer& packer) {
  const bool touch = patch.contact == ContactKind::touch;
  const int flags = (touch ? kTouchFlag : 0) | (patch.constant ? kConstantFlag : 0) |
                    (touch && patch.touching ? kTouchingFlag : 0) | (patch.has_terms ? kTermsFlag : 0);
  const bool surface = touch && !patch.constant;
  if (surface) packer.require(patch.point.triangle < kMaxPortTriangles);
  return {packer.time(patch.stamp),
          patch.seq,
          packer.duration(patch.valid_for),
          packer.vec(patch.force),
          packer.point(patch.tool),
          packer.number(patch.trust_radius_m),
          static_cast<std::uint8_t>(patch.scheme),
          static_cast<std::uint8_t>(flags),
          static_cast<std::uint8_t>(surface ? patch.point.triangle : 0),
          static_cast<std::uint8_t>(surface ? patch.surface.vertex_count : 0)};
}

constexpr double kNormalMost = 32767;

/// Folds outwards from the octahedron's upper half; its own inverse.
std::array<double, 2> folded(double x, double y) {
  return {(1 - std::abs(y)) * (x < 0 ? -1 : 1), (1 - std::abs(x)) * (y < 0 ? -1 : 1)};
}

}  // namespace

std::array<std::uint16_t, 2> pack_normal(const Vec3& normal) {
  const double sum = normal.cwiseAbs().sum();
  if (!(sum > 0)) return {kNoNormal, kNoNormal};
  std::array<double, 2> at{normal.x() / sum, normal.y() / sum};
  if (normal.z() < 0) at = folded(at[0], at[1]);
  const auto part = [](double a) {
    return static_cast<std::uint16_t>(std::lround(kNormalMost * (std::clamp(a, -1.0, 1.0) + 1)));
  };
  return {part(at[0]), part(at[1])};
}

Vec3 unpack_normal(std::uint16_t u, std::uint16_t v) {
  if (u == kNoNormal || v == kNoNormal) return Vec3::Zero();
  std::array<double, 2> at{u / kNormalMost - 1, v / kNormalMost - 1};
  const double z = 1 - std::abs(at[0]) - std::abs(at[1]);
  if (z < 0) at = folded(at[0], at[1]);
  return Vec3(at[0], at[1], z).normalized();
}

flatbuffers::Offset<wire::Patch> write_patch(flatbuffers::FlatBufferBuilder& builder, pack::Packer& packer, const Patch& patch) {
  Floats floats;
  Shorts shorts;
  OtherRows other_rows;
  NeedleRows needle_rows;
  SutureRows suture_rows;
  wire::AttachPort attach;
  wire::TouchPort touch;
  const bool is_touch = patch.contact == ContactKind::touch;
  packer.require(patch.constant || has_modes_in_order(patch));
  if (packer.ok() && is_touch && !patch.constant) packer.require(has_finite_surface(patch));
  if (!packer.ok()) return {};
  if (!patch.constant) add_modes(floats, shorts, packer, patch);
  if (!patch.constant && is_touch) {
    const wire::Point origin = packer.point(patch.surface.vertices[0].position);
    const float step = add_surface(shorts, other_rows, needle_rows, suture_rows, packer, patch, pack::from(origin));
    const std::uint16_t w0 = to_weight(patch.point.weight[0]);
    const std::uint16_t w1 = std::min(to_weight(patch.point.weight[1]), static_cast<std::uint16_t>(pack::kWeightMax - w0));
    touch = {packer.number(patch.contact_stiffness_n_m),
             packer.number(patch.friction),
             packer.sym(patch.c_static),
             origin,
             step,
             w0,
             w1};
  } else if (!patch.constant) {
    add_port(floats, packer, patch.b_k);
    add_port(floats, packer, patch.b_d);
    attach = {packer.vec(patch.tool_velocity), packer.sym(patch.k_port), packer.sym(patch.d_port)};
  }
  Floats load;
  if (!patch.constant)
    for (int i = 0; i < patch.load_rate.size(); ++i) load.add(packer.number(patch.load_rate[i]));
  const bool surface = !patch.constant && is_touch, others = surface && patch.others.count > 0;
  Bounded<float, 3 * kMaxPronyBranches> fading;
  Bounded<std::int16_t, kMaxPronyBranches*(kMaxModes + 3)> pulls;
  if (!patch.constant) {
    for (const PatchBranch& branch : patch.fading.branches()) {
      const float step = branch.pull.size() > 0 ? pack::short_step(packer.number(branch.pull.cwiseAbs().maxCoeff())) : 0;
      for (const float number : {packer.number(branch.prony.share), packer.number(branch.prony.time_s), step}) fading.add(number);
      for (Eigen::Index i = 0; i < branch.pull.size(); ++i)
        pulls.add(packer.ok() ? pack::to_short(branch.pull[i], step) : std::int16_t{0});
    }
  }
  const wire::PatchHead head = head_of(patch, packer);
  const auto load_at = load.size() > 0 ? builder.CreateVector(load.data(), load.size()) : 0;
  const auto floats_at = floats.size() > 0 ? builder.CreateVector(floats.data(), floats.size()) : 0;
  const Normals normals = surface ? normals_of(patch.surface) : Normals{};
  const auto normals_at = normals.size() > 0 ? builder.CreateVector(normals.data(), normals.size()) : 0;
  const auto fading_at = fading.size() > 0 ? builder.CreateVector(fading.data(), fading.size()) : 0;
  const auto pulls_at = pulls.size() > 0 ? builder.CreateVector(pulls.data(), pulls.size()) : 0;
  const auto shorts_at = shorts.size() > 0 ? builder.CreateVector(shorts.data(), shorts.size()) : 0;
  const OtherContacts tools = others ? contacts_of_other_tools(packer, patch.others) : OtherContacts{};
  const auto others_at = tools.size() > 0 ? builder.CreateVectorOfStructs(tools.data(), tools.size()) : 0;
  const ContactLaws laws = others ? laws_of(packer, patch) : ContactLaws{};
  const auto laws_at = laws.size() > 0 ? builder.CreateVectorOfStructs(laws.data(), laws.size()) : 0;
  const OwnContacts own = others ? own_contacts(packer, patch.others) : OwnContacts{};
  const auto own_at = own.size() > 0 ? builder.CreateVectorOfStructs(own.data(), own.size()) : 0;
  const auto other_rows_at = other_rows.size() > 0 ? builder.CreateVector(other_rows.data(), other_rows.size()) : 0;
  const auto needle_at = surface && !patch.needle.empty() ? write_needle(builder, packer, patch.needle, needle_rows) : 0;
  const auto suture_at = surface && !patch.suture.empty() ? write_suture(builder, packer, patch.suture, suture_rows) : 0;
  Spheres spheres;
  Jaws jaws;
  bool opens = false;
  each_sphere(patch, [&](const ToolSphere& sphere) {
    spheres.add(packer.sphere(sphere));
    jaws.add(packer.jaw(sphere));
    opens |= sphere.opens();
  });
  const wire::ToolBody body = body_of(packer, patch);
  const auto spheres_at = spheres.size() > 0 ? builder.CreateVectorOfStructs(spheres.data(), spheres.size()) : 0;
  const auto jaws_at = opens ? builder.CreateVectorOfStructs(jaws.data(), jaws.size()) : 0;
  return wire::CreatePatch(builder, &head, floats_at, shorts_at, surface ? &touch : nullptr,
                           !patch.constant && !is_touch ? &attach : nullptr, load_at,
                           load.size() > 0 || others ? packer.duration(patch.load_for) : 0, normals_at, fading_at, pulls_at,
                           others_at, other_rows_at, patch.turn ? &body : nullptr, spheres_at, needle_at,
                           opens ? packer.opening(patch.opening) : std::uint16_t{0}, jaws_at, suture_at, own_at, laws_at);
}

void leave_room_for_rounding(Patch& patch) {
  const double kept = 1 - (patch.modes() - 1) / (2.0 * pack::kShortMax);
  if (patch.modes() < 2) return;
  ModeMatrix damping = kept * patch.damping;
  damping.diagonal() = patch.damping.diagonal();
  patch.g += (damping - patch.damping) * patch.q_rate;
  patch.damping = damping;
  patch.b_d *= kept;
}

namespace {

/// Size of load_rate, other contacts and branches, with alignment.
int extra_bytes(int modes, bool loaded, PatchContacts contacts, int branches, int variables) {
  constexpr int kLoadOverheadBytes = 16, kBranchesOverheadBytes = 28, kBranchBytes = 12;
  constexpr int kOthersOverheadBytes = 28, kOtherContactBytes = 56, kBodyBytes = 36, kSphereBytes = 8;
  constexpr int kJawsBytes = 16, kJawBytes = 6, kOwnOverheadBytes = 24, kOwnContactBytes = 16;
  constexpr int kNeedleBytes = 72 + 16 * kNeedlePoints, kLayerBytes = 16;
  constexpr int kSutureBytes = 92, kBiteBytes = 16, kLawsOverheadBytes = 28, kLawBytes = 8;
  const int others = contacts.others, of_other_tools = others - contacts.own;
  return (loaded ? kLoadOverheadBytes + 4 * modes : 0) +
         (of_other_tools > 0 ? kOthersOverheadBytes + of_other_tools * (kOtherContactBytes + 6 * modes) : 0) +
         (contacts.laws ? kLawsOverheadBytes + of_other_tools * kLawBytes : 0) +
         (contacts.own > 0 ? kOwnOverheadBytes + contacts.own * kOwnContactBytes : 0) +
         (contacts.body ? kBodyBytes + kSphereBytes * (others + 1) : 0) +
         (contacts.jaws ? kJawsBytes + kJawBytes * (others + 1) : 0) +
         (contacts.needle_layers > 0 ? kNeedleBytes + kLayerBytes * contacts.needle_layers + 6 * kNeedlePoints * modes : 0) +
         (contacts.bites > 0 ? kSutureBytes + contacts.bites * (kBiteBytes + 6 * modes) : 0) +
         (branches > 0 ? kBranchesOverheadBytes + branches * (kBranchBytes + 2 * variables) : 0);
}

}  // namespace

int max_port_vertices(int modes, int triangles, bool loaded, int branches, PatchContacts contacts) {
  constexpr int kOverheadBytes = 224;  // size of a touch patch without the contents of its vectors, with alignment
  constexpr int kNormalBytes = 4;
  const int free_bytes = static_cast<int>(kMaxDatagramBytes) - kOverheadBytes -
                         extra_bytes(modes, loaded, contacts, branches, modes) - 4 * touch_floats(modes) - 2 * mode_shorts(modes);
  int vertices = 0;
  const auto bytes_of = [&](int n) {
    return 2 * surface_shorts(modes, n) + kNormalBytes * n + 2 * std::min(triangles, most_triangles(n));
  };
  while (vertices < kMaxPortVertices && bytes_of(vertices + 1) <= free_bytes) ++vertices;
  return vertices;
}

int max_port_modes(ContactKind contact, int branches) {
  constexpr int kAttachBytes = 212;  // size of a grasp without the contents of its vectors, with alignment
  int modes = kMaxModes;
  if (contact == ContactKind::attach) {
    const auto bytes_of = [&](int r) {
      return kAttachBytes + 4 * attach_floats(r) + 2 * mode_shorts(r) + extra_bytes(r, true, {}, branches, r + 3);
    };
    while (bytes_of(modes) > static_cast<int>(kMaxDatagramBytes)) --modes;
    return modes;
  }
  while (modes > 0 && max_port_vertices(modes, kMaxPortTriangles, branches > 0, branches) < 3) --modes;
  return modes;
}

}  // namespace palpate
