// Some elements of a body with weights, as a patch of scheme `hyper` has them: springs of a lattice, or finite elements.
//
// An element e has d + 1 nodes, d = 1 for a spring and 3 for a finite element, and moves with the variables u of its patch (u =
// (displacement of the tool, q) for a grasp, u = q for touch) by the edges from its first node,
//
//     H_e u = sum_i ((V_i - V_0) u) b_i^T,   i = 1, ..., d           3 d rows: those of a 3 x d matrix, row by row
//
// V_i the motion of node i (node_motion.hpp). For a spring b_1 = 1, and H_e u is the change of the vector between its ends [m].
// For a finite element b_i is the gradient of a shape function at rest [1/m], and H_e u the change of the deformation gradient F
// = sum_i (x_i - x_0) b_i^T. Elements share their nodes: in a mesh some five springs for two nodes, and a spring needs a tenth of
// the bytes of its nodes. A triangle of a membrane is a finite element whose last node is its first.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/base/limits.hpp"
#include "common/mechanics/solid_law.hpp"
#include "common/patch/node_motion.hpp"

namespace palpate {

inline constexpr int kMaxVariables = kMaxModes + 3;  ///< n: the modes, and the three axes of a tool that grasps
/// Bounds of the format, and so of a tick: four datagrams hold some 130 springs between 55 nodes (docs/reference/wire.md).
inline constexpr int kMaxSprings = 160, kMaxFiniteElements = 112, kMaxSampledNodes = 80;

struct SampledElements {
  NodeMotion motion;          ///< V_i
  Eigen::Matrix3Xf position;  ///< x_i [m], with any origin
  Eigen::MatrixXi nodes;      ///< of each element a column: two for springs, four for finite elements
  Eigen::VectorXf stiffness;  ///< springs: w k [N/m]; finite elements: w V mu_L [J], triangles: w area mu_L
  Eigen::VectorXf damping;    ///< springs: w c [N s/m]; finite elements: t of the viscous law [s]
  // of springs
  Eigen::VectorXf rest_length;          ///< L [m]
  float stiffening = 0;                 ///< c of the law (sampled_springs.hpp), 0: linear
  std::vector<std::uint8_t> max_slope;  ///< 16 log2 sigma, for a law that stiffens
  // of finite elements
  LawParameters law;         ///< law of all with a volume, each of which is positive at rest
  Eigen::VectorXf dilation;  ///< w V lambda_L [J]
  Eigen::Matrix3Xf rest;     ///< X_i [m], with any origin

  int count() const { return static_cast<int>(stiffness.size()); }
  /// d
  int dimension() const { return static_cast<int>(nodes.rows()) - 1; }
  bool is_solid() const { return dimension() == 3; }
  bool is_triangle(int element) const { return nodes(3, element) == nodes(0, element); }
  /// Returns x_i - x_0 of an element, or X_i - X_0, as columns.
  Eigen::Matrix3Xf edges(const Eigen::Matrix3Xf& places, int element) const;
  /// Returns b_i as rows, and for finite elements six times the volume or twice the area.
  Eigen::MatrixXf gradients(int element, float& volume) const;
  /// Returns H_e, 3 d rows an element [1 for the tool, 1/kg^1/2 for q; finite elements 1/m of that]; `tool`: number of variables,
  /// the first ones, that the tool prescribes.
  Eigen::MatrixXf motions(int tool) const;

  /// Return the vectors between the ends of springs, and sigma.
  Eigen::Matrix3Xf spans() const;
  Eigen::ArrayXd steepest() const;
  /// Returns the bytes of such slopes, rounded up, from 1 to 6e4.
  static std::vector<std::uint8_t> steep_of(const Eigen::ArrayXd& slopes);
};

/// Returns H of an element from its b_i as rows and V_i - V_0.
Eigen::MatrixXf gradient_motion(const Eigen::MatrixXf& gradients, const std::vector<Eigen::Matrix3Xf>& edges);

}  // namespace palpate
