#include "bench/measure/local_model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include "common/port/contact_law.hpp"
#include "server/body/linear_solver.hpp"
#include "server/body/skin.hpp"
#include "server/body/tangents.hpp"

namespace palpate {
namespace {

struct ModelBody {
  explicit ModelBody(const Scene& s) : scene(s), skin(scene.body, scene.tool.radius_m), dynamics(scene.body) {}
  Scene scene;
  Skin skin;
  Dynamics dynamics;
};

/// Motions with the modes and with the tool that holds a node, with K and D on them.
struct ModeProducts {
  Matrix of, k, d;
};

/// M + h/2 D + h^2/4 K, over all nodes or, with `products`, over modes.
class StepMatrix {
 public:
  StepMatrix(const ModelBody& body, const LocalStart& start, const ModeProducts* products, const std::vector<std::uint8_t>& held,
             double h)
      : h_(h), solver_(body.dynamics.nodes()) {
    if (products) {
      reduced_ = &start.modes;
      take(*products);
    } else {
      matrix_ = body.dynamics.make_matrix();
      body.dynamics.assemble(start.body, 1, h_ / 2, h_ * h_ / 4, held, false, matrix_);
      if (!solver_.factorise(matrix_)) throw std::runtime_error("a linearised body has no step of a millisecond");
    }
  }
  /// Replaces K and D of the modes.
  void take(const ModeProducts& products) {
    const Eigen::Index modes = reduced_->cols();
    const Matrix a = reduced_->transpose() * (h_ / 2 * products.d.leftCols(modes) + h_ * h_ / 4 * products.k.leftCols(modes));
    modes_.compute(Matrix::Identity(modes, modes) + 0.5 * (a + a.transpose()));
  }
  /// Solves for the velocities of the nodes under the right-hand side `b`, starting from `x`; rows of held nodes are zero, in `x`
  /// too.
  Vector operator()(const Vector& b, Vector x) {
    if (reduced_) return *reduced_ * modes_.solve(reduced_->transpose() * b);
    if (!solver_.solve(b, 1e-8, x).positive_definite) throw std::runtime_error("a linearised body has no step of a millisecond");
    return x;
  }

 private:
  double h_;  // [s]
  LinearSolver solver_;
  BlockMatrix matrix_;
  const Matrix* reduced_ = nullptr;
  Eigen::LDLT<Matrix> modes_;
};

/// One model, from its stamp on.
class LocalRun {
 public:
  LocalRun(const ModelBody& body, const LocalStart& start, const Vec3& tool, LocalModel model)
      : body_(&body),
        start_(&start),
        full_(model == LocalModel::full_forces),
        grasp_(start.port.kind == ContactKind::attach),
        held_(held_by(body, start)),
        tangents_(taken(body, start)),
        products_(full_ ? products_of(tangents_, start) : ModeProducts()),
        pace_(full_ ? pace_of(products_, start.modes) : Pace()),
        h_(0.001 / pace_.steps),
        step_(body, start, full_ ? &products_ : nullptr, held_, h_),
        port_(start.port),
        tool_begin_(tool),
        tool_(tool),
        w_(Vector::Zero(start.body.x.size())),
        v_(start.body.v) {
    mask(held_, v_);
    if (full_) v_ = start.modes * (start.modes.transpose() * body.dynamics.masses().cwiseProduct(v_));
    if (grasp_) at_node(v_, port_.node) = at_node(start.body.v, port_.node);
    body.dynamics.forces(start.body.x, start.body.v, at_stamp_);
    if (full_) d_stamp_ = d_on(start.body.v);
  }

  /// Moves the tool to `to` within a tick; returns the force on it there.
  Vec3 tick(const Vec3& to) {
    const Vec3 from = tool_;
    Vec3 force = Vec3::Zero();
    const int steps = pace_.steps;
    if (!pace_.dampers_explicit) renew_dampers(to);
    for (int k = 1; k <= steps; ++k) force = step(k == steps ? to : Vec3(from + static_cast<double>(k) / steps * (to - from)));
    return force;
  }

