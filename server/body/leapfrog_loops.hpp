// The loops over nodes of explicit_integrator.hpp, on one component, for nodes begin to end.
#pragma once

#include <cstddef>
#include <vector>

namespace palpate::leapfrog {

struct Nodes {
  std::size_t begin = 0, end = 0;
};

/// v += h a
void kick(Nodes nodes, float h, const std::vector<float>& a, std::vector<float>& v);
/// a = w f + g where w > 0, else 0; f = 0
void accelerate(Nodes nodes, const std::vector<float>& w, std::vector<float>& f, float g, std::vector<float>& a);
/// v += h a, u += h v, predicted = v + h/2 a
void kick_and_drift(Nodes nodes, float h, const std::vector<float>& a, std::vector<float>& v, std::vector<float>& u,
                    std::vector<float>& predicted);

}  // namespace palpate::leapfrog
