#include "server/body/hexa_forces.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>

#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

constexpr std::size_t kCells = HexaCells::kLanes;
using Corners = std::array<std::uint32_t, 8>;

std::uint32_t first_node(const Corners& nodes) { return *std::min_element(nodes.begin(), nodes.end()); }
std::uint32_t last_node(const Corners& nodes) { return *std::max_element(nodes.begin(), nodes.end()); }

/// Returns the sign of a box's g at a corner and column.
double box_sign(std::size_t corner, std::size_t column) {
  return std::popcount(HexaCells::kBoxBits[column] & ~corner) % 2 == 1 ? -1.0 : 1.0;
}

/// Returns the factors of the corner signs in g, column by column; none if the element is not a box.
std::optional<std::array<float, 7>> box_factors(const HexaShape& shape) {
  constexpr double kAlike = 1e-7;
  std::array<float, 7> times;
  for (std::size_t m = 0; m < 7; ++m) {
    const auto column = static_cast<Eigen::Index>(m);
    const Eigen::Matrix<double, 1, 8> row =
        m < 3 ? Eigen::Matrix<double, 1, 8>(shape.b.row(column)) : shape.gamma.row(column - 3);
    const double factor = row[7];
    for (std::size_t i = 0; i < 8; ++i)
      if (!(std::abs(row[static_cast<Eigen::Index>(i)] - box_sign(i, m) * factor) <= kAlike * std::abs(factor))) return {};
    times[m] = static_cast<float>(factor);
  }
  return times;
}

bool follows(const Corners& before, const Corners& after) {
  for (std::size_t i = 0; i < 8; ++i)
    if (after[i] != before[i] + 1) return false;
  return true;
}

bool in_pairs(const Corners& nodes) {
  for (std::size_t i = 0; i < 8; i += 2)
    if (nodes[i + 1] != nodes[i] + 1) return false;
  return true;
}

/// Returns the largest eigenvalue of dP/dF.
double stiffest_at(const ElementMaterial& material, const Mat3& f) {
  return Eigen::SelfAdjointEigenSolver<Mat9>(elastic_tangent(material, f, false), Eigen::EigenvaluesOnly).eigenvalues()[8];
}

void add_cell(std::uint32_t cell, const Corners& nodes, HexaCells& cells) {
  if (cells.used == 0)
    for (std::size_t i = 0; i < 8; ++i) cells.nodes[i].fill(nodes[i]);
  for (std::size_t i = 0; i < 8; ++i) cells.nodes[i][cells.used] = nodes[i];
  cells.cells[cells.used++] = cell;
}

std::vector<HexaCells::Lanes> own_numbers(std::span<const HexaShape* const> shapes) {
  std::vector<HexaCells::Lanes> own;
  for (const EightNumbers& numbers : ShapeNumbers<HexaShape>::of(shapes))
    std::copy(std::begin(numbers.of), std::end(numbers.of), std::begin(own.emplace_back().of));
  return own;
}

/// Packs the cells of a slab: boxes in a row together, then boxes of one shape, then the others by material.
class Packer {
 public:
  Packer(const Dynamics& dynamics, std::vector<HexaCells>& to)
      : hexahedra_(&dynamics.hexahedra()), body_(&dynamics.body()), to_(&to) {}

  /// `cells` are in the order of their first nodes.
  void pack(std::span<const std::uint32_t> cells) {
    constexpr std::size_t kWorthARow = 4;
    std::vector<std::uint32_t> boxes, others;
    for (std::size_t k = 0; k < cells.size();) {
      const auto factors = box_factors(shape(cells[k]));
      std::size_t end = k + 1;
      while (factors && end < cells.size() && end - k < kCells && &shape(cells[end]) == &shape(cells[k]) &&
             follows(nodes(cells[end - 1]), nodes(cells[end])))
        ++end;
      if (factors && end - k >= kWorthARow && in_pairs(nodes(cells[k])))
        put(cells.subspan(k, end - k), true);
      else
        for (std::size_t i = k; i < end; ++i) (factors ? boxes : others).push_back(cells[i]);
      k = end;
    }
    pack_alike(boxes, [&](std::uint32_t cell) { return reinterpret_cast<std::uintptr_t>(&shape(cell)); });
    pack_alike(others, [&](std::uint32_t cell) { return std::uintptr_t{body_->hexahedra[cell].material}; });
  }

 private:
  const HexaShape& shape(std::uint32_t cell) const { return hexahedra_->shape(cell); }
  const Corners& nodes(std::uint32_t cell) const { return body_->hexahedra[cell].nodes; }

  template <typename Key>
  void pack_alike(std::vector<std::uint32_t>& cells, const Key& key) {
    sort_stably(cells.begin(), cells.end(), [&](auto p, auto q) { return key(p) < key(q); });
    for (std::size_t k = 0; k < cells.size();) {
      std::size_t end = k + 1;
      while (end < cells.size() && end - k < kCells && key(cells[end]) == key(cells[k])) ++end;
      put(std::span(cells).subspan(k, end - k), false);
      k = end;
    }
  }

  void put(std::span<const std::uint32_t> of, bool in_a_row) {
    HexaCells cells;
    cells.material = body_->hexahedra[of.front()].material;
    cells.in_a_row = in_a_row;
    for (const std::uint32_t cell : of) add_cell(cell, nodes(cell), cells);
    const HexaShape& one = shape(of.front());
    if (const auto factors = box_factors(one)) {
      std::copy(factors->begin(), factors->end(), cells.times);
      cells.volume_m3 = static_cast<float>(one.volume_m3);
      for (std::size_t a = 0; a < kModesOfHexa; ++a) cells.k[a] = static_cast<float>(one.k[a]);
    } else {
      std::vector<const HexaShape*> shapes;
      for (const std::uint32_t cell : of) shapes.push_back(&shape(cell));
      cells.own = own_numbers(shapes);
    }
    to_->push_back(std::move(cells));
  }

