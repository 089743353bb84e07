#include "server/body/locking.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace palpate {

double expected_locking(const LumpedBody& body) {
  if (!body.hexahedra.empty() || body.tetrahedra.empty()) return 0;
  constexpr double kBending = 2.1, kVolume = 0.55;
  Eigen::AlignedBox3d box;
  for (const Vec3& x : body.nodes) box.extend(x);
  double poisson = 0;
  for (const SolidMaterial& m : body.materials)
    if (m.law != SolidLaw::membrane) poisson = std::max(poisson, m.poisson);
  const double edges = box.sizes().minCoeff() / mean_edge_m(body);
  return (kBending + kVolume * 2 * poisson / (1 - 2 * poisson)) / (edges * edges);
}

}  // namespace palpate