 private:
  Vec3 step(const Vec3& to) {
    Vector pushed = Vector::Zero(w_.size());
    if (port_.touching && !grasp_) scatter(body_->skin.weights(port_.point), port_.lambda, pushed);
    const Vector now = forces(w_, v_), before = free_of(v_);
    const Vector& masses = body_->dynamics.masses();
    const Vec3 tool_speed = (to - tool_) / h_;
    // A V1 = M V0 + h/2 (G0 + G1 without V1), the linear part of G1 at w0 + h/2 V0.
    Vector w = w_ + h_ / 2 * before, none = Vector::Zero(w.size());
    if (grasp_) at_node(w, port_.node) = to - tool_begin_, at_node(none, port_.node) = tool_speed;
    Vector then = linear_forces(w, none);
    if (full_) {
      // Predicted state under the present forces, for their nonlinear part.
      const Vector a = start_->modes * (start_->modes.transpose() * (now + pushed));
      Vector w_then = w_ + h_ * before + h_ * h_ / 2 * a, v_then = before + h_ * a;
      if (grasp_) at_node(w_then, port_.node) = to - tool_begin_, at_node(v_then, port_.node) = tool_speed;
      then += forces(w_then, v_then) - linear_forces(w_then, v_then);
    }
    Vector b = masses.cwiseProduct(before) + h_ / 2 * (now + then + pushed);
    mask(held_, b);
    Vector v = step_(b, before);
    w_ += h_ / 2 * (before + v);
    if (grasp_) at_node(w_, port_.node) = to - tool_begin_, at_node(v, port_.node) = tool_speed;
    v_ = v;
    tool_ = to;
    if (!grasp_) close(to);
    return grasp_ ? felt_at_node() : Vec3(port_.touching ? Vec3(-port_.lambda) : Vec3::Zero());
  }

