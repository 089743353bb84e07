// Which mesh, element, step and scheme serve a surface and a material on this machine: each candidate's error and cost, and the
// cheapest that keeps both bounds.
//
// Error of the force of a light touch against the continuum. A tip of radius r presses the highest point of the surface with a
// small load f, spread as the server's contact spreads it (server/body/skin.hpp, weights B): compliance C = (B^T u) / f with
// K u = B f. Over lattices of spacing h, all of hexahedra,
//
//     C(h) = C_0 + c h^p,   p = kContactOrder,   C_0, c by least squares,   error of any mesh = C_0 / C - 1
//
// p is what balls on layers and bodies that bend converge with (docs/results/tissue.md: 1.6 to 2.1); `model_error`, the largest
// distance of a C from the line over C_0, is how far the model is to be trusted. Deep presses, and edges that are glued, are not
// in it.
//
// Error of the step: the highest node taken down by 10 mm in 0.5 s (bench/measure/pushed_cube.hpp), root mean square of the force
// against steps of a quarter of the shortest.
//
// Cost: processor time of a frame of the real room and server with one hand that presses (bench/measure/server_load.hpp), which
// must stay below kShareOfFrame of 1 / rate. What else the machine does while it is measured is not counted.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/fidelity/replay.hpp"

namespace palpate {

inline constexpr double kContactOrder = 1.7, kShareOfFrame = 0.7;

struct AdviceRequest {
  std::filesystem::path surface;  ///< STL or OBJ
  double scale = 1;               ///< from its units to metres
  std::string material;           ///< by name
  double rate_hz = 20, error = 0.05;
  double radius_m = 0.015;   ///< of the tip
  double held_share = 0.15;  ///< of the height, from below, that is fixed
};

struct AdvisedMesh {
  SolidElement element = SolidElement::hexahedron;
  double spacing_m = 0;
  std::size_t nodes = 0, cells = 0;
  double compliance_m_n = 0, mesh_error = 0;
  // Of candidates whose cost was measured:
  Scheme scheme = Scheme::hyper;
  double step_ms = 0, patch_ms = 0;  ///< a frame; of everything but the step
  double frame_ms() const { return step_ms + patch_ms; }
  const char* element_name() const;
};

struct Advice {
  std::vector<AdvisedMesh> tried;
  std::size_t chosen = 0;
  double step_s = 0.01, step_error = 0;
  double model_error = 0;
  bool true_enough = false, fast_enough = false;
  double error() const { return std::abs(tried[chosen].mesh_error) + step_error; }
};

/// Throws InputError for a surface or a material that is none, std::runtime_error where no equilibrium is found.
Advice advise(const AdviceRequest& request, const Stopwatch& stopwatch, const std::function<void(const std::string&)>& says);

/// A scene file beside which `file` is the surface.
std::string advised_scene(const AdviceRequest& request, const std::string& file, SolidElement element, double spacing_m,
                          double step_s);

/// C_0 and the largest distance from the line over it, of values over sizes; at least three.
struct Continued {
  double value = 0, model_error = 0;
};
Continued continue_to_no_size(const std::vector<double>& sizes, const std::vector<double>& values, double order);

}  // namespace palpate
