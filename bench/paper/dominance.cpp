#include "bench/paper/dominance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "server/systems/balance.hpp"

namespace palpate {
namespace {

constexpr int kPerDecade = 20;

/// Number of elements between the port and every node; -1 if they are not connected.
std::vector<int> layers_of(const Specimen& specimen) {
  std::vector<int> layer(specimen.body().nodes.size(), -1);
  for (int k = 0; std::count(layer.begin(), layer.end(), k - 1) > 0 || k == 0; ++k) {
    const std::vector<std::uint8_t> near = specimen.near_port(k);
    for (std::size_t i = 0; i < layer.size(); ++i)
      if (near[i] && layer[i] < 0) layer[i] = k;
  }
  return layer;
}

Vec3 at(const Vector& y, std::uint32_t node) { return y.segment<3>(3 * static_cast<Eigen::Index>(node)); }

/// Adds an element's elastic energy to its moving nodes, in equal parts.
template <class Nodes, class Moves>
void share(double elastic, const Nodes& nodes, const Moves& moves, std::vector<double>& by_node) {
  const auto moving = std::count_if(nodes.begin(), nodes.end(), moves);
  for (const std::uint32_t i : nodes)
    if (moves(i)) by_node[i] += elastic / static_cast<double>(moving);
}

/// Energy at small strains, where all laws of a solid agree.
double elastic_energy(const SolidMaterial& m, double volume_m3, const Mat3& gradient) {
  const Mat3 strain = 0.5 * (gradient + gradient.transpose());
  const auto [mu, lambda] = lame_parameters(m.law, m.young_pa, m.poisson);
  return volume_m3 * (mu * strain.squaredNorm() + 0.5 * lambda * strain.trace() * strain.trace());
}

double elastic_energy(const Specimen& specimen, const Tetrahedron& t, std::uint32_t which, const Vector& q) {
  const TetraShape& rest = specimen.dynamics().tetrahedra().shape(which);
  Mat3 gradient = Mat3::Zero();
  for (std::size_t n = 0; n < 4; ++n) gradient += at(q, t.nodes[n]) * rest.b.col(static_cast<Eigen::Index>(n)).transpose();
  return elastic_energy(specimen.body().materials[t.material], rest.volume_m3, gradient);
}

double elastic_energy(const Specimen& specimen, const Hexahedron& h, std::uint32_t which, const Vector& q) {
  const HexaShape& shape = specimen.dynamics().hexahedra().shape(which);
  const Mat37 gradient = specimen.dynamics().hexahedra().gradient(which, q);
  return elastic_energy(specimen.body().materials[h.material], shape.volume_m3, gradient.leftCols<3>()) +
         0.5 * Eigen::Map<const Eigen::Vector4d>(shape.k.data()).dot(gradient.rightCols<4>().colwise().squaredNorm());
}

/// Energy by node, normalised to sum 1.
std::vector<double> energy(const Specimen& specimen, const Vector& q, const Vector& v) {
  const LumpedBody& body = specimen.body();
  std::vector<double> by_node(body.nodes.size(), 0.0);
  const auto moves = [&](std::uint32_t i) { return !body.fixed[i] && i != specimen.port_node(); };
  for (std::uint32_t i = 0; i < body.nodes.size(); ++i) by_node[i] = 0.5 * body.masses_kg[i] * at(v, i).squaredNorm();
  for (const Element& e : body.elements) {
    const Vec3 along = (body.nodes[e.b] - body.nodes[e.a]).normalized();
    const double stretch = along.dot(at(q, e.b) - at(q, e.a));
    share(0.5 * e.stiffness_n_m * stretch * stretch, std::array{e.a, e.b}, moves, by_node);
  }
  for (std::uint32_t e = 0; e < body.tetrahedra.size(); ++e)
    share(elastic_energy(specimen, body.tetrahedra[e], e, q), body.tetrahedra[e].nodes, moves, by_node);
  for (std::uint32_t e = 0; e < body.hexahedra.size(); ++e)
    share(elastic_energy(specimen, body.hexahedra[e], e, q), body.hexahedra[e].nodes, moves, by_node);
  const double sum = std::accumulate(by_node.begin(), by_node.end(), 0.0);
  for (double& part : by_node) part /= sum;
  return by_node;
}

/// Energy averaged over the dominant states, weighted by Hankel values.
std::vector<double> dominant_energy(const Specimen& specimen, const SecondOrderSystem& system, const BalancedReduction& balanced,
                                    int states) {
  std::vector<double> mean(specimen.body().nodes.size(), 0.0);
  const Matrix directions = balanced.directions(states);
  const double sum = balanced.hankel().head(states).sum();
  for (int i = 0; i < states; ++i) {
    Vector q = Vector::Zero(3 * static_cast<Eigen::Index>(mean.size())), v = q;
    q(system.coordinates) = directions.col(i).head(system.size());
    v(system.coordinates) = directions.col(i).tail(system.size());
    const std::vector<double> shares = energy(specimen, q, v);
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += balanced.hankel()[i] / sum * shares[k];
  }
  return mean;
}

/// Energy of a slow push along each axis of the port, averaged.
std::vector<double> slow_energy(const Specimen& specimen, const SecondOrderSystem& system) {
  const auto still = DynamicStiffness(system.mass, system.damping, system.stiffness).at(0);
  const Matrix q_s = still.solve(system.b_k.cast<Complex>()).real();
  std::vector<double> mean(specimen.body().nodes.size(), 0.0);
  for (Eigen::Index axis = 0; axis < q_s.cols(); ++axis) {
    Vector q = Vector::Zero(3 * static_cast<Eigen::Index>(mean.size()));
    q(system.coordinates) = q_s.col(axis);
    q[3 * static_cast<Eigen::Index>(specimen.port_node()) + system.port_axes[static_cast<std::size_t>(axis)]] = 1;
    const std::vector<double> shares = energy(specimen, q, Vector::Zero(q.size()));
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += shares[k] / static_cast<double>(q_s.cols());
  }
  return mean;
}

void fill_layers(const Specimen& specimen, const std::vector<double>& by_node, const std::vector<double>& slow, Dominance& d) {
  const LumpedBody& body = specimen.body();
  const std::vector<int> layer = layers_of(specimen);
  const Vec3 port = body.nodes[specimen.port_node()];
  d.layers.resize(static_cast<std::size_t>(*std::max_element(layer.begin(), layer.end())) + 1);
  std::vector<double> count(d.layers.size(), 0.0);
  std::vector<std::pair<double, double>> by_distance;
  for (std::size_t i = 0; i < by_node.size(); ++i) {
    const double distance = (body.nodes[i] - port).norm();
    if (layer[i] < 0 || body.fixed[i] || i == specimen.port_node()) continue;
    const auto k = static_cast<std::size_t>(layer[i]);
    d.layers[k].within += by_node[i];
    d.layers[k].slow_within += slow[i];
    d.layers[k].distance_m += distance;
    count[k] += 1;
    by_distance.emplace_back(distance, by_node[i]);
  }
  const double all = std::accumulate(count.begin(), count.end(), 0.0);
  for (std::size_t k = 0; k < d.layers.size(); ++k) {
    LayerShare& l = d.layers[k];
    l.layer = static_cast<int>(k);
    l.distance_m = count[k] > 0 ? l.distance_m / count[k] : 0;
    l.even_within = count[k] / all;
    if (k == 0) continue;
    l.within += d.layers[k - 1].within;
    l.slow_within += d.layers[k - 1].slow_within;
    l.even_within += d.layers[k - 1].even_within;
  }
  if (by_distance.empty()) throw std::runtime_error("nothing that moves is joined to the node: there is no body to balance");
  while (d.layers.size() > 1 && count.back() == 0) {  // only fixed nodes there
    d.layers.pop_back();
    count.pop_back();
  }
  std::sort(by_distance.begin(), by_distance.end());
  double sum = 0;
  for (const auto& [distance, share] : by_distance) {
    if (sum < 0.5) d.distance_50_m = distance;
    if (sum < 0.9) d.distance_90_m = distance;
    sum += share;
  }
  d.extent_m = by_distance.back().first;
}

}  // namespace

Dominance dominance(const Specimen& specimen, int layers_max) {
  Dominance d;
  const SecondOrderSystem system = specimen.system();
  const BalancedReduction balanced(system, {.residual = 1e-10});
  d.states_full = 2 * static_cast<int>(system.size());
  d.hankel_n_m.assign(balanced.hankel().begin(), balanced.hankel().end());
  double sum = 0;
  while (sum < Dominance::kShare * balanced.hankel().sum()) sum += balanced.hankel()[d.states_dominant++];
  fill_layers(specimen, dominant_energy(specimen, system, balanced, d.states_dominant), slow_energy(specimen, system), d);

  std::vector<double> frequencies = log_frequencies(10, 1000, kPerDecade);
  frequencies.insert(frequencies.begin(), 0.0);
  // The balanced model with all its states equals the body to ten digits, and is quick.
  const StateSpace high = balanced.truncated(balanced.states());
  const Response whole = sample([&](Complex s) { return high.transfer(s); }, frequencies);
  for (int layers = 1; layers <= layers_max; ++layers) {
    const SecondOrderSystem ring = specimen.ring(layers);
    const TransferFunction transfer(ring);
    const std::vector<double> error = relative_error(sample(transfer, frequencies), whole);
    d.rings.push_back({layers, 2 * static_cast<int>(ring.size()), error.front(), worst_in_band(frequencies, error, 10, 100),
                       worst_in_band(frequencies, error, 100, 1000)});
    if (ring.size() == system.size()) break;
  }
  // Rings count from the first one after which none fails again.
  for (auto r = d.rings.rbegin(); r != d.rings.rend() && r->band_100_1000 <= Dominance::kRingError; ++r)
    d.ring_layers_fast = r->layers;
  for (auto r = d.rings.rbegin(); r != d.rings.rend() && std::max(r->band_10_100, r->band_100_1000) <= Dominance::kRingError; ++r)
    d.ring_layers_all = r->layers;
  return d;
}

}  // namespace palpate
