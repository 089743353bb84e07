#include "common/port/packed_numbers.hpp"
#include "common/port/terms_numbers.hpp"

namespace palpate {

using namespace packed;

namespace {

constexpr int kHalvesOfSurface = 7, kHalvesOfVertex = 4;  // a length and a place; a step and a normal

/// With the surface behind the elements.
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
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), e2 = p.repaired ? pairs_of(n) : 0, m = p.springs;
  const int packed = words_of_bytes(3 * r * p.nodes) + words_of_bytes(p.nodes) + 3 * p.nodes + 2 * m +
                     (p.stiffening > 0 ? words_of_bytes(m) : 0);
  return with_surface({r, e2, r + p.nodes + 2 * m, packed, e2, 0}, p);
}

TermsLayout tetrahedra_layout(const PatchTerms& p) {
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), e2 = p.repaired ? pairs_of(n) : 0, m = p.tetrahedra;
  const int packed = words_of_bytes(3 * r * p.nodes) + words_of_bytes(p.nodes) + 6 * p.nodes + 2 * m;
  return with_surface({r, e2, r + p.nodes + 3 * m, packed, e2, 0}, p);
}

TermsLayout layout(const PatchTerms& p) { return p.springs > 0 ? springs_layout(p) : tetrahedra_layout(p); }

}  // namespace palpate