  const Hexahedra* hexahedra_;
  const LumpedBody* body_;
  std::vector<HexaCells>* to_;
};

}  // namespace

bool HexaForces::covers(const LumpedBody& body) {
  return !body.hexahedra.empty() && body.tetrahedra.empty() && body.relaxation.empty() && body.mass_damping_1_s == 0;
}

HexaForces::HexaForces(const Dynamics& dynamics) : hexahedra_(&dynamics.hexahedra()), count_(dynamics.body().hexahedra.size()) {
  constexpr std::uint32_t kMostSlabs = 16;
  const LumpedBody& body = dynamics.body();
  if (count_ == 0) return;
  for (const SolidMaterial& m : body.materials) {
    materials_.emplace_back(m);
    stiffest_at_rest_.push_back(stiffest_at(materials_.back(), Mat3::Identity()));
  }
  std::vector<std::uint32_t> order(count_);
  std::iota(order.begin(), order.end(), 0U);
  sort_stably(order.begin(), order.end(),
              [&](auto p, auto q) { return first_node(body.hexahedra[p].nodes) < first_node(body.hexahedra[q].nodes); });
  std::uint32_t reach = 1;
  for (const Hexahedron& h : body.hexahedra) reach = std::max(reach, last_node(h.nodes) - first_node(h.nodes));
  const auto nodes = static_cast<std::uint32_t>(body.nodes.size());
  // A row also reads and writes the nodes behind it.
  const std::uint32_t slabs = std::clamp(nodes / (reach + static_cast<std::uint32_t>(kCells) + 1), 1U, kMostSlabs);
  auto next = order.begin();
  for (std::uint32_t k = 0; k < slabs; ++k) {
    const std::uint64_t end = (std::uint64_t{k} + 1) * nodes / slabs;
    const auto last = std::find_if(next, order.end(), [&](auto cell) { return first_node(body.hexahedra[cell].nodes) >= end; });
    Slab& slab = (k % 2 == 0 ? even_ : odd_).emplace_back();
    Packer(dynamics, slab).pack({next, last});
    next = last;
  }
}

double HexaForces::evaluation_s() const {
  constexpr double kNs = 13, kOwnShapeNs = 25, kViscousNs = 11, kFibresNs = 10;
  const auto law_ns = [](SolidLaw law) {
    switch (law) {
      case SolidLaw::corotational:
        return 23;
      case SolidLaw::veronda_westmann:
        return 18;
      case SolidLaw::ogden:
        return 66;
      case SolidLaw::neo_hookean:
        return 0;
      default:
        return 6;
    }
  };
  double ns = 0;
  for (const bool odd : {false, true})
    for (const Slab& slab : odd ? odd_ : even_)
      for (const HexaCells& cells : slab) {
        const ElementMaterial& m = materials_[cells.material];
        ns += kCells * (kNs + law_ns(m.kind) + (cells.own.empty() ? 0 : kOwnShapeNs) + (m.is_viscous() ? kViscousNs : 0) +
                        (m.has_fibres ? kFibresNs : 0));
      }
  return 1e-9 * ns;
}

void HexaForces::add_forces(bool odd, std::size_t slab, const NodeArrays& u, const NodeArrays& v, NodeArrays& f) const {
  hexa_force_loops().back().run(materials_, (odd ? odd_ : even_)[slab], u, v, f);
}

Mat3 HexaForces::deformation(const HexaCells& cells, std::size_t lane, const NodeArrays& u) const {
  Mat3 f = Mat3::Identity();
  for (std::size_t i = 0; i < 8; ++i)
    f += u.at(cells.nodes[i][lane]) * hexahedra_->shape(cells.cells[lane]).b.col(static_cast<Eigen::Index>(i)).transpose();
  return f;
}

HexaForces::Growth HexaForces::growth(const NodeArrays& u) const {
  constexpr std::size_t kMostStrained = 4;
  constexpr float kSmall = 0.02F;  // changes eigenvalues by less than the stability margin
  struct Strained {
    float strain;
    const HexaCells* cells;
    std::size_t lane;
  };
  std::vector<Strained> strained;
  std::vector<HexaStrains> strains;
  float square = 1;
  for (const bool odd : {false, true})
    for (const Slab& slab : odd ? odd_ : even_) {
      strains.resize(slab.size());
      find_strains(slab, u, strains);
      for (std::size_t k = 0; k < slab.size(); ++k)
        for (std::size_t lane = 0; lane < slab[k].used; ++lane) {
          square = std::max(square, strains[k].square.of[lane]);
          if (strains[k].strain.of[lane] > kSmall) strained.push_back({strains[k].strain.of[lane], &slab[k], lane});
        }
    }
  const std::size_t look = std::min(kMostStrained, strained.size());
  std::partial_sort(strained.begin(), strained.begin() + static_cast<std::ptrdiff_t>(look), strained.end(),
                    [](const Strained& a, const Strained& b) { return a.strain > b.strain; });
  Growth growth;
  growth.damping = static_cast<double>(square);
  for (std::size_t i = 0; i < look; ++i) {
    const HexaCells& cells = *strained[i].cells;
    const double stiffest = stiffest_at(materials_[cells.material], deformation(cells, strained[i].lane, u));
    growth.stiffness = std::max(growth.stiffness, stiffest / stiffest_at_rest_[cells.material]);
  }
  return growth;
}

}  // namespace palpate
