#include "common/base/doubles.hpp"
#include "server/elements/spring_blocks.hpp"

namespace palpate {
namespace {

constexpr std::size_t kLoopBlock = NodeArrays::kBlock;

template <std::size_t N>
struct VectorOfFloats;
template <>
struct VectorOfFloats<4> {
  using Type = float __attribute__((vector_size(16), may_alias));
};
template <>
struct VectorOfFloats<8> {
  using Type = float __attribute__((vector_size(32), may_alias));
};
template <>
struct VectorOfFloats<16> {
  using Type = float __attribute__((vector_size(64), may_alias));
};
template <std::size_t N>
using Floats = typename VectorOfFloats<N>::Type;

template <std::size_t N>
PALPATE_INLINE const Floats<N>& aligned(const float* at) {
  return *reinterpret_cast<const Floats<N>*>(at);
}
template <std::size_t N>
PALPATE_INLINE void load(const float* from, Floats<N>& to) {
  __builtin_memcpy(&to, from, sizeof(to));
}
template <std::size_t N>
PALPATE_INLINE void store(const Floats<N>& from, float* to) {
  __builtin_memcpy(to, &from, sizeof(from));
}

template <std::size_t N>
PALPATE_INLINE void square_root(const Floats<N>& s, Floats<N>& root) {
  alignas(sizeof(s)) float lanes[N];
  store<N>(s, lanes);
  for (float& lane : lanes) lane = __builtin_sqrtf(lane);
  load<N>(lanes, root);
}

struct Places {
  const float *x, *y, *z, *vx, *vy, *vz;
};

/// Computes the forces on the nodes a of N springs.
template <std::size_t N>
PALPATE_INLINE void pull(const SpringShapes& at_rest, const SpringCoefficients& c, float stiffening, std::size_t lane,
                         std::size_t a, std::size_t b, const Places& at, Floats<N> (&force)[3]) {
  constexpr float kFlattest = -1 + 1e-6F;  // least q: a spring shorter than a thousandth of its rest length pushes less
  const auto difference = [&](const float* of, Floats<N>& to) {
    Floats<N> from;
    load<N>(of + b, to);
    load<N>(of + a, from);
    to -= from;
  };
  Floats<N> ex, ey, ez, px, py, pz;
  difference(at.x, ex);
  difference(at.y, ey);
  difference(at.z, ez);
  const Floats<N>&dx0 = aligned<N>(at_rest.dx + lane), &dy0 = aligned<N>(at_rest.dy + lane), &dz0 = aligned<N>(at_rest.dz + lane);
  const Floats<N>& per_rest2 = aligned<N>(at_rest.per_rest2 + lane);
  const Floats<N> dx = dx0 + ex, dy = dy0 + ey, dz = dz0 + ez;
  Floats<N> q = (ex * (dx + dx0) + ey * (dy + dy0) + ez * (dz + dz0)) * per_rest2 + aligned<N>(at_rest.excess + lane);
  q = q > kFlattest ? q : kFlattest + Floats<N>{};
  const Floats<N> stretch2 = 1 + q;
  Floats<N> stretch;
  square_root<N>(stretch2, stretch);
  const Floats<N> t = q / (stretch2 + stretch);
  difference(at.vx, px);
  difference(at.vy, py);
  difference(at.vz, pz);
  const Floats<N> rate = (dx * px + dy * py + dz * pz) * per_rest2;
  Floats<N> per_length = aligned<N>(c.stiffness_n_m + lane) * t;
  if (stiffening != 0) {
    const Floats<N> strain = t * stretch;
    per_length *= 1 + stiffening * (strain * strain);
  }
  per_length += aligned<N>(c.damping_n_s_m + lane) * rate / stretch2;
  force[0] = per_length * dx;
  force[1] = per_length * dy;
  force[2] = per_length * dz;
}

template <std::size_t N>
PALPATE_INLINE void add_forces(const SpringTables& springs, std::size_t begin, std::size_t end, const NodeArrays& u,
                               const NodeArrays& v, NodeArrays& f) {
  constexpr std::size_t kParts = kLoopBlock / N;
  const Places at{u.x.data(), u.y.data(), u.z.data(), v.x.data(), v.y.data(), v.z.data()};
  float* const to[3] = {f.x.data(), f.y.data(), f.z.data()};
  for (std::size_t block = begin; block < end; ++block) {
    Floats<N> sum[kParts][3] = {};
    for (std::uint32_t g = springs.first[block]; g < springs.first[block + 1]; ++g) {
      const SpringsOfBlock& group = springs.groups[g];
      for (std::size_t part = 0; part < kParts; ++part) {
        const std::size_t a = block * kLoopBlock + part * N, b = a + group.to;
        Floats<N> force[3];
        pull<N>(springs.shapes[group.shapes], springs.coefficients[group.coefficients], springs.stiffening, part * N, a, b, at,
                force);
        for (std::size_t r = 0; r < 3; ++r) {
          sum[part][r] += force[r];
          Floats<N> back;
          load<N>(to[r] + b, back);
          store<N>(back - force[r], to[r] + b);
        }
      }
    }
    for (std::size_t part = 0; part < kParts; ++part)
      for (std::size_t r = 0; r < 3; ++r) {
        float* const own = to[r] + block * kLoopBlock + part * N;
        Floats<N> before;
        load<N>(own, before);
        store<N>(before + sum[part][r], own);
      }
  }
}

struct SpringBlockLoop {
  template <std::size_t N>
  PALPATE_INLINE static void run(const SpringTables& springs, std::size_t begin, std::size_t end, const NodeArrays& u,
                                 const NodeArrays& v, NodeArrays& f) {
    add_forces<2 * N>(springs, begin, end, u, v, f);  // a vector has twice as many floats as doubles
  }
};

}  // namespace

std::span<const Variant<const SpringTables&, std::size_t, std::size_t, const NodeArrays&, const NodeArrays&, NodeArrays&>>
spring_block_loops() {
  return Variants<SpringBlockLoop>::all<const SpringTables&, std::size_t, std::size_t, const NodeArrays&, const NodeArrays&,
                                        NodeArrays&>();
}

}  // namespace palpate
