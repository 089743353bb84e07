#include "server/reduce/sample_tetrahedra.hpp"

#include <array>
#include <cassert>
#include <span>

#include "server/reduce/gradient_points.hpp"
#include "server/reduce/nonlinear_elements.hpp"

namespace palpate {
namespace {

constexpr double kNegligibleTetrahedra = 1e-2;  // share of the nonlinearity left out; less: slower patches
static_assert(kSamples % kTetraLane == 0);

using Nine = Eigen::Matrix<float, 9, kSamples, Eigen::RowMajor>;

/// Multiplies by a matrix from the left.
TetraLanes turned_by(const Eigen::Matrix3f& r, const TetraLanes& m) {
  TetraLanes t;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const auto row = r.row(static_cast<Eigen::Index>(i));
      t[3 * i + j] = row[0] * m[j] + row[1] * m[3 + j] + row[2] * m[6 + j];
    }
  return t;
}

struct Stamp {
  ElementLinearisation at;
  Eigen::Matrix3f frame;
};

/// Computes V Q from dF, all samples side by side.
void stresses(const Stamp& stamp, const Nine& df, Nine& q) {
  for (Eigen::Index s = 0; s < kSamples; s += kTetraLane) {
    TetraLanes lanes;
    for (std::size_t i = 0; i < 9; ++i)
      lanes[i] = df.row(static_cast<Eigen::Index>(i)).segment<kTetraLane>(s).transpose().array();
    ElementRotation turned;
    const SolidLaw law = stamp.at.law.kind;
    if (law == SolidLaw::corotational) lanes = turned_by(stamp.frame.transpose(), lanes);
    turn(stamp.at, lanes, turned);
    TetraLanes more = nonlinear_residual_stress(stamp.at, lanes, turned);
    if (law == SolidLaw::corotational) more = turned_by(stamp.frame, more);
    for (std::size_t i = 0; i < 9; ++i) q.row(static_cast<Eigen::Index>(i)).segment<kTetraLane>(s) = more[i].matrix().transpose();
  }
}

/// The finite elements of a body at the samples, as tetrahedra.
class CandidateTetrahedra {
 public:
  using Sample = SampledTetrahedra;
  // Fewer than for springs, as each costs more. More are more accurate and take longer.
  static constexpr std::size_t kEvaluatedElementsMax = 2000, kCandidatesMax = 200;
  static constexpr int kElementNodes = 4, kChosenMax = kMaxTetrahedra;  // capacity of the wire

  CandidateTetrahedra(const WholeBody& body, const Matrix& moved, const Matrix& u, int tool)
      : materials_(&body.dynamics().body().materials),
        places_(
            body.dynamics(), body.state(), moved,
            nonlinear_elements(body.dynamics(), body.state(), moved * root_of(u), kNegligibleTetrahedra, kEvaluatedElementsMax),
            tool),
        samples_(u.cast<float>()) {
    assert(moved.rows() == body.state().x.size() && moved.cols() == u.rows() && u.cols() == kSamples);
    assert(!materials_->empty());
  }
  const std::vector<std::uint32_t>& elements() const { return places_.elements(); }
  std::size_t nodes() const { return places_.count(); }
  /// Returns b_1, b_2, b_3 as rows.
  Eigen::Matrix3f gradients(std::uint32_t element) const { return rest_of(element).b.rightCols<3>().transpose().cast<float>(); }
  TetraShape rest_of(std::uint32_t element) const { return places_.rest(element); }
  Stamp stamp(std::uint32_t element) const {
    const Mat3 f = places_.deformation(element);
    const LameParameters lame = lame_of(element);
    const LawParameters law = material_of(element).parameters();
    const Mat3 frame = frame_of(law.kind, f);
    Stamp stamp{{}, frame.cast<float>()};
    stamp.at.set(0, law, frame.transpose() * f, lame.mu, lame.lambda);
    stamp.at.spread();
    return stamp;
  }
  const SolidMaterial& material_of(std::uint32_t element) const { return (*materials_)[places_.material(element)]; }
  /// Returns the Lame parameters times the volume [J].
  LameParameters lame_of(std::uint32_t element) const {
    const SolidMaterial& m = material_of(element);
    return lame_parameters(m.law, rest_of(element).volume_m3 * m.young_pa, m.poisson);
  }
  std::uint32_t node(std::uint32_t element, int i) const { return places_.place(element, i); }
  /// Returns H of some tetrahedra, 9 rows each.
  Eigen::MatrixXf motions(const std::vector<std::uint32_t>& elements) const {
    const Rows& moved = places_.moved();
    Eigen::MatrixXf h(9 * static_cast<Eigen::Index>(elements.size()), moved.cols());
    for (std::size_t k = 0; k < elements.size(); ++k) {
      std::array<Eigen::Matrix3Xf, 3> edges;
      for (int i = 0; i < 3; ++i)
        edges[static_cast<std::size_t>(i)] =
            moved.middleRows<3>(row(elements[k], i + 1)) - moved.middleRows<3>(row(elements[k], 0));
      h.middleRows<9>(9 * static_cast<Eigen::Index>(k)) = gradient_motion(gradients(elements[k]), edges);
    }
    return h;
  }
  /// Returns the forces of tetrahedra with given H, 9 rows each.
  ElementForces forces_of(std::span<const std::uint32_t> elements, const Eigen::MatrixXf& motions) const {
    ElementForces b{std::vector<Rows>(9), std::vector<SampleMatrix>(9)};
    const auto count = static_cast<Eigen::Index>(elements.size());
    for (Eigen::Index i = 0; i < 9; ++i) {
      Rows& motion = b.motion[static_cast<std::size_t>(i)];
      motion = motions(Eigen::seqN(i, count, 9), Eigen::all);
      b.force[static_cast<std::size_t>(i)].noalias() = motion * samples_;
    }
    Nine df, q;
    for (Eigen::Index k = 0; k < count; ++k) {
      for (Eigen::Index i = 0; i < 9; ++i) df.row(i) = b.force[static_cast<std::size_t>(i)].row(k);
      stresses(stamp(elements[static_cast<std::size_t>(k)]), df, q);
      for (Eigen::Index i = 0; i < 9; ++i) b.force[static_cast<std::size_t>(i)].row(k) = -q.row(i);
    }
    return b;
  }
  /// Returns the nonlinear forces of all tetrahedra on the nodes, as forces on the variables, n x samples; `parts`: |V Q| |H| of
  /// each.
  Eigen::MatrixXf all_together(Eigen::VectorXf& parts) const {
    thread_local SampleMatrix there, forces;  // reused: megabytes that would be allocated for every patch
    const Rows& moved = places_.moved();
    const std::vector<std::uint32_t>& elements = places_.elements();
    there.noalias() = moved * samples_;
    forces.setZero(there.rows(), kSamples);
    parts.resize(static_cast<Eigen::Index>(elements.size()));
    Nine df, q;
    Eigen::Matrix<float, 3, kSamples, Eigen::RowMajor> pull;
    for (std::size_t k = 0; k < elements.size(); ++k) {
      const std::uint32_t e = elements[k];
      const Eigen::Matrix3f b = gradients(e);
      df.setZero();
      float size = 0;
      for (int i = 0; i < 3; ++i) {
        for (int r = 0; r < 3; ++r) {
          const auto edge = there.row(row(e, i + 1) + r) - there.row(row(e, 0) + r);
          for (int c = 0; c < 3; ++c) df.row(3 * r + c) += b(i, c) * edge;
        }
        size += b.row(i).squaredNorm() * (moved.middleRows<3>(row(e, i + 1)) - moved.middleRows<3>(row(e, 0))).squaredNorm();
      }
      stresses(stamp(e), df, q);
      for (int i = 0; i < 3; ++i) {
        for (int r = 0; r < 3; ++r)
          pull.row(r) = b(i, 0) * q.row(3 * r) + b(i, 1) * q.row(3 * r + 1) + b(i, 2) * q.row(3 * r + 2);
        forces.middleRows<3>(row(e, i + 1)) -= pull;
        forces.middleRows<3>(row(e, 0)) += pull;
      }
      parts[static_cast<Eigen::Index>(k)] = q.norm() * std::sqrt(size);
    }
    return moved.transpose() * forces;
  }

