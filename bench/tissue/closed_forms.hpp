// Solutions of elasticity that need no mesh, for the laws of principal_law.hpp.
//
// Homogeneous: uniaxial, F = diag(l, m, m) with P_22 = 0; equibiaxial, F = diag(l, l, m) with P_33 = 0; simple shear, F = 1 + g
// e_1 e_2^T, all of P.
//
// Torsion of a cylinder of radius a whose sections turn by t [1/m] along it and keep their shape, incompressible, W = dPsi/dI_1
// at I_1 = 3 + t^2 r^2:   moment  M = 4 pi t int W r^3 dr,   axial force at constant length  N = -2 pi t^2 int W r^3 dr
// (neo-Hookean of constant W = mu/2: M = pi mu t a^4 / 2, N = -pi mu t^2 a^4 / 4).
// Source: Rivlin, Large elastic deformations of isotropic materials VI, Phil. Trans. R. Soc. A 242 (1949).
//
// Thick sphere, a < R < b, free outside, whose inside moves out to r(a): the pressure inside. Small strains (Lame): u = A R + B /
// R^2, 3 K A = 4 mu B / b^3, p = 4 mu B (1/a^3 - 1/b^3). Large strains: r(R) minimises int Psi(r', r/R, r/R) 4 pi R^2 dR over
// piecewise linear r; p = dE/dr(a) / (4 pi r(a)^2). The error falls with the square of the length of the 400 pieces.
#pragma once

#include "bench/tissue/principal_law.hpp"

namespace palpate {

double uniaxial_stress(const SolidMaterial& material, double stretch);
double equibiaxial_stress(const SolidMaterial& material, double stretch);
Mat3 simple_shear_stress(const SolidMaterial& material, double shear);

struct TorsionAnswer {
  double moment_n_m = 0, axial_n = 0;
};
TorsionAnswer torsion_of_cylinder(const SolidMaterial& material, double radius_m, double turn_1_m);

/// Pressures in the thick sphere [Pa].
double lame_sphere_pressure(const SolidMaterial& material, double inner_m, double outer_m, double moved_m);
double sphere_pressure(const SolidMaterial& material, double inner_m, double outer_m, double moved_m);

}  // namespace palpate
