// Patches of the two schemes of the paper that no server offers: `two-layer` and `balanced`. Both reduce the body at its present
// state to a basis V, orthonormal in the masses (V^T M V = 1):
//
//     q'' + D q' + K q = g + B_k d + B_d d',     K = V^T K V diagonal,  D = V^T D V,  g = V^T F(x*, v*) + D q'*,  q'* = V^T M v*
//
//   two-layer   the nodes around the contact, with outer elements and masses that represent the rest of the body (two_layer.hpp);
//               V: rational Krylov directions at the port (basis.hpp). Forces and velocities at the stamp are the body's own.
//   balanced    the whole body; V: balanced off-line at the body's rest state for this contact (balanced_basis.hpp)
//
// Each mode is at least as stiff as the softest mode of the body at rest, and a grasp is projected to be passive, as in a
// server's patches (patch_build.hpp).
//
// Shapes: N nodes; V 3 N x r [kg^-1/2]; K, D r x r [1/s^2], [1/s].
// Limits: one tool; no relaxation. `two-layer` is for bodies of springs.
#pragma once

#include <memory>
#include <optional>

#include "bench/paper/balanced_basis.hpp"
#include "bench/paper/two_layer.hpp"
#include "server/body/dynamics.hpp"
#include "server/reduction/basis.hpp"
#include "server/room/room.hpp"

namespace palpate {

class PaperPatches {
 public:
  enum class Model { two_layer, balanced };

  /// Requires a body without relaxation, and for `two_layer` one of springs. Throws InputError for a body without equilibrium.
  PaperPatches(Model model, const Scene& scene);

  /// Returns the patch of a tool at the state and port of `at`. `held`: the patch of scheme `hold` for the same tool and stamp,
  /// from which the new one has all that is not a model. `horizon`: age that the patch will reach. Returns none if the model's
  /// matrix is not definite.
  std::optional<Patch> build(const Room::Origin& at, const Patch& held, Micros horizon);

 private:
  /// The body that is reduced.
  struct Reduced {
    Linearisation at;
    Vector residual;         ///< F* of its nodes, zero for held nodes
    const LocalBody* local;  ///< null: the whole body
  };
  std::optional<Patch> reduce(const Reduced& body, const Room::Origin& at, const Patch& held, Micros horizon);
  std::optional<Matrix> krylov(const Reduced& body, const Dynamics& dynamics, const std::vector<Vector>& inputs,
                               const std::vector<Vector>& fine, int modes, Micros horizon) const;

  Model model_;
  LumpedBody body_;
  Dynamics dynamics_;
  Skin skin_;
  BodyState rest_;
  double softest_1_s2_ = 0, spacing_m_ = 0;
  TwoLayer two_layer_;
  BalancedBases balanced_;
};

}  // namespace palpate
