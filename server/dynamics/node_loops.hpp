// The loops of explicit integrators over nodes, on one component, for nodes begin to end. Vector code without contraction: the
// bits are the same at every width.
#pragma once

#include <cstddef>
#include <vector>

namespace palpate::node_loops {

struct Nodes {
  std::size_t begin = 0, end = 0;
};

/// Computes v += h a.
void kick(Nodes nodes, float h, const std::vector<float>& a, std::vector<float>& v);
/// Computes a = w f + g where w > 0, else 0; then f = 0.
void accelerate(Nodes nodes, const std::vector<float>& w, std::vector<float>& f, float g, std::vector<float>& a);
/// Computes v += h a, u += h v, predicted = v + h/2 a.
void kick_and_drift(Nodes nodes, float h, const std::vector<float>& a, std::vector<float>& v, std::vector<float>& u,
                    std::vector<float>& predicted);

struct Recurrence {
  float mu = 0, nu = 0, rate = 0, rate_0 = 0;
};
/// Computes later = mu y + nu later + c.rate rate + c.rate_0 rate_0, whole = begin + later: a stage of chebyshev.hpp.
void recur(Nodes nodes, const Recurrence& c, const std::vector<float>& rate, const std::vector<float>& rate_0,
           const std::vector<float>& begin, const std::vector<float>& y, std::vector<float>& later, std::vector<float>& whole);

}  // namespace palpate::node_loops
