#include "server/room/tears.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/dynamics/needle_ports.hpp"
#include "server/scene/grid.hpp"
#include "server/solve/linear_solver.hpp"

namespace palpate {
namespace {

constexpr double kInwards = 0.5;          // share of an opening, below -1/2 of which a row is under pressure
constexpr int kParts = 4, kFurthest = 2;  // of a link: a cut continues by a quarter of one until a row parts, by two at most

/// The cut, gone on by a length.
CutSettings gone_on(CutSettings cut, CutEnd end, double by_m) {
  std::vector<Vec3>& path = cut.path_m;
  if (end == CutEnd::first) path.front() += by_m * (path[0] - path[1]).normalized();
  if (end == CutEnd::last) path.back() += by_m * (path.back() - path[path.size() - 2]).normalized();
  if (end == CutEnd::deep) cut.depth_m += by_m;
  return cut;
}

template <class Cell>
double mean_link_m(const std::vector<Cell>& cells, const std::vector<Vec3>& x) {
  double sum = 0, count = 0;
  for (const Cell& cell : cells)
    for (const auto& [a, b] : kind_of(static_cast<const Cell*>(nullptr)).links) {
      sum += (x[cell.nodes[a]] - x[cell.nodes[b]]).norm();
      ++count;
    }
  return sum / count;
}

double mean_link_m(const LumpedBody& body) {
  return body.hexahedra.empty() ? mean_link_m(body.tetrahedra, body.nodes) : mean_link_m(body.hexahedra, body.nodes);
}

/// The sheet of a cut that is nearest to a point.
CutSheet nearest_sheet(const CutSettings& cut, const Vec3& x) {
  std::optional<CutSheet> nearest;
  for (std::size_t i = 0; i + 1 < cut.path_m.size(); ++i) {
    const CutSheet sheet(cut.path_m[i], cut.path_m[i + 1], cut.depth_m * cut.direction);
    if (!nearest || sheet.box.squaredExteriorDistance(x) < nearest->box.squaredExteriorDistance(x)) nearest = sheet;
  }
  return *nearest;
}

}  // namespace

std::unique_ptr<TearRow> TearRow::ahead(const CutBody& now, const TearFront& front) {
  const CutSettings& is = now.cuts()[front.cut];
  const double part_m = mean_link_m(now.body()) / kParts;
  CutBody gone(now);
  if (gone.set(front.cut, gone_on(is, front.end, kFurthest * kParts * part_m)) == 0) return nullptr;
  gone = now;
  const std::size_t cells = now.body().hexahedra.size() + now.body().tetrahedra.size();
  for (int k = 1; k <= kFurthest * kParts; ++k) {
    if (gone.set(front.cut, gone_on(is, front.end, k * part_m)) == 0) continue;
    CutBody parted(gone);
    CutChange change = parted.part();
    if (change.loose > 0) return nullptr;
    if (change.cell_before.size() == cells) continue;
    auto row = std::unique_ptr<TearRow>(new TearRow(std::move(parted), std::move(change), front));
    row->now_ = nodes_now(row->change_, now.body().nodes.size());
    row->find_sections(now.body().hexahedra, row->body_.body().hexahedra, now.body());
    row->find_sections(now.body().tetrahedra, row->body_.body().tetrahedra, now.body());
    Eigen::AlignedBox3d box;
    for (const Vec3& x : now.body().nodes) box.extend(x);
    row->reach_m_ = box.diagonal().norm();
    return row->area_m2_ > 0 ? std::move(row) : nullptr;
  }
  return nullptr;
}

TearRow::TearRow(CutBody body, CutChange change, const TearFront& front)
    : body_(std::move(body)), change_(std::move(change)), front_(front), dynamics_(body_.body()) {}

/// The cells that part: where the cut goes through them, and the nodes on either side. Appends to the shares of all.
template <class Cell>
void TearRow::find_sections(const std::vector<Cell>& before, const std::vector<Cell>& now, const LumpedBody& body) {
  const CellTopology& kind = kind_of(static_cast<const Cell*>(nullptr));
  constexpr double kOnPlane = 0.02;
  std::vector<std::vector<std::uint32_t>> copies(before.size());
  for (std::uint32_t k = 0; k < now.size(); ++k) {
    copies[change_.cell_before[k]].push_back(k);
    share_.push_back(now[k].share / before[change_.cell_before[k]].share);
  }
  for (std::size_t c = 0; c < before.size(); ++c) {
    if (copies[c].size() < 2) continue;
    const auto& nodes = before[c].nodes;
    Vec3 centre = Vec3::Zero();
    for (const std::uint32_t node : nodes) centre += body.nodes[node] / static_cast<double>(nodes.size());
    const CutSheet sheet = nearest_sheet(body_.cuts()[front_.cut], centre);
    const double slack = kOnPlane * (body.nodes[nodes[0]] - centre).norm();
    const auto height = [&](std::size_t corner) {
      const double h = sheet.normal.dot(body.nodes[nodes[corner]] - sheet.corner);
      return std::abs(h) < slack ? slack : h;
    };
    Section section;
    const Vec3 u = sheet.normal.unitOrthogonal(), v = sheet.normal.cross(u);
    std::vector<std::pair<double, Corner>> around;
    const auto place = [&](const Corner& at) { return Vec3(body.nodes[at.a] + at.part * (body.nodes[at.b] - body.nodes[at.a])); };
    Vec3 middle = Vec3::Zero();
    for (const auto& [a, b] : kind.links) {
      const double from = height(a), to = height(b);
      if (from * to > 0) continue;
      around.push_back({0, {nodes[a], nodes[b], from / (from - to)}});
      middle += place(around.back().second);
    }
    if (around.size() < 3) continue;
    middle /= static_cast<double>(around.size());
    for (auto& [angle, at] : around) angle = std::atan2(v.dot(place(at) - middle), u.dot(place(at) - middle));
    std::sort(around.begin(), around.end(), [](const auto& p, const auto& q) { return p.first < q.first; });
    for (const auto& [angle, at] : around) section.corners.push_back(at);
    for (std::size_t k = 0; k < around.size(); ++k) {
      const Vec3 next = place(section.corners[(k + 1) % around.size()]);
      area_m2_ += 0.5 * sheet.normal.dot((place(section.corners[k]) - middle).cross(next - middle));
    }
    const Cell &one = now[copies[c][0]], &other = now[copies[c][1]];
    int above = 0;  // of the first copy: it has the own nodes of its side, which come first
    for (std::size_t k = 0; k < nodes.size(); ++k) above += (height(k) > 0) == (one.nodes[k] == now_[nodes[k]]) ? 1 : -1;
    for (std::size_t k = 0; k < nodes.size(); ++k)
      section.walls.emplace_back(above > 0 ? one.nodes[k] : other.nodes[k], above > 0 ? other.nodes[k] : one.nodes[k]);
    sections_.push_back(std::move(section));
  }
}

/// The state in the parted body, at rest.
BodyState TearRow::carried(const BodyState& state) const {
  BodyState parted;
  parted.time_s = state.time_s;
  parted.x.resize(dynamics_.masses().size());
  parted.v = Vector::Zero(parted.x.size());
  for (std::uint32_t k = 0; k < dynamics_.nodes(); ++k) at_node(parted.x, k) = at_node(state.x, change_.node_before[k]);
  if (state.history) dynamics_.relaxation().take_up(*state.history, change_.cell_before, share_, parted);
  return parted;
}

/// Returns p; 0 on nodes that do not part.
Vector TearRow::load(const Dynamics& now, const BodyState& state, const BodyState& parted) const {
  BodyState still = state;
  still.v.setZero();
  still.traction.reset();
  Vector before, p;
  now.forces(still, before);
  dynamics_.forces(parted, p);
  for (std::uint32_t k = 0; k < dynamics_.nodes(); ++k) {
    const std::uint32_t of = change_.node_before[k];
    at_node(p, k) -= dynamics_.masses()[3 * k] / now.masses()[3 * of] * at_node(before, of);
  }
  mask(body_.body().fixed, p);
  return p;
}

/// Returns the energy that p gives, or 0 if it would press the row together.
double TearRow::solve(const Skin& skin, const Vector& x, const BodyState& parted, const std::vector<ToolPort>& ports,
                      const Vector& p) {
  constexpr double kSolved = 1e-4;  // of the load; its energy is off by less
  std::vector<std::uint8_t> held = body_.body().fixed;
  for (const ToolPort& port : ports)
    if (port.kind == ContactKind::attach) held[now_[port.node]] = 1;
  Vector load = p;
  mask(held, load);
  solved_ = p;
  per_square_n_ = 0;
  if (opening_.size() == 0) opening_ = Vector::Zero(p.size());
  BlockMatrix k = dynamics_.make_matrix();
  LinearSolver solver(dynamics_.nodes());
  for (const bool clamp : {false, true}) {
    dynamics_.assemble(parted, 0, 0, 1, held, clamp, k);
    for (const ToolPort& port : ports)
      if (port.kind == ContactKind::touch && port.touching)
        for (const auto& [node, weight] : weights_of(skin, port))
          if (held[now_[node]] == 0)
            k.block(k.diagonal(now_[node])).diagonal().array() += weight * port.parameters.contact_stiffness_n_m;
    if (!solver.factorise(k) || !solver.solve(load, kSolved, opening_).positive_definite || !opening_.allFinite()) {
      opening_.setZero();
      continue;
    }
    Vec3 jump = Vec3::Zero(), normal = Vec3::Zero();
    for (const Section& section : sections_) {
      for (const auto& [above, below] : section.walls) jump += at_node(opening_, above) - at_node(opening_, below);
      const auto place = [&](std::size_t at) {
        const Corner& corner = section.corners[at % section.corners.size()];
        return Vec3((1 - corner.part) * at_node(x, corner.a) + corner.part * at_node(x, corner.b));
      };
      for (std::size_t at = 1; at + 1 < section.corners.size(); ++at)
        normal += (place(at) - place(0)).cross(place(at + 1) - place(0));
    }
    const double energy_j = 0.5 * load.dot(opening_);
    per_square_n_ = energy_j / std::max(p.squaredNorm(), 1e-300);
    return jump.dot(normal.normalized()) >= -kInwards * jump.norm() ? energy_j : 0;
  }
  return 0;
}

double TearRow::release_j_m2(const Dynamics& now, const Skin& skin, const BodyState& state, const std::vector<ToolPort>& ports) {
  const BodyState parted = carried(state);
  return solve(skin, state.x, parted, ports, load(now, state, parted)) / area_m2_;
}

/// Takes up the square of the load, and returns its growth over itself, from some time ago.
double TearRow::look(double time_s, double square) {
  constexpr double kAgoS = 0.025;  // shorter: motions of single steps count
  between_s_ = looked_s_ ? time_s - *looked_s_ : 0;
  looked_s_ = time_s;
  if (seen_.empty() || time_s - seen_.back().first >= kAgoS) seen_.emplace_back(time_s, square);
  if (seen_.size() > 2) seen_.erase(seen_.begin());
  const auto& [then_s, then] = seen_.front();
  return time_s > then_s && square > then ? (1 - then / square) / (time_s - then_s) : 0;
}

double TearRow::enough_j_m2(double toughness_j_m2, double fade_s, const Dynamics& now, const Skin& skin, const BodyState& state,
                            const std::vector<ToolPort>& ports) {
  constexpr double kChanged = 0.25;  // share of the load
  const double enough_j = toughness_j_m2 * area_m2_;
  const BodyState parted = carried(state);
  const Vector p = load(now, state, parted);
  double largest_j = 0;  // no opening is wider than the body
  for (std::uint32_t k = 0; k < dynamics_.nodes(); ++k) largest_j += 0.5 * reach_m_ * at_node(p, k).norm();
  if (largest_j < enough_j) return 0;
  const double square = p.squaredNorm();
  double energy_j = per_square_n_ * square;
  const double growth_1_s = look(state.time_s, square), late_s = 0.75 * fade_s + 0.5 * between_s_;
  const bool changed = solved_.size() == 0 || (p - solved_).norm() > kChanged * p.norm();
  if (changed || energy_j * (1 + late_s * growth_1_s) >= enough_j) energy_j = solve(skin, state.x, parted, ports, p);
  const double all_j = energy_j * (1 + late_s * growth_1_s);
  return energy_j > 0 && all_j >= enough_j ? all_j / area_m2_ : 0;
}

}  // namespace palpate
