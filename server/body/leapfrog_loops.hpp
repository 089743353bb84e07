// The loops over nodes of explicit_integrator.hpp, on one component.
#pragma once

#include <vector>

namespace palpate::leapfrog {

/// y = a + h b
void combine(const std::vector<float>& a, float h, const std::vector<float>& b, std::vector<float>& y);
/// a = w f + g where w > 0, else 0
void accelerate(const std::vector<float>& w, const std::vector<float>& f, float g, std::vector<float>& a);
/// v += h a, u += h v
void kick_and_drift(float h, const std::vector<float>& a, std::vector<float>& v, std::vector<float>& u);

}  // namespace palpate::leapfrog