  /// Returns the tetrahedra themselves, without weights, with their nodes' motions as sent.
  SampledTetrahedra taken(const std::vector<std::uint32_t>& elements, int /*tool*/) const {
    NodeNumbering met;
    const auto count = static_cast<Eigen::Index>(elements.size());
    SampledTetrahedra solid;
    solid.law = materials_->front().parameters();
    solid.nodes.resize(4, count);
    for (Eigen::VectorXf* v : {&solid.shear, &solid.dilation, &solid.damping_s}) v->resize(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::uint32_t e = elements[static_cast<std::size_t>(k)];
      for (int i = 0; i < 4; ++i) solid.nodes(i, k) = met.number_of(node(e, i));
      const LameParameters lame = lame_of(e);
      solid.shear[k] = static_cast<float>(lame.mu);
      solid.dilation[k] = static_cast<float>(lame.lambda);
      solid.damping_s[k] = static_cast<float>(material_of(e).damping_s);
    }
    solid.position = met.places(places_.at_stamp());
    solid.rest = met.places(places_.at_rest());
    solid.motion = met.motion(places_.moved(), places_.tool(), 3);
    return solid;
  }
  /// Returns the tetrahedra that have weights, with these.
  static SampledTetrahedra weighed(SampledTetrahedra solid, const SparseSolution& w) {
    assert(w.weights.size() > 0 && w.weights.minCoeff() > 0);
    solid.nodes = Eigen::Matrix<int, 4, Eigen::Dynamic>(solid.nodes(Eigen::all, w.columns));
    solid.shear = Eigen::VectorXf(solid.shear(w.columns)).cwiseProduct(w.weights);
    solid.dilation = Eigen::VectorXf(solid.dilation(w.columns)).cwiseProduct(w.weights);
    solid.damping_s = Eigen::VectorXf(solid.damping_s(w.columns));
    return solid;
  }

 private:
  Eigen::Index row(std::uint32_t element, int i) const { return 3 * static_cast<Eigen::Index>(node(element, i)); }
  const std::vector<SolidMaterial>* materials_;
  GradientPoints places_;
  Eigen::MatrixXf samples_;
};

}  // namespace

std::optional<SampledTetrahedra> sample_tetrahedra(const WholeBody& body, const Matrix& moved, const Sampling& sampling) {
  const Matrix u = samples(sampling);
  const CandidateTetrahedra solid(body, moved, u, sampling.tool);
  if (solid.elements().empty()) return std::nullopt;
  return sample(solid, u, sampling);
}

}  // namespace palpate
