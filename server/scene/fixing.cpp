#include "server/scene/fixing.hpp"

#include <algorithm>

namespace palpate {

void fix_nodes(LumpedBody& body, const FixedSettings& fixed, const Vec3& spacing) {
  body.fixed.assign(body.nodes.size(), 0);
  Vec3 low = body.nodes[0], high = body.nodes[0];
  for (const Vec3& x : body.nodes) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const auto fix_where = [&](auto&& held) {
    for (std::size_t i = 0; i < body.nodes.size(); ++i) body.fixed[i] |= held(body.nodes[i]);
  };
  for (const std::string& face : fixed.faces) {
    const int axis = face[0] - 'x';
    const double reach = 0.499 * spacing[axis];  // below one half, so that rounding never includes the next row of a box
    if (face[1] == '-') {
      fix_where([&](const Vec3& x) { return x[axis] <= low[axis] + reach; });
    } else {
      fix_where([&](const Vec3& x) { return x[axis] >= high[axis] - reach; });
    }
  }
  if (const auto& z = fixed.below_z_m) fix_where([&](const Vec3& x) { return x[2] < *z; });
  if (const auto& z = fixed.above_z_m) fix_where([&](const Vec3& x) { return x[2] > *z; });
}

void refuse_all_fixed(const LumpedBody& body, const SceneText& text, const std::string& path) {
  if (std::all_of(body.fixed.begin(), body.fixed.end(), [](auto f) { return f != 0; }))
    text.refuse(path, "every node of the body is fixed", "some that can move");
}

}  // namespace palpate
