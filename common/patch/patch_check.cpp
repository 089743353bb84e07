// The receiver's check of a patch.
//
// Semi-definiteness is checked for S A S with S = diag(a_ii)^-1/2, so that newtons per metre and modes may be in one matrix, up
// to a tolerance of 1e-5 on its unit diagonal. The tolerance is needed because entries arrive as float32, each with a relative
// error of up to 6e-8 and hence, as |a_ij|^2 <= a_ii a_jj, of 6e-8 in S A S; over 19 rows that changes an eigenvalue by at most
// 1.2e-6, and a matrix that was singular before rounding may be indefinite by as much. A matrix within the tolerance can feed a
// motion with 1e-5 of what its own stiffnesses or dampers would take from it. A diagonal entry below 1e-6 of its block's largest
// counts as that: it is the sender's rounding error, not a scale.
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "common/base/tool_pose.hpp"
#include "common/patch/patch.hpp"

namespace palpate {
namespace {

constexpr double kRelativeTolerance = 1e-5, kDiagonalShareMin = 1e-6;  // relative to the largest entry; reason: see above
// Ranges of the format (docs/reference/wire.md, 4); products of such numbers stay finite.
constexpr double kMaxSpeedMS = 1e3, kMaxCompliance_m_n = 1e3, kMaxFriction = 10;
constexpr double kMaxModelEntry = 1e12;                   // for K, D, g, ..., each in its own unit (patch.hpp)
constexpr Micros kMaxDuration{60'000'000};                // for valid_for and load_for
constexpr double kTwiceAreaMin_m2 = 1e-14;                // for a triangle with sides of 0.1 um: below, its normal is rounding
constexpr double kFadingSumMax = kMaxFadingShare + 1e-6;  // shares are sent in single precision
constexpr double kFadingTimeMinS = (1 - 1e-6) * kMinFadingS;  // like times

using Square = BoundedMatrix<kMaxModes + 3, kMaxModes + 3>;

/// Stores the first fault.
class Numbers {
 public:
  PatchFault fault() const { return fault_; }
  void within(double v, double low, double high) {
    if (fault_ == PatchFault::not_finite) return;
    if (!std::isfinite(v))
      fault_ = PatchFault::not_finite;
    else if (v < low || v > high)
      fault_ = PatchFault::out_of_range;
  }
  template <class Matrix>
  void all(const Matrix& m, double limit) {
    for (Eigen::Index j = 0; j < m.cols(); ++j)
      for (Eigen::Index i = 0; i < m.rows(); ++i) within(m(i, j), -limit, limit);
  }

