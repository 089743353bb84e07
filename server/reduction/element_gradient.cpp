#include "server/reduction/element_gradient.hpp"

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
  if (e < dynamics.body().hexahedra.size()) return dynamics.hexahedra().gradient(e, y).leftCols<3>();
  const ElementGradient element = element_gradient(dynamics, e);
  const auto place = [&](std::size_t i) { return y.segment<3>(3 * static_cast<Eigen::Index>(element.nodes[i])); };
  Mat3 f = Mat3::Zero();
  for (std::size_t i = 1; i < element.nodes.size(); ++i)
    f += (place(i) - place(0)) * element.b.col(static_cast<Eigen::Index>(i)).transpose();
  return f;
}

}  // namespace palpate
