#include "server/body/leapfrog_loops.hpp"

namespace palpate::leapfrog {
namespace {

void combine(const float* __restrict a, float h, const float* __restrict b, float* __restrict y, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) y[i] = a[i] + h * b[i];
}
void accelerate(const float* __restrict w, const float* __restrict f, float g, float* __restrict a, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) a[i] = w[i] > 0 ? w[i] * f[i] + g : 0.0F;
}
void kick_and_drift(float h, const float* __restrict a, float* __restrict v, float* __restrict u, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    v[i] += h * a[i];
    u[i] += h * v[i];
  }
}

}  // namespace

void combine(const std::vector<float>& a, float h, const std::vector<float>& b, std::vector<float>& y) {
  combine(a.data(), h, b.data(), y.data(), y.size());
}
void accelerate(const std::vector<float>& w, const std::vector<float>& f, float g, std::vector<float>& a) {
  accelerate(w.data(), f.data(), g, a.data(), a.size());
}
void kick_and_drift(float h, const std::vector<float>& a, std::vector<float>& v, std::vector<float>& u) {
  kick_and_drift(h, a.data(), v.data(), u.data(), u.size());
}

}  // namespace palpate::leapfrog
