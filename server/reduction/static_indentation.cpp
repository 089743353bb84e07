#include "server/reduction/static_indentation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <optional>

#include "server/elements/spring_forces.hpp"
#include "server/operators/local_body.hpp"

namespace palpate {
namespace {

constexpr int kGradientStepsMax = 40;     // of conjugate gradients, per round: bounds the time; the result so far is kept
constexpr double kResidualShare = 3e-2;   // of the first residual's norm; a tenth of it gains nothing (docs/notebook.md, 17)
constexpr double kTrialStepLeast = 1e-3;  // of a direction: a shorter trial would be lost in rounding
constexpr double kInterpolatedChangeMax = 0.5;  // of a trial: a step that close to it needs no evaluation of its own

/// Returns the nodes nearest to those of `port`, by number of elements in between, ascending.
std::vector<std::uint32_t> nodes_around(const NodeWeights& port, const LumpedBody& body,
                                        const std::vector<std::vector<std::uint32_t>>& elements) {
  std::vector<std::uint8_t> seen(body.nodes.size(), 0);
  std::vector<std::uint32_t> nodes;
  const auto add = [&](std::uint32_t node) {
    if (!seen[node]) nodes.push_back(node);
    seen[node] = 1;
  };
  for (const auto& [node, weight] : port) add(node);
  std::array<std::uint32_t, 2> scratch;
  const std::size_t most = body.is_solid() ? StaticIndentations::kSolidSubdomainNodes : StaticIndentations::kSubdomainNodes;
  for (std::size_t k = 0; k < nodes.size() && nodes.size() < most; ++k)
    for (const std::uint32_t e : elements[nodes[k]])
      for (const std::uint32_t node : nodes_of(body, e, scratch)) add(node);
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

/// Returns these nodes and the elements between them; a node is fixed if it is fixed in the body, or if one of its elements is
/// missing.
LocalBody cut_out(std::vector<std::uint32_t> nodes, const LumpedBody& whole,
                  const std::vector<std::vector<std::uint32_t>>& elements) {
  LocalBody local(whole, std::move(nodes));
  LumpedBody& body = local.body;
  const auto here = static_cast<std::uint32_t>(local.nodes.size());
  std::array<std::uint32_t, 2> scratch;
  for (std::uint32_t i = 0; i < here; ++i) {
    for (const std::uint32_t e : elements[local.nodes[i]]) {
      const std::span<const std::uint32_t> joined = nodes_of(whole, e, scratch);
      if (std::any_of(joined.begin(), joined.end(), [&](std::uint32_t node) { return local.index(node) == here; }))
        body.fixed[i] = 1;
      else if (joined.front() == local.nodes[i])
        local.add(whole, e);
    }
  }
  return local;
}

/// A nonlinear subdomain, fixed at its ends.
struct SubdomainBody {
  LocalBody local;
  Dynamics dynamics{local.body};
  std::optional<SpringForces> springs;

  SubdomainBody(const SubdomainBody&) = delete;
  explicit SubdomainBody(LocalBody cut) : local(std::move(cut)) {
    if (SpringBlocks::covers(local.body)) springs.emplace(local.body);
  }
  /// Computes F(x, v), for springs without the weight of the nodes: only differences are used.
  void forces(const Vector& x, const Vector& v, Vector& f) {
    if (!springs) {
      dynamics.forces(x, v, f);
      return;
    }
    const NodeArrays& found = springs->at(x, v);
    f.resize(x.size());
    for (std::uint32_t i = 0; i < local.nodes.size(); ++i) at_node(f, i) = found.at(i);
  }
};

/// The nonlinear subdomain of a body with a hand on it.
class IndentedSubdomain {
 public:
  IndentedSubdomain(const Linearisation& at, SubdomainBody& body, const IndentationRequest& request)
      : body_(body), s_(request.shift_1_s), x_(body.local.restricted(at.body->state().x)) {
    const LocalBody& local = body.local;
    for (const auto& [node, weight] : request.port) port_.emplace_back(local.index(node), weight);
    const Matrix responses = side_by_side(request.responses.first(3));
    responses_.resize(x_.size(), 3);
    for (std::uint32_t i = 0; i < local.nodes.size(); ++i)
      responses_.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = at.body->rows(local.nodes[i], responses);
    Mat3 compliance;
    for (int axis = 0; axis < 3; ++axis) compliance.col(axis) = gather(port_, responses_.col(axis));
    kappa_ = 3 * StaticIndentations::kHandStiffnessRatio / compliance.trace();
    begin_ = (compliance + Mat3::Identity() / kappa_).inverse();
    const Vector still = Vector::Zero(x_.size());
    body_.forces(x_, still, at_stamp_);
    take_diagonal(at, local, request.diagonal);
  }

  /// Returns f on the linear body.
  Vec3 first_load(const Vec3& displacement) const { return begin_ * displacement; }
  Vec3 load(const Vec3& displacement, const Vector& w) const { return kappa_ * (displacement - gather(port_, w)); }
  /// Returns P^-1 B f in the subdomain.
  Vector linear_response(const Vec3& f) const { return responses_ * f; }
  /// Computes the subdomain's nonlinear response to `displacement`, and f, from the linear one; returns false if the solver
  /// fails.
  bool follow(const Vec3& displacement, Vec3& f, Vector& w) const {
    double enough = 0;
    for (int round = 0; round < StaticIndentations::kEndRounds; ++round) {
      move_ends(linear_response(f), w);
      if (!descend(displacement, enough, w)) return false;
      f = load(displacement, w);
    }
    return true;
  }

 private:
  /// Sets the diagonal blocks; a node without its own coordinate gets the mean of those that have one.
  void take_diagonal(const Linearisation& at, const LocalBody& local, std::span<const Mat3> diagonal) {
    Mat3 sum = Mat3::Zero();
    double count = 0;
    for (const std::uint32_t node : local.nodes) {
      const std::uint32_t row = at.body->coordinate(node);
      blocks_.emplace_back(row == BodyOperator::kNone ? Mat3(Mat3::Zero()) : diagonal[row]);
      sum += blocks_.back();
      count += row == BodyOperator::kNone ? 0 : 1;
    }
    assert(count > 0 && sum.isApprox(sum.transpose(), 1e-9) && sum.trace() > 0);
    for (Mat3& block : blocks_)
      if (block.isZero(0)) block = sum / count;
    for (const auto& [i, b] : port_)
      if (!local.body.fixed[i]) blocks_[i] += kappa_ * b * b * Mat3::Identity();
    for (Mat3& block : blocks_) block = block.inverse().eval();
  }
  void move_ends(const Vector& to, Vector& w) const {
    const auto& fixed = body_.local.body.fixed;
    for (std::uint32_t i = 0; i < fixed.size(); ++i)
      if (fixed[i]) at_node(w, i) = at_node(to, i);
  }
  /// Returns B f - s^2 M w + F(x* + w, s w) - F(x*, 0).
  Vector residual(const Vec3& displacement, const Vector& w) const {
    Vector r;
    body_.forces(x_ + w, s_ * w, r);
    r -= at_stamp_ + s_ * s_ * body_.dynamics.masses().cwiseProduct(w);
    scatter(port_, load(displacement, w), r);
    mask(body_.local.body.fixed, r);
    return r;
  }
  Vector preconditioned(const Vector& r) const {
    Vector z(r.size());
    for (std::uint32_t i = 0; i < blocks_.size(); ++i) at_node(z, i) = blocks_[i] * at_node(r, i);
    return z;
  }
  /// Minimises by nonlinear conjugate gradients (Polak and Ribiere), with the step along each direction to the zero of the force
  /// along it, estimated from two evaluations: at its beginning and at a trial. If the trial is close to the zero, the residual
  /// is interpolated linearly instead of evaluated again. `enough`: tolerance, 0 if it is not known yet.
  bool descend(const Vec3& displacement, double& enough, Vector& w) const {
    assert(w.size() == x_.size());
    Vector r = residual(displacement, w), z = preconditioned(r), direction = z;
    double size = r.dot(z), trial = 1;
    if (enough == 0) enough = kResidualShare * kResidualShare * size;
    for (int k = 0; k < kGradientStepsMax && size > enough; ++k) {
      const double pull = direction.dot(r);
      if (!(pull > 0)) {
        direction = z;
        continue;
      }
      const Vector there = residual(displacement, w + trial * direction), before = r;
      const double left = direction.dot(there), step = trial * (left < pull ? std::clamp(pull / (pull - left), 0.1, 3.0) : 3.0);
      w += step * direction;
      if (std::abs(step - trial) < kInterpolatedChangeMax * trial)
        r += step / trial * (there - r);
      else
        r = residual(displacement, w);
      trial = std::clamp(step, kTrialStepLeast, 1.0);
      z = preconditioned(r);
      const double last = size;
      size = r.dot(z);
      if (!std::isfinite(size)) return false;
      direction = z + std::max(0.0, (size - before.dot(z)) / last) * direction;
    }
    return true;
  }

  SubdomainBody& body_;
  double s_, kappa_ = 0;
  Vector x_, at_stamp_;
  Matrix responses_;
  Mat3 begin_ = Mat3::Zero();
  NodeWeights port_;
  std::vector<Mat3> blocks_;  // inverse diagonal blocks
};

}  // namespace

struct StaticIndentations::Cut {
  std::vector<std::uint32_t> port;
  SubdomainBody body;
};

StaticIndentations::~StaticIndentations() = default;

StaticIndentations::StaticIndentations(const LumpedBody& body) : body_(&body), elements_(body.nodes.size()) {
  std::array<std::uint32_t, 2> scratch;
  for (std::uint32_t e = 0; e < elements_of(body); ++e)
    for (const std::uint32_t node : nodes_of(body, e, scratch)) elements_[node].push_back(e);
}

std::vector<Vector> StaticIndentations::shapes(const Linearisation& at, const IndentationRequest& request) {
  assert(!request.displacements.empty() && request.responses.size() >= 3 && request.shift_1_s >= 0);
  std::vector<std::uint32_t> port;
  for (const auto& [node, weight] : request.port) port.push_back(node);
  if (!cut_ || cut_->port != port)
    cut_.reset(new Cut{port, SubdomainBody(cut_out(nodes_around(request.port, *body_, elements_), *body_, elements_))});
  const LocalBody& local = cut_->body.local;
  const IndentedSubdomain subdomain(at, cut_->body, request);
  std::vector<Vector> shapes;
  Vec3 f = subdomain.first_load(request.displacements.front());
  Vector w = subdomain.linear_response(f);
  for (const Vec3& displacement : request.displacements) {
    if (!subdomain.follow(displacement, f, w)) break;
    Vector whole = Vector::Zero(at.masses().size());
    for (std::size_t axis = 0; axis < 3; ++axis) whole += f[static_cast<Eigen::Index>(axis)] * request.responses[axis];
    for (std::uint32_t i = 0; i < local.nodes.size(); ++i)
      if (const std::uint32_t row = at.body->coordinate(local.nodes[i]); row != BodyOperator::kNone)
        at_node(whole, row) = at_node(w, i);
    if (!whole.allFinite()) break;
    shapes.push_back(std::move(whole));
  }
  return shapes;
}

}  // namespace palpate
