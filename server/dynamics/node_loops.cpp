#include "server/dynamics/node_loops.hpp"

namespace palpate::node_loops {
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
void recur(const Recurrence c, const float* __restrict rate, const float* __restrict rate_0, const float* __restrict begin,
           const float* __restrict y, float* __restrict later, float* __restrict whole, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    later[i] = c.mu * y[i] + c.nu * later[i] + c.rate * rate[i] + c.rate_0 * rate_0[i];
    whole[i] = begin[i] + later[i];
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

void recur(Nodes nodes, const Recurrence& c, const std::vector<float>& rate, const std::vector<float>& rate_0,
           const std::vector<float>& begin, const std::vector<float>& y, std::vector<float>& later, std::vector<float>& whole) {
  recur(c, rate.data() + nodes.begin, rate_0.data() + nodes.begin, begin.data() + nodes.begin, y.data() + nodes.begin,
        later.data() + nodes.begin, whole.data() + nodes.begin, nodes.end - nodes.begin);
}

}  // namespace palpate::node_loops
