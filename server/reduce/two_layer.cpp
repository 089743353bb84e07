#include "server/reduce/two_layer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "server/reduce/block_scaling.hpp"

namespace palpate {
namespace {

constexpr int kNone = std::numeric_limits<int>::max();

struct Mean {
  double sum = 0;
  int count = 0;

  void add(double value) {
    sum += value;
    ++count;
  }
  double mean() const { return sum / count; }
};

std::vector<int> nodes_per_layer(const std::vector<int>& layer) {
  std::vector<int> nodes;
  for (const int l : layer) {
    if (l == kNone) continue;
    if (nodes.size() <= static_cast<std::size_t>(l)) nodes.resize(static_cast<std::size_t>(l) + 1);
    ++nodes[static_cast<std::size_t>(l)];
  }
  return nodes;
}

}  // namespace

TwoLayer::TwoLayer(const LumpedBody& body) : body_(&body), dimension_(dimension_of(body)), neighbours_(body.nodes.size()) {
  for (const Element& e : body.elements) {
    neighbours_[e.a].push_back(e.b);
    neighbours_[e.b].push_back(e.a);
  }
  std::size_t inside = 0;
  for (const auto& list : neighbours_) inside = std::max(inside, list.size());
  std::vector<std::uint32_t> ends;
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) {
    surface_.push_back(neighbours_[i].size() < inside);
    if (body.fixed[i]) ends.push_back(i);
  }
  to_end_ = layers_from(std::move(ends));
}

std::vector<int> TwoLayer::layers_from(std::vector<std::uint32_t> front) const {
  std::vector<int> layer(body_->nodes.size(), kNone);
  for (const std::uint32_t i : front) layer[i] = 0;
  for (std::size_t next = 0; next < front.size(); ++next)
    for (const std::uint32_t j : neighbours_[front[next]]) {
      if (layer[j] != kNone) continue;
      layer[j] = layer[front[next]] + 1;
      front.push_back(j);
    }
  return layer;
}

LocalBody TwoLayer::around(const std::vector<std::uint32_t>& contact, const std::vector<std::uint8_t>& held) const {
  assert(!contact.empty() && held.size() == body_->nodes.size());
  const std::vector<int> layer = layers_from(contact);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < body_->nodes.size(); ++i)
    if (layer[i] <= kLayers + 1) nodes.push_back(i);
  LocalBody local(*body_, std::move(nodes));
  LumpedBody& body = local.body;
  for (std::size_t i = 0; i < local.nodes.size(); ++i)
    if (held[local.nodes[i]] || layer[local.nodes[i]] > kLayers) body.fixed[i] = 1;
  const ShellCompliance compliance(dimension_, nodes_per_layer(layer));
  std::vector<Mean> lengths(local.nodes.size());
  for (Element e : body_->elements) {
    const bool leaves_a = layer[e.a] > kLayers, leaves_b = layer[e.b] > kLayers;
    if (leaves_a && leaves_b) continue;
    const bool surface = surface_[e.a] && surface_[e.b];
    const int beyond = to_end_[leaves_a ? e.a : e.b];
    e.a = local.index(e.a);
    e.b = local.index(e.b);
    if (leaves_a || leaves_b) {
      if (beyond == kNone) continue;
      const double scale = surface ? std::sqrt(1 / compliance(1 + beyond)) : 1 / compliance(1 + beyond);
      e.stiffness_n_m *= scale;
      e.damping_n_s_m *= scale;
      lengths[leaves_a ? e.b : e.a].add(1 + beyond);
    }
    body.elements.push_back(e);
  }
  for (std::size_t i = 0; i < lengths.size(); ++i)
    if (lengths[i].count > 0) body.masses_kg[i] *= 1 + 0.5 * (lengths[i].mean() - 1);
  return local;
}

SecondOrderSystem two_layer_system(const Dynamics& dynamics, const BodyState& state, std::uint32_t port_node) {
  const LocalBody local = TwoLayer(dynamics.body()).around({port_node}, dynamics.body().fixed);
  const Dynamics small(local.body);
  SecondOrderSystem s = second_order_system(small, local.restricted(state), local.index(port_node), local.body.fixed);
  for (std::uint32_t& c : s.coordinates) c = 3 * local.nodes[c / 3] + c % 3;
  return s;
}

}  // namespace palpate
