#include <algorithm>

#include "common/port/packed_numbers.hpp"
#include "common/port/terms_numbers.hpp"

namespace palpate {

using namespace packed;

namespace {

constexpr int kHalvesOfSurface = 7, kHalvesOfVertex = 4;  // a length and a place; a step and a normal

/// With the surface behind what there is of the terms.
TermsLayout with_surface(TermsLayout l, const PatchTerms& p) {
  if (p.vertices > 0) {
    l.after += kHalvesOfSurface + l.modes + kHalvesOfVertex * p.vertices;
    l.last += words_of_bytes(3 * l.modes * p.vertices) + words_of_bytes(p.vertices) + 3 * p.vertices;
  }
  l.last += p.triangles;
  return l;
}

}  // namespace

TermsLayout springs_layout(const PatchTerms& p) {
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), m = p.springs;
  const int packed = words_of_bytes(3 * r * p.nodes) + words_of_bytes(p.nodes) + 3 * p.nodes + 2 * m +
                     (p.stiffening > 0 ? words_of_bytes(m) : 0);
  const int e2 = p.repaired ? pairs_of(n) : 0;
  return with_surface({r, 0, {r, 0, m, m, e2}, r + p.nodes + 2 * m, packed, e2, 0}, p);
}

TermsLayout tetrahedra_layout(const PatchTerms& p) {
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), m = p.tetrahedra;
  const int packed = words_of_bytes(3 * r * p.nodes) + words_of_bytes(p.nodes) + 6 * p.nodes + 2 * m;
  const int e2 = p.repaired ? pairs_of(n) : 0;
  return with_surface({r, 0, {r, 0, m, m, e2}, r + p.nodes + 3 * m, packed, e2, 0}, p);
}

TermsLayout layout(const PatchTerms& p) {
  if (p.springs > 0) return springs_layout(p);
  if (p.tetrahedra > 0) return tetrahedra_layout(p);
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), t = std::min<int>(p.leading, kTurning);
  const std::array<int, 5> count{r * r, p.repaired ? pairs_of(n) : 0, triples_of(n), quadruples_of(p.leading), t * pairs_of(t)};
  const int packed = words_of_twelve(count[2]) + words_of_twelve(count[3]) + words_of_twelve(count[4]);
  return with_surface({r, t, count, r * r + count[1], packed, 0, 0}, p);
}

}  // namespace palpate
