// Leapfrog for bodies of springs: second order, one evaluation of the forces a step, as long a step as is stable.
//
//     v*_n = v_(n-1/2) + h/2 a_(n-1)                       what the dampers see: second order too
//     a_n = M^-1 (F(x_n, v*_n) + B lambda_n)
//     v_(n+1/2) = v_(n-1/2) + h a_n,   x_(n+1) = x_n + h v_(n+1/2)
//
// Positions and velocities are in step at both ends of advance(). A touching tool closes the contact law at the end of each step:
// p_free is where the point would be at t_(n+1) without its lambda_n, and C = h^2 B^T M^-1 B, a multiple of the identity. A node
// that a tool holds is where the tool is. Tools that do not touch are looked for every kLookS at least while they are near.
//
// A mode of frequency w and damping g (x'' = -w^2 x - g x') is stable as long as the matrix of one step has no eigenvalue outside
// the unit circle: h w < 2 without damping, h g < 1 where that rules. w^2 and g are the largest of M^-1 K and M^-1 D at rest
// (power iteration), with kStiffer and kThicker for what deformation adds, and with the stiffening law's own growth. Where that
// leaves too short a step, or the body flies apart all the same, the frame is left to TR-BDF2, and told as a cut step.
//
// A crew shares the springs, slab by slab, and the loops over nodes: same bits whatever its size.
//
// Internally in single precision (spring_blocks.hpp); a displacement of 10 mm is right to 1 nm.
#pragma once

#include <vector>

#include "server/body/integrator.hpp"
#include "server/body/leapfrog_loops.hpp"
#include "server/body/spring_blocks.hpp"

namespace palpate {

/// Largest stable step of one mode [s]: w2 = w^2 [1/s^2], g [1/s].
double leapfrog_step_s(double w2, double g);

class ExplicitIntegrator final : public Stepper {
 public:
  static constexpr double kStiffer = 1.5, kThicker = 1.2;
  static constexpr double kShare = 0.9;  ///< of the stable step that is used
  static constexpr double kLookS = 0.001;
  static constexpr std::size_t kWorthSharing = 60'000;  ///< springs, with gaps: an evaluation of 30 us

  /// `dynamics` and `skin` must outlive it. SpringBlocks::covers() the body.
  ExplicitIntegrator(const Dynamics& dynamics, const Skin& skin);

  AdvanceReport advance(BodyState& state, std::vector<ToolPort>& ports, double until_s, double step_s,
                        const ToolMotion& tools) override;
  bool leaves_no_trace() const override { return true; }
  void employ(Crew& crew) override;
  /// That it takes at small strains [s].
  double step_s() const { return step_s_; }
  /// Springs, with gaps, that an evaluation goes through.
  std::size_t springs() const { return springs_.size(); }

 private:
  struct Contact {  // of one touching port
    bool valid = false;
    SurfacePoint point;
    Skin::Weights b;
    std::vector<std::uint32_t> around;                                           // vertices that are kept in place
    Vec3 at_rest = Vec3::Zero();                                                 // p where nothing has moved
    double softness_1_kg = 0;                                                    // B^T M^-1 B
    Vec3 tool = Vec3::Zero(), normal = Vec3::Zero(), p_unpushed = Vec3::Zero();  // at the step's end
  };

  double longest_step_s(double step_s) const;
  void take(const BodyState& state, const std::vector<ToolPort>& ports);
  void give(BodyState& state, const std::vector<ToolPort>& ports, const ToolMotion& tools, double until_s) const;
  void accelerate(const NodeArrays& velocity, const std::vector<ToolPort>& ports);
  void kick(double over_s);
  std::size_t node_parts() const { return crew_ ? crew_->size() : 1; }
  leapfrog::Nodes nodes_of(std::size_t part) const;
  /// work(0) ... work(parts - 1), with the crew where there is one.
  template <typename Work>
  void share(std::size_t parts, const Work& work) const;
  void step(std::vector<ToolPort>& ports, double begin_s, double h, const ToolMotion& tools);
  void close_contacts(std::vector<ToolPort>& ports, double end_s, double h, const ToolMotion& tools);
  void look(std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools);
  bool share_nodes(const std::vector<std::size_t>& ports) const;
  void refresh(Contact& contact, const SurfacePoint& point);
  std::vector<std::uint32_t> vertices_around(std::uint32_t triangle) const;
  void place(const std::vector<std::uint32_t>& vertices);
  void push(const Contact& contact, const Vec3& lambda);
  Vec3 moved(const Contact& contact, const NodeArrays& y) const;
  bool is_sound(double h) const;

  const Dynamics* dynamics_;
  const Skin* skin_;
  SpringBlocks springs_;
  Integrator fallback_;
  Crew* crew_ = nullptr;
  double w2_ = 0, g_ = 0, step_s_ = 0, spacing_m_ = 0;

  std::vector<float> inverse_mass_;  // 0: held
  std::vector<float> nowhere_;       // zeros: the same along an axis in which nothing moves
  std::vector<std::uint8_t> held_;
  NodeArrays u_, v_, a_, predicted_, f_;
  std::vector<Contact> contacts_;
  std::vector<std::size_t> closing_;  // ports whose contact is being closed
  std::vector<double> looked_for_s_;  // when a port that does not touch is looked for next
  std::vector<double> skin_positions_;
};

}  // namespace palpate
