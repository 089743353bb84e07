// Coarse and fine mesh at two rates, joined through Norton equivalents: the multirate idea of Astley and Hayward, on a mesh of
// one resolution. Linear meshes only, as the split rests on superposition.
//
// The coordinates q of a linear mesh (second_order.hpp) are split: F near the port, stepped every h = 1 ms, and C, the rest,
// every H = n h. Both by the average-acceleration rule  q1 = q0 + h v0 + h^2/4 (a0 + a1),  v1 = v0 + h/2 (a0 + a1).  Over a
// coarse step C responds to the fine side's q_F, v_F at the step's end with the acceleration
//     a_C = R - A^-1 (K_CF q_F + D_CF v_F),     A = M_C + H/2 D_CC + H^2/4 K_CC
//     R   = -A^-1 (D_CC v~ + K_CC q~),          q~ = q_C + H v_C + H^2/4 a_C,  v~ = v_C + H/2 a_C  (at the step's begin)
// so for the fine side it is a source (the force from R alone) in parallel with an admittance, constant matrices for a linear
// mesh:
//     f = f_source - Y_q q_F - Y_v v_F,
//     f_source = -(K_FC (q~ + H^2/4 R) + D_FC (v~ + H/2 R)),
//     Y_q = -(H^2/4 K_FC + H/2 D_FC) A^-1 K_CF,   Y_v = -(H^2/4 K_FC + H/2 D_FC) A^-1 D_CF
// Inside a coarse step, at tick k of n, both fade in over the force f_0 at its begin with theta = k / n: C moves straight from
// its state at the begin to the state that follows from the fine side's present motion. At n = 1 this is exactly the unsplit
// mesh.
// Source: Astley and Hayward, ICRA 1998 (there with two resolutions and update rates below 1 kHz).
#pragma once

#include <span>

#include "bench/paper/specimen.hpp"
#include "common/port/scheme.hpp"

namespace palpate {

/// Motion of the port: displacement [m] and velocity [m/s] at every tick, p entries each; at rest before.
struct PortMotion {
  std::vector<Vector> d, rate;
};

/// Run of an unsplit mesh: force on the holder [N] and state at every tick.
struct MeshRun {
  std::vector<Vector> force, q, v;
};
MeshRun step_whole(const SecondOrderSystem& system, const PortMotion& motion, double tick_s);

/// Force on the holder [N] at every tick of the split mesh. `fine`: per coordinate, 1 for F; the port's neighbours must be in F.
/// `ticks_per_frame` is n. Ends early if the motion diverges.
std::vector<Vector> step_split(const SecondOrderSystem& system, const std::vector<std::uint8_t>& fine, int ticks_per_frame,
                               const PortMotion& motion, double tick_s);

/// Force of the whole mesh at the last frame, held.
std::vector<Vector> hold_frames(const MeshRun& whole, int ticks_per_frame);

/// Force of patches of `scheme`, made from the whole mesh's state at every frame and played until the next (no delay), with the
/// program's own patch builder and player. The specimen is at rest, so displacements must be small compared with its elements.
std::vector<Vector> play_patches(const Specimen& specimen, const SecondOrderSystem& system, const MeshRun& whole,
                                 const PortMotion& motion, int ticks_per_frame, Scheme scheme);

}  // namespace palpate
