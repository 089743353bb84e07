#include "server/body/leapfrog_loops.hpp"

namespace palpate::leapfrog {
namespace {

void kick(float h, const float* __restrict a, float* __restrict v, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) v[i] += h * a[i];
}
void accelerate(const float* __restrict w, float* __restrict f, float g, float* __restrict a, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    a[i] = w[i] > 0 ? w[i] * f[i] + g : 0.0F;
    f[i] = 0;
  }
}
void kick_and_drift(float h, const float* __restrict a, float* __restrict v, float* __restrict u, float* __restrict predicted,
                    std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    v[i] += h * a[i];
    u[i] += h * v[i];
    predicted[i] = v[i] + h / 2 * a[i];
  }
}

}  // namespace

void kick(Nodes nodes, float h, const std::vector<float>& a, std::vector<float>& v) {
  kick(h, a.data() + nodes.begin, v.data() + nodes.begin, nodes.end - nodes.begin);
}
void accelerate(Nodes nodes, const std::vector<float>& w, std::vector<float>& f, float g, std::vector<float>& a) {
  accelerate(w.data() + nodes.begin, f.data() + nodes.begin, g, a.data() + nodes.begin, nodes.end - nodes.begin);
}
void kick_and_drift(Nodes nodes, float h, const std::vector<float>& a, std::vector<float>& v, std::vector<float>& u,
                    std::vector<float>& predicted) {
  kick_and_drift(h, a.data() + nodes.begin, v.data() + nodes.begin, u.data() + nodes.begin, predicted.data() + nodes.begin,
                 nodes.end - nodes.begin);
}

}  // namespace palpate::leapfrog
