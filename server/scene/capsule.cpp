#include "server/scene/capsule.hpp"

#include <algorithm>

namespace palpate {

void add_capsule(LumpedBody& body, const CapsuleSettings& capsule) {
  SolidMaterial material;
  material.law = SolidLaw::membrane;
  material.young_pa = capsule.young_pa * capsule.thickness_m;
  material.poisson = capsule.poisson;
  material.damping_s = capsule.damping_s;
  const auto of_capsule = static_cast<std::uint32_t>(body.materials.size());
  body.materials.push_back(material);
  for (const Triangle& t : body.triangles)
    if (!std::all_of(t.begin(), t.end(), [&](std::uint32_t node) { return body.fixed[node] != 0; }))
      body.tetrahedra.push_back({{t[0], t[1], t[2], t[0]}, of_capsule});
}

}  // namespace palpate