  static std::vector<std::uint8_t> held_by(const ModelBody& body, const LocalStart& start) {
    std::vector<std::uint8_t> held = body.scene.body.fixed;
    if (start.port.kind == ContactKind::attach) held[start.port.node] = 1;
    return held;
  }
  static Tangents taken(const ModelBody& body, const LocalStart& start) {
    Tangents tangents(body.dynamics);
    tangents.take(start.body);
    return tangents;
  }
  /// Nonlinear forces are explicit: steps are short for springs that stiffen and rotate, and for dampers that rotate. If dampers
  /// would require more than kMostSteps, they join the linear part, which is then updated in every tick.
  struct Pace {
    int steps = 1;  ///< per tick
    bool dampers_explicit = true;
  };
  static Pace pace_of(const ModeProducts& products, const Matrix& modes) {
    constexpr double kTickS = 0.001, kPartOfStable = 0.5, kMostBraked = 1;
    constexpr int kMostSteps = 8;
    const auto largest = [&](const Matrix& of) {
      return Eigen::SelfAdjointEigenSolver<Matrix>(modes.transpose() * of.leftCols(modes.cols()), Eigen::EigenvaluesOnly)
          .eigenvalues()
          .cwiseAbs()
          .maxCoeff();
    };
    const int steps = std::max(2, static_cast<int>(std::ceil(kTickS * std::sqrt(largest(products.k)) / (2 * kPartOfStable))));
    const double braked = kTickS * largest(products.d) / kMostBraked;
    if (braked > std::max(steps, kMostSteps)) return {steps, false};
    return {std::max(steps, static_cast<int>(std::ceil(braked))), true};
  }
  Vector free_of(Vector y) const {
    mask(held_, y);
    return y;
  }
  Vector linear_forces(const Vector& w, const Vector& v) const {
    if (full_) return at_stamp_ + d_stamp_ - products_.k * coordinates(w) - products_.d * coordinates(v);
    Matrix change(w.size(), 2), k, d;
    change << w, v - start_->body.v;
    tangents_.multiply(change, k, d);
    return at_stamp_ - k.col(0) - d.col(1);
  }
  static ModeProducts products_of(const Tangents& tangents, const LocalStart& start) {
    const bool grasp = start.port.kind == ContactKind::attach;
    ModeProducts products;
    products.of = start.modes;
    if (grasp) {
      products.of.conservativeResize(Eigen::NoChange, products.of.cols() + 3);
      products.of.rightCols<3>().setZero();
      products.of.block<3, 3>(3 * static_cast<Eigen::Index>(start.port.node), start.modes.cols()).setIdentity();
    }
    tangents.multiply(products.of, products.k, products.d);
    return products;
  }
  Vector d_on(const Vector& v) const {
    Matrix k, d;
    tangents_.multiply(v, k, d);
    return d.col(0);
  }
  Vector coordinates(const Vector& y) const {
    Vector of(products_.k.cols());
    of.head(start_->modes.cols()) = start_->modes.transpose() * body_->dynamics.masses().cwiseProduct(y);
    if (grasp_) of.tail<3>() = at_node(y, port_.node);
    return of;
  }
  Vector forces(const Vector& w, const Vector& v) const {
    if (!full_) return linear_forces(w, v);
    Vector f;
    if (pace_.dampers_explicit) {
      body_->dynamics.forces(start_->body.x + w, v, f);
      return f;
    }
    body_->dynamics.forces(start_->body.x + w, Vector::Zero(v.size()), f);
    return f - products_.d * coordinates(v);
  }
  /// Updates D at the body's state halfway through the tick, as forces are linear in velocities there.
  void renew_dampers(const Vec3& to) {
    BodyState halfway{0, start_->body.x + w_ + 0.5 * pace_.steps * h_ * v_, Vector::Zero(v_.size())};
    if (grasp_) at_node(halfway.x, port_.node) += 0.5 * (tool_ + to) - tool_begin_ - at_node(w_, port_.node);
    tangents_.take(halfway);
    tangents_.multiply_sum(products_.of, 0, 1, products_.d);
    step_.take(products_);
    responses_.clear();
  }
  Vec3 felt_at_node() const {
    if (full_) return body_->dynamics.element_force({0, start_->body.x + w_, v_}, port_.node);
    return body_->dynamics.element_force(start_->body, port_.node) +
           Vec3(at_node(linear_forces(w_, v_), port_.node) - at_node(at_stamp_, port_.node));
  }
  /// Velocities of the nodes within a step for a unit force along each axis at a vertex of the skin.
  const Matrix& responses_at(std::uint32_t vertex) {
    const auto [known, is_new] = responses_.try_emplace(vertex);
    if (is_new) {
      known->second.resize(w_.size(), 3);
      for (int axis = 0; axis < 3; ++axis) {
        Vector load = Vector::Zero(w_.size());
        scatter(body_->skin.vertex_weights(vertex), Vec3::Unit(axis), load);
        mask(held_, load);
        known->second.col(axis) = h_ / 2 * step_(load, Vector::Zero(w_.size()));
      }
    }
    return known->second;
  }
  /// Resolves the contact at the end of the step.
  void close(const Vec3& tool) {
    const Skin& skin = body_->skin;
    const Vector x = start_->body.x + w_;
    skin.place(x, positions_);
    if (!port_.touching) {
      const Onset onset = look_for_contact(skin.view(), positions_, tool, port_.clearance);
      port_.lambda.setZero();
      if (!onset.touches) return;
      port_.point = onset.nearest.point;
    }
    Matrix responses;
    ContactClosure closure;
    for (int slides = 0;; ++slides) {
      const Skin::Weights b = skin.weights(port_.point);
      const Triangle& t = skin.view().triangles[port_.point.triangle];
      responses = Matrix::Zero(w_.size(), 3);
      for (std::size_t k = 0; k < 3; ++k) responses += port_.point.weight[static_cast<int>(k)] * responses_at(t[k]);
      Mat3 compliance;
      for (int axis = 0; axis < 3; ++axis) compliance.col(axis) = h_ / 2 * gather(b, responses.col(axis));
      closure = close_contact(skin.position(port_.point, b, x), 0.5 * (compliance + compliance.transpose()),
                              normal_at(skin.view(), positions_, port_.point), tool, port_.parameters);
      if (closure.slip.squaredNorm() > 0) port_.point = slide(skin.view(), positions_, port_.point, closure.slip);
      if (slides == kSlidesMax || closure.slip.norm() < kSlipToleranceM) break;
    }
    port_.lambda = closure.lambda;
    port_.touching = closure.lambda.squaredNorm() > 0;
    if (!port_.touching)
      port_.clearance = clearance_of(port_.point, tool - position_at(skin.view(), positions_, port_.point),
                                     normal_at(skin.view(), positions_, port_.point));
    v_ += responses * closure.lambda;
    w_ += h_ / 2 * responses * closure.lambda;
  }

