// Recommends support, tip, mesh, step and scheme for a surface and a material on this machine: the error and cost of each
// candidate, and the cheapest that keeps both bounds.
//
// Candidates are lattices of hexahedra (linear tetrahedra lock near Poisson's ratio 1/2) with about kNodes nodes. A solid without
// given dimensions is characterised by its volume V and the area A of its surface: a lattice of spacing h has about V / h^3 + A /
// (2 h^2) nodes, and V / A is half the thickness of a thin body.
//
// Error of the force of a light touch against the continuum, at kPlaces distant places of the surface, the same for all lattices
// and away from the support: compliance C = n^T B^T K^-1 B n (touch_compliance.hpp), over lattices of spacing h
//
//     C(h) = C_0 + c h^p,   p = kContactOrder,   C_0, c by least squares,   error of a mesh = C_0 / C - 1
//
// p is the observed order of convergence of balls on layers and of bending bodies (docs/results/tissue.md: 1.6 to 2.1).
// `model_error`, the largest distance of a C from the line over C_0, says how far the model can be trusted. The error of a mesh
// is that at the top, as is `model_error`; the worst of all places is reported as well. Deep presses, and glued edges, are not
// covered.
//
// Volume: a lattice misses thin parts of the surface, and thus another body is compared. Of fast meshes that is
// chosen for which the larger of error and missed volume is smallest; more than kVolumeMissed is said.
//
// Error of the step: the highest node moves down by 10 mm in 0.5 s (bench/measure/pushed_cube.hpp); root mean square of the force
// against steps of a quarter of the shortest.
//
// Cost: mean processor time of a frame with one pressing hand (server/io/frame_cost.hpp) at the most expensive place, with the
// patches that palpate-server would choose; it must stay below kShareOfFrame of 1 / rate. A hand that slides takes up to 1.3
// times as long, single frames of a press 1.5 times. A deep press, to half of the shortest side and at most kDeepestM, within 0.2
// s, takes longer: of a mesh that keeps the rate the longest step of one at each of the places is measured as well, with the mean
// of its patches. Where other load takes the core (`core_share`), frames take longer on the clock.
//
// Bodies: shells of the surface that neither overlap nor contain each other are bodies by themselves, of which a lattice keeps
// one.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/fidelity/replay.hpp"
#include "server/io/frame_cost.hpp"

namespace palpate {

inline constexpr double kContactOrder = 1.7, kShareOfFrame = 0.6, kVolumeMissed = 0.03, kDeepestM = 0.020;
inline constexpr std::size_t kPlaces = 5, kFewestMeshes = 3;

struct AdviceRequest {
  std::filesystem::path surface;  ///< STL or OBJ
  double scale = 1;               ///< metres per unit of the file
  std::string up = "z";           ///< axis of the surface that points up in the scene: x, -x, y, -y, z or -z
  std::string material;           ///< name of the material
  double rate_hz = 20, error = 0.05;
  std::optional<double> radius_m;    ///< radius of the tip; empty: proposed
  std::optional<double> held_share;  ///< fixed share of the height, from below; empty: proposed
};

/// The surface on the plane z = 0 over the origin, and the quantities that follow from it alone.
struct AdvisedBody {
  Vec3 rotation_deg = Vec3::Zero(), offset_m = Vec3::Zero();
  Vec3 size_m = Vec3::Zero();
  double volume_m3 = 0, area_m2 = 0, mass_kg = 0;
  std::vector<double> bodies_m3 = {};  ///< volumes of the bodies that the surface bounds, the largest first
  double held_below_m = 0, held_volume_share = 0;
  double radius_m = 0;
};

struct AdvisedMesh {
  double spacing_m = 0;
  std::size_t nodes = 0, held = 0, cells = 0;
  double filled_share = 1;  ///< volume over that of the surface
  std::vector<double> compliances_m_n = {};
  double mesh_error = 0, worst_error = 0;  ///< error at the top, and the largest of all places
  Vec3 worst_error_place = Vec3::Zero();
  // For candidates whose cost was measured, at the most expensive place:
  Scheme scheme = Scheme::hyper;
  double step_ms = 0, patch_ms = 0;  ///< per frame; infinite if a step finds no solution
  double core_share = 1;             ///< share of a core that other load left to the measurement
  Vec3 worst_place = Vec3::Zero();
  double deep_ms = 0;  ///< longest frame of a deep press, at the most expensive place; 0: not measured
  Vec3 deep_place = Vec3::Zero();
  double frame_ms() const { return step_ms + patch_ms; }
  bool timed() const { return frame_ms() > 0; }
  bool keeps_volume() const { return std::abs(filled_share - 1) <= kVolumeMissed; }
};

struct Advice {
  AdvisedBody body;
  std::vector<AdvisedMesh> tried;
  std::size_t chosen = 0;
  double step_s = 0.01, step_error = 0;
  double deep_m = 0;        ///< depth of a deep press
  bool step_known = false;  ///< false: no step could be compared
  double model_error = 0;
  bool true_enough = false, fast_enough = false;
  double error() const { return tried[chosen].mesh_error + step_error; }
  bool error_known() const { return tried.size() >= kFewestMeshes; }  ///< fewer meshes cannot be extrapolated
};

/// Callbacks while advise() runs.
struct AdviceHearer {
  std::function<void(const std::string&)> says = [](const std::string&) {};
  std::function<void(const AdvisedBody&)> body = [](const AdvisedBody&) {};
};

/// Throws InputError for an invalid surface or material, and if the surface cannot be meshed or fixed, or no step of its body
/// finds a solution.
Advice advise(const AdviceRequest& request, const Stopwatch& stopwatch, const AdviceHearer& hearer = {});

/// Scheme that a server chooses for one hand, alone in its room.
Scheme served_scheme(const FrameCost& cost, double rate_hz);

/// Returns a scene file that refers to the surface `file` in its own folder.
std::string advised_scene(const AdviceRequest& request, const AdvisedBody& body, const std::string& file, double spacing_m,
                          double step_s);

/// C_0 and the largest distance from the line over it, for values over sizes; at least three.
struct Continued {
  double value = 0, model_error = 0;
};
Continued continue_to_no_size(const std::vector<double>& sizes, const std::vector<double>& values, double order);

}  // namespace palpate
