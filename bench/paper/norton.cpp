#include "bench/paper/norton.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <stdexcept>

#include "common/player/player.hpp"
#include "server/reduce/patch_build.hpp"

namespace palpate {
namespace {

constexpr double kGrownN = 1e6;

/// Displacement, velocity, acceleration of some coordinates.
struct Motion2 {
  Vector q, v, a;
  explicit Motion2(Eigen::Index n) : q(Vector::Zero(n)), v(q), a(q) {}
  /// Applies the rule without its new acceleration.
  void predict(double h) {
    q += h * v + h * h / 4 * a;
    v += h / 2 * a;
  }
  void accept(const Vector& now, double h) {
    q += h * h / 4 * now;
    v += h / 2 * now;
    a = now;
  }
};

Matrix step_matrix(const Vector& mass, const Matrix& d, const Matrix& k, double h) {
  Matrix m = h / 2 * d + h * h / 4 * k;
  m.diagonal() += mass;
  return m;
}

Vector load(const SecondOrderSystem& s, const PortMotion& motion, std::size_t n) {
  return s.b_k * motion.d[n] + s.b_d * motion.rate[n];
}

Vector felt(const SecondOrderSystem& s, const PortMotion& motion, std::size_t n, const Vector& q, const Vector& v) {
  return s.k_port * motion.d[n] + s.d_port * motion.rate[n] - s.b_k.transpose() * q - s.b_d.transpose() * v;
}

using Indices = std::vector<Eigen::Index>;

/// The fine side and the coarse side as it appears from there.
class SplitMesh {
 public:
  SplitMesh(const SecondOrderSystem& s, const Indices& f, const Indices& c, int ticks, double h)
      : ticks_(ticks),
        h_(h),
        frame_(h * ticks),
        fine_(static_cast<Eigen::Index>(f.size())),
        coarse_(static_cast<Eigen::Index>(c.size())) {
    const Matrix k(s.stiffness), d(s.damping);
    k_cc_ = k(c, c);
    d_cc_ = d(c, c);
    k_fc_ = k(f, c);
    d_fc_ = d(f, c);
    k_ff_ = k(f, f);
    d_ff_ = d(f, f);
    coarse_step_.compute(step_matrix(s.mass(c), d_cc_, k_cc_, frame_));
    answer_k_ = coarse_step_.solve(k_fc_.transpose());
    answer_d_ = coarse_step_.solve(d_fc_.transpose());
    const Matrix reach = -(frame_ * frame_ / 4 * k_fc_ + frame_ / 2 * d_fc_);
    y_q_ = reach * answer_k_;
    y_v_ = reach * answer_d_;
    for (int tick = 1; tick <= ticks; ++tick) {
      const double theta = static_cast<double>(tick) / ticks;
      fine_steps_.emplace_back(step_matrix(s.mass(f), d_ff_ + theta * y_v_, k_ff_ + theta * y_q_, h));
    }
    begin_frame();
  }

  /// Advances one tick with the port's load on the fine side at its end.
  void advance(const Vector& fine_load) {
    ++tick_;
    const double theta = static_cast<double>(tick_) / ticks_;
    fine_.predict(h_);
    const Vector force =
        (1 - theta) * force_begin_ + theta * source_ - (d_ff_ + theta * y_v_) * fine_.v - (k_ff_ + theta * y_q_) * fine_.q;
    fine_.accept(fine_steps_[static_cast<std::size_t>(tick_ - 1)].solve(fine_load + force), h_);
    if (tick_ == ticks_) end_frame();
  }
  const Motion2& fine() const { return fine_; }

 private:
  void begin_frame() {
    tick_ = 0;
    force_begin_ = -(k_fc_ * coarse_.q + d_fc_ * coarse_.v);
    coarse_.predict(frame_);
    still_ = -coarse_step_.solve(d_cc_ * coarse_.v + k_cc_ * coarse_.q);
    source_ = -(k_fc_ * (coarse_.q + frame_ * frame_ / 4 * still_) + d_fc_ * (coarse_.v + frame_ / 2 * still_));
  }
  void end_frame() {
    coarse_.accept(still_ - answer_k_ * fine_.q - answer_d_ * fine_.v, frame_);
    begin_frame();
  }

