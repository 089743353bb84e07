// Threads through a body (common/patch/suture.hpp): forces at their bites, which slide along them without a change of the mesh.
//
// Bite j is x_j = sum_a w_ja x_a over nodes a of the body. With the direction u_i from the lower end of span i to the higher and
// its tension T_i,
//
//     f_j = T_(j+1) u_(j+1) - T_j u_j,   F_a = sum_j w_ja f_j
//
// so linear and angular momentum are kept. Bites, knots and material lengths are part of the state: those at the begin of a step,
// from which the return map gives the tensions anywhere in it; they move on after it. With g_i = sum_a (w_(i-1)a - w_ia) u_i,
// that is dl_i = -g_i . dx, the stiffness is
//
//     K = sum_im k_im g_i g_m^T + sum_i T_i / l_i (g_i (x) (1 - u_i u_i^T)),   k_im = sqrt(c_i c_m) / sum (c / k) in a group
//
// where the tangent of a slide has c_i in place of sqrt(c_i c_m): the part that is not symmetric is left out.
//
// Shapes: u, x, f 3, in frame W; F, g 3 N. Units: T, f N; l m; K N/m.
// Source: of sliding path constraints without remeshing, Guebert, Duriez, Cotin and Grisoni, Suturing simulation (VRIPHYS 2009).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/elements/body_state.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct NeedlePath;

struct SutureState {
  struct Thread {
    std::uint32_t suture = 0;  ///< of the body, of which it is, or is a part
    bool has_end = true;       ///< false: the end that a hand may hold was cut off
    SutureLaw law;             ///< without bites: it is on a needle, or torn out of the body
    std::shared_ptr<const std::vector<SutureBite>> bites;
    OfSpans length_m{};        ///< L_i
    std::optional<Vec3> hand;  ///< h; none: nobody holds the end
  };
  std::vector<Thread> threads;  ///< those of the body first, by number; then what was cut off them
  double torn_m = 0;            ///< length that bites cut through the tissue
  std::uint32_t torn_out = 0;   ///< bites that have left the body
};

/// The thread on a needle, and the end of the needle [m].
struct ThreadOnNeedle {
  std::uint32_t which = 0;
  Vec3 at;
};

/// Returns the place of a thread's last bite; null if it has none.
std::shared_ptr<const NodeWeights> last_bite(const BodyState& state, std::size_t which);

class Sutures {
 public:
  /// A part k y y^T of a stiffness, y 3 N given at its nodes.
  struct Block {
    std::vector<std::pair<std::uint32_t, Vec3>> y;
    double stiffness_n_m = 0;
  };

  /// `body` must outlive it.
  explicit Sutures(const LumpedBody& body) : body_(&body) {}
  bool empty() const { return body_->sutures.empty(); }
  /// The lengths that the scene gives; null without threads.
  std::shared_ptr<const SutureState> begun() const;

  /// Returns where thread `which` lies.
  SuturePlace place_of(const BodyState& state, std::size_t which) const;
  SuturePull pull_of(const BodyState& state, std::size_t which, const SutureShape& shape) const;
  /// Returns the force with which the thread pulls its last bite to the hand; zero if nobody holds it.
  Vec3 pull_to_hand(const BodyState& state, std::size_t which) const;
  void add_forces(const BodyState& state, Vector& f) const;
  /// Adds those of one thread.
  void add_forces(const BodyState& state, std::size_t which, Vector& f) const;
  Vec3 force_on(const BodyState& state, std::uint32_t node) const;
  std::vector<Block> tangents(const BodyState& state) const;
  /// Adds those of one thread.
  void add_tangents(const BodyState& state, std::size_t which, std::vector<Block>& blocks) const;
  /// Energy of the threads [J].
  double energy(const BodyState& state) const;
  /// Moves the lengths on at the end of a step, and bites that bear too much through the tissue; those that leave it are gone.
  void follow(BodyState& state) const;
  /// Puts the end of a thread into a hand, where it is: no shorter than its tail. None: lets it go.
  void hold(BodyState& state, std::size_t which, const std::optional<Vec3>& hand) const;
  /// Returns the thread that has the end of a suture of the body, if it can be pulled.
  std::optional<std::uint32_t> end_of(const BodyState& state, std::uint32_t suture) const;
  /// Draws thread `which` through the tissue along the path of its needle, whose tip is at a depth: bites near both ends of each
  /// stretch that it passed, the tail before the first of all as long as the scene says. Returns false, and does nothing, if the
  /// tip is in the body, or the thread has not the bites or the length for it.
  bool draw_through(BodyState& state, std::size_t which, const NeedlePath& path, double depth_m) const;
  /// Returns the thread that is on a needle: of these sutures in turn the first whose end is neither tied nor cut off.
  std::optional<std::uint32_t> on_needle(const BodyState& state, std::span<const std::uint32_t> sutures) const;
  /// Ties a thread at its last bite, and lets its end go.
  void tie(BodyState& state, std::size_t which) const;
  /// Cuts the span that is nearest to `at` [m], if it is within reach; a hand keeps what is beyond. Returns false if none is.
  bool cut(BodyState& state, const Vec3& at, double reach_m) const;

 private:
  const LumpedBody* body_;
};

}  // namespace palpate
