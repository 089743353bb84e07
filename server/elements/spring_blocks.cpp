#include "server/elements/spring_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <tuple>

#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

constexpr std::size_t kBlock = NodeArrays::kBlock;

struct Placed {
  std::size_t block = 0, lane = 0;
  std::uint32_t to = 0;
  const Element* element = nullptr;
  auto group() const { return std::tie(block, to); }
};

Placed place(const Element& e) {
  const std::uint32_t a = std::min(e.a, e.b), b = std::max(e.a, e.b);
  return {a / kBlock, a % kBlock, b - a, &e};
}

/// Rounds to a picometre, so that equal springs have equal numbers.
double rounded_m(double length_m) { return 1e-12 * std::round(1e12 * length_m); }

void put_shape(const LumpedBody& body, const Placed& p, std::size_t lane, SpringShapes& to) {
  const auto a = static_cast<std::uint32_t>(p.block * kBlock + p.lane);
  const Vec3 d = (body.nodes[a + p.to] - body.nodes[a]).unaryExpr(&rounded_m);
  const double rest_m = rounded_m(p.element->rest_length_m), per_rest2 = 1 / (rest_m * rest_m);
  to.dx[lane] = static_cast<float>(d.x());
  to.dy[lane] = static_cast<float>(d.y());
  to.dz[lane] = static_cast<float>(d.z());
  to.excess[lane] = static_cast<float>(d.squaredNorm() * per_rest2 - 1);
  to.per_rest2[lane] = static_cast<float>(per_rest2);
}

/// Reorders groups: neighbours in the numbering write to overlapping nodes, so they are moved far enough apart that the first has
/// finished its stores before the second reads.
void spread(std::vector<SpringsOfBlock>::iterator begin, std::vector<SpringsOfBlock>::iterator end) {
  constexpr std::size_t kPiles = 3;
  std::vector<SpringsOfBlock> spread;
  for (std::size_t pile = 0; pile < kPiles; ++pile)
    for (auto k = static_cast<std::ptrdiff_t>(pile); k < end - begin; k += kPiles) spread.push_back(begin[k]);
  std::copy(spread.begin(), spread.end(), begin);
}

/// Index of each distinct value in `all`, to which a new value is appended.
template <typename Value>
class Once {
 public:
  explicit Once(std::vector<Value>& all) : all_(&all) {}
  std::uint32_t place_of(const Value& value) {
    std::array<float, sizeof(Value) / sizeof(float)> key;
    std::memcpy(key.data(), &value, sizeof(value));
    const auto [entry, fresh] = known_.try_emplace(key, static_cast<std::uint32_t>(all_->size()));
    if (fresh) all_->push_back(value);
    return entry->second;
  }

 private:
  std::vector<Value>* all_;
  std::map<std::array<float, sizeof(Value) / sizeof(float)>, std::uint32_t> known_;
};

}  // namespace

bool SpringBlocks::covers(const LumpedBody& body) {
  return !body.elements.empty() && !body.is_solid() && body.law != SpringLaw::thigh_skin;
}

SpringBlocks::SpringBlocks(const LumpedBody& body) {
  tables_.stiffening = body.law == SpringLaw::stiffening ? static_cast<float>(body.stiffening) : 0.0F;
  std::vector<Placed> springs;
  for (const Element& e : body.elements) springs.push_back(place(e));
  sort_stably(springs.begin(), springs.end(),
              [](const Placed& p, const Placed& q) { return std::tie(p.block, p.to, p.lane) < std::tie(q.block, q.to, q.lane); });
  Once<SpringShapes> shapes(tables_.shapes);
  Once<SpringCoefficients> coefficients(tables_.coefficients);
  const std::size_t blocks = (body.nodes.size() + kBlock - 1) / kBlock;
  tables_.first.assign(blocks + 1, 0);
  for (auto p = springs.cbegin(); p != springs.cend();) {
    const Placed& first = *p;
    SpringShapes shape;
    SpringCoefficients c{};
    for (std::size_t lane = 0; lane < kBlock; ++lane) put_shape(body, first, lane, shape);
    for (std::size_t next = 0; p != springs.cend() && p->group() == first.group() && p->lane >= next; ++p) {
      put_shape(body, *p, p->lane, shape);
      c.stiffness_n_m[p->lane] = static_cast<float>(p->element->stiffness_n_m);
      c.damping_n_s_m[p->lane] = static_cast<float>(p->element->damping_n_s_m);
      next = p->lane + 1;
    }
    tables_.groups.push_back({first.to, shapes.place_of(shape), coefficients.place_of(c)});
    tables_.first[first.block + 1] = static_cast<std::uint32_t>(tables_.groups.size());
  }
  for (std::size_t block = 0; block < blocks; ++block) {
    tables_.first[block + 1] = std::max(tables_.first[block + 1], tables_.first[block]);
    spread(tables_.groups.begin() + tables_.first[block], tables_.groups.begin() + tables_.first[block + 1]);
  }
  cut_into_slabs();
}

void SpringBlocks::cut_into_slabs() {
  constexpr std::size_t kMost = 16;
  std::size_t reach = 1;
  for (const SpringsOfBlock& group : tables_.groups) reach = std::max(reach, group.to / kBlock + 1);
  const std::size_t slabs = std::clamp<std::size_t>(blocks() / reach, 1, kMost);
  for (std::size_t k = 0; k < slabs; ++k)
    (k % 2 == 0 ? even_ : odd_).push_back({k * blocks() / slabs, (k + 1) * blocks() / slabs});
}

void SpringBlocks::add_forces(const Slab& slab, const NodeArrays& u, const NodeArrays& v, NodeArrays& f) const {
  spring_block_loops().back().run(tables_, slab.begin, slab.end, u, v, f);
}

double SpringBlocks::stiffest(const NodeArrays& u) const {
  if (tables_.stiffening == 0) return 1;
  double most = 0;  // largest strain^2
  for (std::size_t block = 0; block < blocks(); ++block)
    for (std::uint32_t g = tables_.first[block]; g < tables_.first[block + 1]; ++g) {
      const SpringsOfBlock& group = tables_.groups[g];
      const SpringShapes& at_rest = tables_.shapes[group.shapes];
      for (std::size_t lane = 0; lane < kBlock; ++lane) {
        if (tables_.coefficients[group.coefficients].stiffness_n_m[lane] == 0) continue;
        const auto a = static_cast<std::uint32_t>(block * kBlock + lane);
        const Vec3 d = Vec3(at_rest.dx[lane], at_rest.dy[lane], at_rest.dz[lane]) + u.at(a + group.to) - u.at(a);
        const double strain = d.norm() * std::sqrt(static_cast<double>(at_rest.per_rest2[lane])) - 1;
        most = std::max(most, strain * strain);
      }
    }
  return 1 + 3 * static_cast<double>(tables_.stiffening) * most;
}

}  // namespace palpate