  int ticks_, tick_ = 0;
  double h_, frame_;
  Motion2 fine_, coarse_;
  Matrix k_cc_, d_cc_, k_fc_, d_fc_, k_ff_, d_ff_;
  Matrix answer_k_, answer_d_;  // A^-1 K_CF, A^-1 D_CF
  Matrix y_q_, y_v_;
  Eigen::LDLT<Matrix> coarse_step_;
  std::vector<Eigen::PartialPivLU<Matrix>> fine_steps_;
  Vector force_begin_, source_, still_;
};

}  // namespace

MeshRun step_whole(const SecondOrderSystem& s, const PortMotion& motion, double tick_s) {
  const Matrix k(s.stiffness), d(s.damping);
  const Eigen::LDLT<Matrix> step(step_matrix(s.mass, d, k, tick_s));
  Motion2 m(s.size());
  MeshRun run;
  for (std::size_t n = 0; n < motion.d.size(); ++n) {
    m.predict(tick_s);
    m.accept(step.solve(load(s, motion, n) - s.damping * m.v - s.stiffness * m.q), tick_s);
    run.force.push_back(felt(s, motion, n, m.q, m.v));
    run.q.push_back(m.q);
    run.v.push_back(m.v);
  }
  return run;
}

std::vector<Vector> step_split(const SecondOrderSystem& s, const std::vector<std::uint8_t>& fine, int ticks_per_frame,
                               const PortMotion& motion, double tick_s) {
  Indices f, c;
  for (Eigen::Index i = 0; i < s.size(); ++i) (fine[static_cast<std::size_t>(i)] ? f : c).push_back(i);
  for (const Eigen::Index i : c)
    if (!s.b_k.row(i).isZero() || !s.b_d.row(i).isZero())
      throw std::invalid_argument("step_split: the port pulls at a coarse coordinate; the fine side must hold its neighbours");
  SplitMesh mesh(s, f, c, ticks_per_frame, tick_s);
  std::vector<Vector> force;
  Vector q = Vector::Zero(s.size()), v = q;
  for (std::size_t n = 0; n < motion.d.size(); ++n) {
    mesh.advance(load(s, motion, n)(f));
    q(f) = mesh.fine().q;
    v(f) = mesh.fine().v;
    force.push_back(felt(s, motion, n, q, v));
    if (!(force.back().norm() < kGrownN)) break;
  }
  return force;
}

std::vector<Vector> hold_frames(const MeshRun& whole, int ticks_per_frame) {
  std::vector<Vector> force;
  const auto n = static_cast<std::size_t>(ticks_per_frame);
  for (std::size_t i = 0; i < whole.force.size(); ++i) force.push_back(whole.force[i / n * n]);
  return force;
}

std::vector<Vector> play_patches(const Specimen& specimen, const SecondOrderSystem& s, const MeshRun& whole,
                                 const PortMotion& motion, int ticks_per_frame, Scheme scheme) {
  const Skin skin(specimen.body());
  std::vector<ToolPort> ports(1);
  ports[0].kind = ContactKind::attach;
  ports[0].node = specimen.port_node();
  const auto body_at = [&](std::size_t n) {
    BodyState state = specimen.rest();
    for (std::size_t i = 0; i < s.coordinates.size(); ++i) {
      state.x[s.coordinates[i]] += whole.q[n][static_cast<Eigen::Index>(i)];
      state.v[s.coordinates[i]] += whole.v[n][static_cast<Eigen::Index>(i)];
    }
    for (std::size_t j = 0; j < s.port_axes.size(); ++j) {
      const Eigen::Index row = 3 * static_cast<Eigen::Index>(specimen.port_node()) + s.port_axes[j];
      state.x[row] += motion.d[n][static_cast<Eigen::Index>(j)];
      state.v[row] += motion.rate[n][static_cast<Eigen::Index>(j)];
    }
    return state;
  };
  const Eigen::Index port_row = 3 * static_cast<Eigen::Index>(specimen.port_node());
  const Vec3 port_rest = specimen.rest().x.segment<3>(port_row);
  PatchPlayer player;
  std::vector<Vector> force;
  for (std::size_t n = 0; n < motion.d.size(); ++n) {
    const Micros now = kTick * static_cast<int>(n);
    if (n % static_cast<std::size_t>(ticks_per_frame) == 0) {
      const BodyState state = body_at(n);
      PatchRequest request;
      request.scheme = scheme;
      request.horizon = kTick * ticks_per_frame;
      const ToolAt tool{state.x.segment<3>(port_row), state.v.segment<3>(port_row)};
      ports[0].lambda = -specimen.dynamics().element_force(state, specimen.port_node());
      FrameModel frame(specimen.dynamics(), skin, 0);
      frame.begin(state, ports, std::span(&tool, 1), request.horizon);
      auto built = build_patch(frame, 0, request);
      if (!built) throw std::runtime_error("play_patches: the body gives no patch");
      built->patch.stamp = now;
      player = PatchPlayer(built->patch);
      force.push_back(whole.force[n]);
      continue;
    }
    Vec3 position = port_rest;
    for (std::size_t j = 0; j < s.port_axes.size(); ++j)
      position[static_cast<Eigen::Index>(s.port_axes[j])] += motion.d[n][static_cast<Eigen::Index>(j)];
    const Vec3 on_tool = player.advance({now, position}).force;
    Vector f(s.ports());
    for (std::size_t j = 0; j < s.port_axes.size(); ++j)
      f[static_cast<Eigen::Index>(j)] = -on_tool[static_cast<Eigen::Index>(s.port_axes[j])];
    force.push_back(f);
  }
  return force;
}

}  // namespace palpate
