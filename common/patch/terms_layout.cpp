#include "common/patch/packed_numbers.hpp"
#include "common/patch/terms_numbers.hpp"

namespace palpate {

using namespace packed;

namespace {

constexpr int kHalvesOfSurface = 7, kHalvesOfVertex = 4;  // format: a length and a position, two an axis; a step and a normal

/// Adds the surface behind the elements.
TermsLayout with_surface(TermsLayout l, const PatchTerms& p) {
  if (p.vertices > 0) {
    l.after += kHalvesOfSurface + l.modes + kHalvesOfVertex * p.vertices;
    l.last += words_of_bytes(3 * l.modes * p.vertices) + words_of_bytes(p.vertices) + 3 * p.vertices;
  }
  l.last += p.triangles;
  return l;
}

}  // namespace

TermsLayout layout(const PatchTerms& p) {
  const int n = p.variables, r = n - (p.grasp ? 3 : 0), e2 = p.repaired ? pairs_of(n) : 0, m = p.elements;
  if (m == 0) return with_surface({r, 0, 0, 0, 0, 0}, p);
  const int places = (p.solid ? 6 : 3) * p.nodes, lengths = p.solid ? 0 : m, nodes = (p.solid ? 2 : 1) * m;
  const int max_slope = p.stiffening > 0 ? words_of_bytes(m) : 0;
  const int packed = words_of_bytes(3 * r * p.nodes) + words_of_bytes(p.nodes) + places + lengths + nodes + max_slope;
  return with_surface({r, e2, r + p.nodes + (p.solid ? 3 : 2) * m, packed, e2, 0}, p);
}

}  // namespace palpate
