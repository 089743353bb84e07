#include "bench/paper/two_layer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "bench/paper/block_scaling.hpp"

namespace palpate {
namespace {

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
    if (l == NodeGraph::kUnreached) continue;
    if (nodes.size() <= static_cast<std::size_t>(l)) nodes.resize(static_cast<std::size_t>(l) + 1);
    ++nodes[static_cast<std::size_t>(l)];
  }
  return nodes;
}

}  // namespace

TwoLayer::TwoLayer(const LumpedBody& body) : body_(&body), dimension_(dimension_of(body)), graph_(body) {
  const auto nodes = static_cast<std::uint32_t>(body.nodes.size());
  std::size_t inside = 0;
  for (std::uint32_t i = 0; i < nodes; ++i) inside = std::max(inside, graph_.neighbours(i).size());
  std::vector<std::uint32_t> ends;
  for (std::uint32_t i = 0; i < nodes; ++i) {
    surface_.push_back(graph_.neighbours(i).size() < inside);
    if (body.fixed[i]) ends.push_back(i);
  }
  to_end_ = graph_.distances(std::move(ends));
}

LocalBody TwoLayer::around(const std::vector<std::uint32_t>& contact, const std::vector<std::uint8_t>& held) const {
  assert(!contact.empty() && held.size() == body_->nodes.size());
  const std::vector<int> layer = graph_.distances(contact);
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
      if (beyond == NodeGraph::kUnreached) continue;
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