  const ModelBody* body_;
  const LocalStart* start_;
  bool full_;
  bool grasp_;
  std::vector<std::uint8_t> held_;
  Tangents tangents_;
  ModeProducts products_;
  Pace pace_;
  double h_;  // step [s]
  StepMatrix step_;
  ToolPort port_;
  Vec3 tool_begin_, tool_;
  Vector w_, v_, at_stamp_, d_stamp_;  // F(x*, v*), D v*
  std::unordered_map<std::uint32_t, Matrix> responses_;
  std::vector<double> positions_;
};

}  // namespace

std::vector<std::optional<Vec3>> local_forces(const Scene& scene, const ToolPath& path, std::span<const Micros> ages,
                                              std::span<const LocalStart> starts, LocalModel model) {
  assert(scene.body.relaxation.empty());
  const ModelBody body(scene);
  const auto tick_of = [](Micros t) { return static_cast<std::int64_t>(std::llround(1e3 * seconds(t))); };
  const auto at = [&](std::int64_t tick) {
    return path[static_cast<std::size_t>(std::clamp<std::int64_t>(tick, 0, static_cast<std::int64_t>(path.size()) - 1))];
  };
  std::vector<std::optional<Vec3>> forces(path.size());
  std::optional<LocalRun> run;
  const LocalStart* of = nullptr;
  std::int64_t done = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (ages[i] < Micros{}) continue;
    const Micros stamp = from_seconds(1e-3 * static_cast<double>(i)) - ages[i];
    const auto nearest = std::min_element(starts.begin(), starts.end(), [&](const LocalStart& a, const LocalStart& b) {
      return std::chrono::abs(a.stamp - stamp) < std::chrono::abs(b.stamp - stamp);
    });
    const bool has_model = nearest != starts.end() && (model == LocalModel::whole_linear || nearest->modes.rows() > 0);
    if (!has_model) continue;
    if (&*nearest != of) {
      of = &*nearest;
      done = tick_of(of->stamp);
      run.emplace(body, *of, at(done), model);
    }
    while (done < static_cast<std::int64_t>(i)) forces[i] = run->tick(at(++done));
  }
  return forces;
}

void replace_patches(ReplayResult& result, const Scene& scene, LocalModel model) {
  ToolPath path;
  std::vector<Micros> ages;
  for (const ReplayTick& tick : result.ticks) {
    path.push_back(tick.position);
    ages.push_back(tick.patch_age);
  }
  const auto forces = local_forces(scene, path, ages, result.starts, model);
  std::vector<Vec3> felt, reference;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    ReplayTick& tick = result.ticks[i];
    if (forces[i]) tick.felt = *forces[i];
    felt.push_back(tick.felt);
    reference.push_back(tick.reference);
  }
  result.fidelity = compare(felt, reference, kSkipTicks);
}

}  // namespace palpate
