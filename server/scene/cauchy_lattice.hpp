// Springs between the nodes of a lattice of boxes that together resist as an isotropic solid does.
//
// A box of a x b x c has springs along its edges, across its faces and through its middle, shared with the neighbouring boxes. A
// small homogeneous strain e stretches a spring of length L along the unit vector n by L n.e.n, so the boxes' energy density is
//
//     1/2 C_ijkl e_ij e_kl,     C_ijkl = 1/V sum over the springs of a box of k L^2 n_i n_j n_k n_l      V = a b c
//
// which is symmetric in all its indices for any k: lambda = mu (Cauchy's relation), so Poisson's ratio is 1/4 in space and, under
// plane stress, 1/3 in a sheet. C is isotropic, C_1111 = 3 mu and C_1122 = mu for all axes, mu = 2/5 E (sheet: 3/8 E), with
//
//     faces of a x b     k_ab = (mu V - 4 k_abc a^2 b^2 / L^2) (a^2 + b^2) / (2 a^2 b^2)         L^2 = a^2 + b^2 + c^2
//     edges along a      k_a = (3 - a^2/b^2 - a^2/c^2) mu V / a^2 + 4 k_abc a^2 / L^2     (sheet: (3 - a^2/b^2) mu V / a^2)
//
// for any k_abc through the middle. We use the least k_abc for which no k is negative: zero for cubes, where all other k are mu
// h. No such k_abc exists for boxes longer than about 1.6 times their thinnest side.
//
// A missing box contributes nothing: a spring is the sum of the shares of the boxes around it, 1/4 of k for each at an edge and
// 1/2 at a face. So a strained body has no stiffer skin, and its boundary is exact for homogeneous strain.
//
// Source: Born and Huang, Dynamical theory of crystal lattices, 1954, for Cauchy's relation; Lloyd, Szekely and Harders,
// Identification of spring parameters for deformable object simulation, IEEE TVCG 13 (2007), for lattices in simulation.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "server/scene/grid.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

inline constexpr double kCauchyPoisson = 0.25, kCauchyPoissonOfSheet = 1.0 / 3;

/// Spring stiffnesses of a box [N/m] for a Young's modulus of 1 Pa.
struct CellSprings {
  Vec3 edge = Vec3::Zero();  ///< along x, y, z
  Vec3 face = Vec3::Zero();  ///< across the faces normal to x, y, z
  double body = 0;           ///< through the middle
};

/// Returns the springs for a box with the sides `cell` [m]; for a sheet the third is the thickness. Empty if no set of
/// non-negative stiffnesses is isotropic.
std::optional<CellSprings> cauchy_springs(const Vec3& cell, bool planar);

/// Material of the cells of a lattice.
struct CauchyMaterial {
  double young_pa = 0;
  double damping_s = 0;  ///< damping of a spring over its stiffness
};

/// Springs of a set of cells, by their nodes' numbers; `materials` has one entry per cell of the set, in the order of the grid.
std::vector<Element> springs_of_cells(const CellSet& cells, const Grid& grid, std::span<const std::uint32_t> number,
                                      std::span<const Vec3> nodes, const CellSprings& springs,
                                      std::span<const CauchyMaterial> materials);

}  // namespace palpate
