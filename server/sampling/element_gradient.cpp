#include "server/sampling/element_gradient.hpp"

#include <cassert>

namespace palpate {

ElementGradient element_gradient(const Dynamics& dynamics, std::uint32_t e) {
  const LumpedBody& body = dynamics.body();
  assert(body.is_solid() && e < body.tetrahedra.size() + body.hexahedra.size());
  if (e < body.hexahedra.size()) {
    const HexaShape& shape = dynamics.hexahedra().shape(e);
    return {body.hexahedra[e].nodes, shape.b, shape.volume_m3, body.hexahedra[e].material};
  }
  const std::uint32_t t = e - static_cast<std::uint32_t>(body.hexahedra.size());
  const TetraShape& shape = dynamics.tetrahedra().shape(t);
  return {body.tetrahedra[t].nodes, shape.b, shape.volume_m3, body.tetrahedra[t].material};
}

Mat3 mean_gradient(const Dynamics& dynamics, std::uint32_t e, const Eigen::Ref<const Vector>& y) {
  assert(y.size() == 3 * static_cast<Eigen::Index>(dynamics.nodes()));
  const auto hexahedra = static_cast<std::uint32_t>(dynamics.body().hexahedra.size());
  if (e < hexahedra) return dynamics.hexahedra().gradient(e, y).leftCols<3>();
  return dynamics.tetrahedra().gradient(e - hexahedra, y);
}

}  // namespace palpate
