// Small models of a specimen at its port other than balanced truncation; each is again a second-order system.
//
//   ring        the nodes around the port free, the rest held, not reduced (figs 7 and 8): Specimen::ring()
//   condensed   the whole body, static condensation onto the same nodes: q = V q_near, V = [I; -K_oo^-1 K_on] (Guyan)
//   krylov      the whole body on the responses to the port at given complex frequencies s: V spans Re and Im of
//               (s^2 M + s D + K)^-1 (B_k + s B_d); with several moments at one real s, the server's own krylov_basis()
//   patch       the server's own: the port scheme's patch, number by number
#pragma once

#include <optional>
#include <vector>

#include "bench/paper/specimen.hpp"
#include "server/reduction/basis.hpp"

namespace palpate {

SecondOrderSystem condensed(const Specimen& specimen, const SecondOrderSystem& system, int layers);

/// One moment at each of `shifts_1_s`; a complex one counts twice. Linearly dependent directions are omitted.
SecondOrderSystem krylov(const SecondOrderSystem& system, const std::vector<Complex>& shifts_1_s);
/// Inputs of a basis: the port's columns, directions that are in it as they are, and the residual force (3 N each).
struct KrylovInputs {
  std::vector<Vector> ports, fine;
  Vector residual;
};
/// Returns the server's krylov_basis() of these inputs, with solves to `tolerance`; none if P is not positive definite.
std::optional<Matrix> krylov_directions(const Linearisation& at, ShiftedSolver& solver, const KrylovInputs& inputs,
                                        const BasisRequest& request, double tolerance);
/// `modes` directions of the server's basis at one real shift.
SecondOrderSystem krylov_moments(const Specimen& specimen, const SecondOrderSystem& system, double shift_1_s, int modes);

/// The patch of build_patch() for the port at rest.
SecondOrderSystem patch_model(const Specimen& specimen, const SecondOrderSystem& system, int states);

}  // namespace palpate