 private:
  PatchFault fault_ = PatchFault::none;
};

bool uses_attach(const Patch& p) { return !p.constant && p.contact == ContactKind::attach; }
bool uses_surface(const Patch& p) { return !p.constant && p.contact == ContactKind::touch; }

bool sizes_agree(const Patch& p) {
  if (p.constant && p.has_terms) return false;
  const auto r = p.stiffness.size();
  if (p.damping.rows() != r || p.damping.cols() != r || p.g.size() != r || p.q_rate.size() != r) return false;
  if (p.load_rate.size() != 0 && p.load_rate.size() != r) return false;
  const auto variables = uses_attach(p) ? r + 3 : r;
  if (p.fading.count < 0 || p.fading.count > static_cast<int>(kMaxPronyBranches)) return false;
  for (const PatchBranch& branch : p.fading.branches())
    if (branch.pull.size() != variables) return false;
  if (uses_attach(p) && (p.b_k.rows() != r || p.b_d.rows() != r)) return false;
  if (p.others.count < 0 || p.others.count > (uses_surface(p) ? kMaxOtherContacts : 0)) return false;
  if (p.others.own < 0 || p.others.own > (p.turn ? p.others.count : 0)) return false;
  for (const OtherContact& other : p.others.tools())
    if (other.rows.cols() != r) return false;
  if (p.needle.layers.count < 0 || p.needle.layers.count > (uses_surface(p) && p.turn ? kMaxNeedleLayers : 0)) return false;
  for (const PatchNeedle::Point& point : p.needle.points)
    if (!p.needle.empty() && point.rows.cols() != r) return false;
  if (p.suture.law.bites < 0 || p.suture.law.bites > (uses_surface(p) ? kMaxBites : 0)) return false;
  for (const PatchSuture::Bite& bite : p.suture.all())
    if (bite.rows.cols() != r) return false;
  if (!uses_surface(p)) return true;
  const auto& s = p.surface;
  if (s.vertex_count < 3 || s.vertex_count > kMaxPortVertices || s.triangle_count < 1 || s.triangle_count > kMaxPortTriangles)
    return false;
  for (int i = 0; i < s.vertex_count; ++i)
    if (s.vertices[static_cast<std::size_t>(i)].rows.cols() != r) return false;
  return true;
}

void check_law(const ContactParameters& law, Numbers& numbers) {
  numbers.within(law.contact_stiffness_n_m, 0, 1e9);
  numbers.within(law.friction, 0, kMaxFriction);
}

void check_surface_numbers(const Patch& p, Numbers& numbers) {
  check_law({p.contact_stiffness_n_m, p.friction}, numbers);
  numbers.all(p.c_static, kMaxCompliance_m_n);
  numbers.all(p.point.weight, 2);
  for (int i = 0; i < p.surface.vertex_count; ++i) {
    numbers.all(p.surface.vertices[static_cast<std::size_t>(i)].position, kWorldExtentM);
    numbers.all(p.surface.vertices[static_cast<std::size_t>(i)].rows, kMaxModelEntry);
    numbers.all(p.surface.vertices[static_cast<std::size_t>(i)].normal, 1.001);
  }
}

void check_sphere(const ToolSphere& sphere, Numbers& numbers) {
  numbers.all(sphere.centre, kMaxToolReachM + kToolStepM);
  numbers.within(sphere.radius_m, 0, kMaxToolReachM + kToolStepM);
  numbers.within(sphere.hinge_m, -kMaxToolReachM - kToolStepM, kMaxToolReachM + kToolStepM);
  numbers.within(sphere.swing_rad, -kMaxSwingRad, kMaxSwingRad);
  const double slide_most_m = sphere.on_jaw() ? 0 : kMaxToolReachM + kToolStepM;
  numbers.within(sphere.slide_m, -slide_most_m, slide_most_m);
}

void check_other_contacts(const PatchOthers& others, Numbers& numbers) {
  constexpr double kUnitLengthTolerance = 1e-6;
  for (const OtherContact& other : others.tools()) {
    numbers.all(other.gap, 2 * kWorldExtentM);
    numbers.all(other.velocity, kMaxSpeedMS);
    numbers.all(other.acceleration, kMaxModelEntry);
    numbers.within(other.normal.squaredNorm(), 1 - kUnitLengthTolerance, 1 + kUnitLengthTolerance);
    numbers.all(other.c_static, kMaxCompliance_m_n);
    numbers.all(other.rows, kMaxModelEntry);
    check_sphere(other.sphere, numbers);
    if (other.law) check_law(*other.law, numbers);
  }
}

void check_needle(const PatchNeedle& needle, Numbers& numbers) {
  if (needle.empty()) return;
  const double length_m = needle.layers.length_m;
  numbers.within(length_m, kMinNeedleLengthM, kMaxNeedleLengthM);
  double begins_m = 0;
  for (const NeedleLayer& layer : needle.layers.all()) {
    numbers.within(layer.begins_m, begins_m, &layer == needle.layers.of.data() ? 0 : length_m);
    begins_m = layer.begins_m;
    for (const double force : {layer.puncture_n, layer.cutting_n, layer.friction_n_m}) numbers.within(force, 0, kMaxForceN);
  }
  numbers.within(needle.tip.front_m, 0, length_m);
  numbers.within(needle.tip.depth_m, 0, needle.tip.front_m);
  numbers.within(needle.tip.layer, 0, needle.layers.count - 1);
  for (const PatchNeedle::Point& point : needle.points) {
    numbers.all(point.position, kWorldExtentM);
    numbers.all(point.rows, kMaxModelEntry);
    numbers.within(point.bond_m, -kWorldExtentM, kWorldExtentM);
  }
}

void check_suture(const PatchSuture& suture, Numbers& numbers) {
  if (suture.empty()) return;
  numbers.within(suture.law.stiffness_n_m, kMinThreadStiffness_n_m, kMaxThreadStiffness_n_m);
  numbers.within(suture.law.friction, 0, kMaxFriction);
  numbers.within(suture.law.drag_n, 0, kMaxForceN);
  numbers.within(suture.law.tear_n, 0, kMaxForceN);
  for (std::size_t i = 0; i <= suture.all().size(); ++i) numbers.within(suture.length_m[i], 0, kWorldExtentM);
  for (const PatchSuture::Bite& bite : suture.all()) {
    numbers.all(bite.position, kWorldExtentM);
    numbers.all(bite.rows, kMaxModelEntry);
  }
}

void check_fading(const PatchRelaxation& fading, Numbers& numbers) {
  double share = 0;
  for (const PatchBranch& branch : fading.branches()) {
    numbers.within(branch.prony.share, 0, 1);
    numbers.within(branch.prony.time_s, kFadingTimeMinS, kMaxModelEntry);
    numbers.all(branch.pull, kMaxModelEntry);
    share += branch.prony.share;
  }
  numbers.within(share, 0, kFadingSumMax);
}

PatchFault check_numbers(const Patch& p) {
  Numbers numbers;
  for (int i = 0; i < p.modes(); ++i) numbers.within(p.stiffness[i], 0, kMaxModelEntry);
  numbers.all(p.damping, kMaxModelEntry);
  numbers.all(p.g, kMaxModelEntry);
  numbers.all(p.q_rate, kMaxModelEntry);
  numbers.all(p.load_rate, kMaxModelEntry);
  check_fading(p.fading, numbers);
  numbers.all(p.force, kMaxForceN);
  numbers.all(p.tool, kWorldExtentM);
  numbers.within(p.trust_radius_m, 0, kWorldExtentM);
  for (const Micros t : {p.valid_for, p.load_for})
    numbers.within(static_cast<double>(t.count()), 0, static_cast<double>(kMaxDuration.count()));
  if (uses_attach(p)) {
    numbers.all(p.tool_velocity, kMaxSpeedMS);
    numbers.all(p.k_port, kMaxModelEntry);
    numbers.all(p.d_port, kMaxModelEntry);
    numbers.all(p.b_k, kMaxModelEntry);
    numbers.all(p.b_d, kMaxModelEntry);
  }
  if (uses_surface(p)) check_surface_numbers(p, numbers);
  check_other_contacts(p.others, numbers);
  check_needle(p.needle, numbers);
  check_suture(p.suture, numbers);
  check_sphere(p.sphere, numbers);
  numbers.all(p.torque, kMaxTorqueNM);
  numbers.within(p.opening, 0, 1);
  if (p.turn) numbers.within(p.turn->norm(), 1 - kUnitLengthWithin, 1 + kUnitLengthWithin);
  return numbers.fault();
}

/// Checks `a`, symmetric by its lower triangle; rows before `split` are one block (one unit), the others another.
bool semi_definite(Square a, Eigen::Index split) {
  const auto n = a.rows();
  if (n == 0) return true;
  BoundedMatrix<kMaxModes + 3, 1> scale(n);
  const auto scale_block = [&](Eigen::Index first, Eigen::Index size) {
    if (size == 0) return;
    const double largest = a.diagonal().segment(first, size).maxCoeff();
    for (auto i = first; i < first + size; ++i) {
      const double diagonal = std::max(a(i, i), kDiagonalShareMin * largest);
      scale[i] = diagonal > 0 ? 1 / std::sqrt(diagonal) : 1;
    }
  };
  scale_block(0, split);
  scale_block(split, n - split);
  a = (scale.asDiagonal() * a * scale.asDiagonal()).eval();
  a.diagonal().array() += kRelativeTolerance;
  return Eigen::LLT<Square>(a).info() == Eigen::Success;
}

bool symmetric(const Mat3& m) {
  return (m - m.transpose()).cwiseAbs().maxCoeff() <= kRelativeTolerance * m.cwiseAbs().maxCoeff();
}
bool symmetric(const ModeMatrix& m) {
  return m.size() == 0 || (m - m.transpose()).cwiseAbs().maxCoeff() <= kRelativeTolerance * m.cwiseAbs().maxCoeff();
}

/// Returns [[port, -b^T], [-b, modes]].
Square with_port(const Mat3& port, const ModePort& b, const ModeMatrix& modes) {
  const auto r = modes.rows();
  Square a(r + 3, r + 3);
  a.topLeftCorner(3, 3) = port;
  a.bottomRightCorner(r, r) = modes;
  a.bottomLeftCorner(r, 3) = -b;
  a.topRightCorner(3, r) = -b.transpose();
  return a;
}

bool is_compliance(const Mat3& c) { return symmetric(c) && semi_definite(c, 3); }

PatchFault check_passivity(const Patch& p) {
  if (!symmetric(p.damping)) return PatchFault::damping_indefinite;
  if (uses_attach(p)) {
    const ModeMatrix stiffness = p.stiffness.asDiagonal();
    if (!symmetric(p.k_port) || !semi_definite(with_port(p.k_port, p.b_k, stiffness), 3)) return PatchFault::stiffness_indefinite;
    if (!symmetric(p.d_port) || !semi_definite(with_port(p.d_port, p.b_d, p.damping), 3)) return PatchFault::damping_indefinite;
    return PatchFault::none;
  }
  if (uses_surface(p) && !is_compliance(p.c_static)) return PatchFault::stiffness_indefinite;
  for (const OtherContact& other : p.others.tools())
    if (!is_compliance(other.c_static)) return PatchFault::stiffness_indefinite;
  return semi_definite(p.damping, p.modes()) ? PatchFault::none : PatchFault::damping_indefinite;
}

PatchFault check_surface(const Patch& p) {
  const auto& s = p.surface;
  for (int t = 0; t < s.triangle_count; ++t) {
    const Triangle& triangle = s.triangles[static_cast<std::size_t>(t)];
    for (const auto index : triangle)
      if (index >= static_cast<std::uint32_t>(s.vertex_count)) return PatchFault::surface;
    const Vec3& a = s.vertices[triangle[0]].position;
    const Vec3 normal = (s.vertices[triangle[1]].position - a).cross(s.vertices[triangle[2]].position - a);
    if (normal.norm() < kTwiceAreaMin_m2) return PatchFault::surface;
  }
  const Vec3& w = p.point.weight;
  const bool barycentric = w.minCoeff() >= -1e-9 && std::abs(w.sum() - 1) <= 1e-6;
  return barycentric && p.point.triangle < static_cast<std::uint32_t>(s.triangle_count) ? PatchFault::none : PatchFault::surface;
}

}  // namespace

PatchFault check(const Patch& patch) {
  if (!sizes_agree(patch)) return PatchFault::sizes;
  if (const PatchFault fault = check_numbers(patch); fault != PatchFault::none) return fault;
  if (const PatchFault fault = check_passivity(patch); fault != PatchFault::none) return fault;
  return uses_surface(patch) ? check_surface(patch) : PatchFault::none;
}

const char* describe(PatchFault fault) {
  switch (fault) {
    case PatchFault::none:
      return "none";
    case PatchFault::sizes:
      return "sizes do not agree";
    case PatchFault::not_finite:
      return "a number is not finite";
    case PatchFault::out_of_range:
      return "a number is out of range";
    case PatchFault::stiffness_indefinite:
      return "stiffness is not positive semi-definite";
    case PatchFault::damping_indefinite:
      return "damping is not positive semi-definite";
    case PatchFault::surface:
      return "surface indices or weights do not fit";
  }
  return "unknown";
}

}  // namespace palpate
