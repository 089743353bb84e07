#include "server/room/live_cuts.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "server/dynamics/needle_ports.hpp"
#include "server/scene/grid.hpp"

namespace palpate {
namespace {

constexpr double kNoTractionN = 1e-5, kLongAgoS = -1e9;

/// Load on the nodes of a body with its tools.
Vector load_of(const Dynamics& dynamics, const Skin& skin, const BodyState& state, const std::vector<ToolPort>& ports) {
  Vector load;
  dynamics.forces(state, load);
  for (const ToolPort& port : ports)
    if (port.kind == ContactKind::touch && port.touching) scatter(weights_of(skin, port), port.lambda, load);
  return load;
}

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

/// Points of a surface on what it became: on the triangle with the same nodes, else the nearest one.
class MovedPoints {
 public:
  MovedPoints(const Skin& before, const Vector& x, std::vector<std::uint32_t> now)
      : triangles_(before.view().triangles.begin(), before.view().triangles.end()),
        vertices_(before.vertices()),
        x_(before.place(x)),
        now_(std::move(now)) {}

  SurfacePoint on(const Skin& skin, const Vector& x, const SurfacePoint& point) const {
    const Triangle& was = triangles_[point.triangle];
    Triangle same{};
    const std::size_t copy = was[0] / vertices_;
    for (std::size_t k = 0; k < 3; ++k) same[k] = on_copy(skin, copy, was[k] % vertices_);
    const SurfaceView& surface = skin.view();
    const std::span<const Triangle> triangles = surface.triangles;
    const std::span<const std::uint32_t> around =
        same[0] == kNoNode
            ? std::span<const std::uint32_t>()
            : std::span(surface.incident).subspan(surface.first[same[0]], surface.first[same[0] + 1] - surface.first[same[0]]);
    for (const std::uint32_t t : around) {
      if (sorted(triangles[t]) != sorted(same)) continue;
      SurfacePoint moved{t, Vec3::Zero()};
      for (int k = 0; k < 3; ++k)
        moved.weight[std::find(triangles[t].begin(), triangles[t].end(), same[static_cast<std::size_t>(k)]) -
                     triangles[t].begin()] = point.weight[k];
      return moved;
    }
    Vec3 at = Vec3::Zero();
    for (int k = 0; k < 3; ++k) at += point.weight[k] * vertex(x_, was[static_cast<std::size_t>(k)]);
    return skin.nearest(copy, skin.place(x), at).point;
  }

 private:
  std::uint32_t on_copy(const Skin& skin, std::size_t copy, std::size_t before) const {
    const std::uint32_t now = before < now_.size() ? now_[before] : kNoNode;
    return now == kNoNode ? kNoNode : static_cast<std::uint32_t>(copy * skin.vertices() + now);
  }

  std::vector<Triangle> triangles_;
  std::size_t vertices_;
  std::vector<double> x_;
  std::vector<std::uint32_t> now_;
};

/// Shares of the body's cells.
std::vector<double> shares_of(const LumpedBody& body) {
  std::vector<double> shares;
  for (const Hexahedron& cell : body.hexahedra) shares.push_back(cell.share);
  for (const Tetrahedron& cell : body.tetrahedra) shares.push_back(cell.share);
  return shares;
}

}  // namespace

LiveCuts::LiveCuts(const BodyInParts& of)
    : of_(of), begun_(of.scene->body), cut_(begun_cuts(*of.scene)), rest_(*of.rest), noted_(cut_.cuts()), torn_s_(kLongAgoS) {
  look_for_rows({});
}

bool LiveCuts::cut_on() {
  BodyState& state = *of_.state;
  if (state.traction && state.traction->at(state.time_s).lpNorm<Eigen::Infinity>() < kNoTractionN) state.traction.reset();
  std::optional<CutChange> change = of_.scene->tearing ? tear() : follow_blades();
  if (!change) return false;
  part(std::move(*change));
  return true;
}

/// Cuts where blades have cut.
std::optional<CutChange> LiveCuts::follow_blades() {
  std::size_t links = 0;
  for (const ToolPort& port : *of_.ports) {
    const NeedlePort& needle = port.needle;
    if (needle.part != NeedlePart::tip || !needle.tip.inside || !(needle.tip.front_m > 0)) continue;
    const auto known = std::find(paths_.begin(), paths_.end(), needle.path);
    const auto k = static_cast<std::size_t>(known - paths_.begin());
    if (known == paths_.end()) paths_.push_back(needle.path);
    links += cut_.set(k, needle.path->cut(needle.tip.front_m));
  }
  if (links == 0) return std::nullopt;
  note_steps();
  const std::size_t cells_before = shares_of(of_.scene->body).size();
  CutChange change = cut_.part();
  if (change.loose == 0 && change.cell_before.size() == cells_before) return std::nullopt;
  return change;
}

/// The time in which the load of the next row fades: short against that from row to row.
double LiveCuts::fade_s() const {
  constexpr double kOfRow = 0.25, kShortestS = 0.01;
  return std::clamp(kOfRow * (of_.state->time_s - torn_s_), kShortestS, Traction::kLetGoS);
}

/// Leaves all fronts for tear() to look for their rows; `first`: of this one first.
void LiveCuts::look_for_rows(const TearFront& first) {
  rows_.clear();
  fronts_.clear();
  for (std::size_t k = cut_.cuts().size(); k-- > 0;)
    for (const CutEnd end : {CutEnd::deep, CutEnd::last, CutEnd::first})
      if (k != first.cut || end != first.end) fronts_.push_back({k, end});
  if (first.cut < cut_.cuts().size()) fronts_.push_back(first);
}

/// Parts the row that gives the most energy, if it is enough. One new row is found in a frame.
std::optional<CutChange> LiveCuts::tear() {
  for (bool found = false; !found && !fronts_.empty(); fronts_.pop_back())
    if (auto row = TearRow::ahead(cut_, fronts_.back())) {
      rows_.push_back(std::move(row));
      found = true;
    }
  const double toughness_j_m2 = of_.scene->body.tissue.front().toughness_j_m2;
  double most_j_m2 = 0;
  TearRow* torn = nullptr;
  for (const auto& row : rows_) {
    const double release = row->enough_j_m2(toughness_j_m2, fade_s(), **of_.dynamics, *of_.skin, *of_.state, *of_.ports);
    if (release > most_j_m2) most_j_m2 = release, torn = row.get();
  }
  if (!torn) return std::nullopt;
  CutChange change = torn->change();
  cut_ = torn->body();
  look_for_rows(torn->front());
  note_steps();
  return change;
}

/// Notes the cuts that have gone on since the body was last parted; it is parted again after them.
void LiveCuts::note_steps() {
  const auto same = [](const CutSettings& a, const CutSettings& b) {
    return a.path_m == b.path_m && a.direction == b.direction && a.depth_m == b.depth_m;
  };
  std::vector<CutStep> steps = steps_ ? *steps_ : std::vector<CutStep>();
  const std::vector<CutSettings>& cuts = cut_.cuts();
  noted_.resize(cuts.size());
  for (std::size_t k = 0; k < cuts.size(); ++k)
    if (!same(cuts[k], noted_[k])) steps.push_back({k, cuts[k]});
  steps.back().parts = true;
  noted_ = cuts;
  steps_ = std::make_shared<const std::vector<CutStep>>(std::move(steps));
}

CutChange LiveCuts::repeat(const std::vector<CutStep>& steps) {
  assert(!steps_ && of_.ports->empty());
  const std::vector<double> shares_before = shares_of(of_.scene->body);
  parted_ = cut_.repeat(steps);
  std::vector<double> share = shares_of(cut_.body());
  for (std::size_t k = 0; k < share.size(); ++k) share[k] /= shares_before[parted_.cell_before[k]];
  renew(cut_.body());
  for (BodyState* each : {of_.state, of_.rest}) carry_over(BodyState(*each), share, *each);
  noted_ = cut_.cuts();
  paths_.resize(noted_.size());
  look_for_rows({});
  steps_ = std::make_shared<const std::vector<CutStep>>(steps);
  return parted_;
}

void LiveCuts::part(CutChange change) {
  parted_ = std::move(change);
  BodyState& state = *of_.state;
  std::vector<ToolPort>& ports = *of_.ports;
  const std::vector<double> shares_before = shares_of(of_.scene->body);
  const Vector load = load_of(**of_.dynamics, *of_.skin, state, ports), masses = (*of_.dynamics)->masses();
  const std::vector<std::uint32_t> now = nodes_now(parted_, of_.scene->body.nodes.size());
  const MovedPoints moved(*of_.skin, state.x, now);
  std::vector<double> share = shares_of(cut_.body());
  for (std::size_t k = 0; k < share.size(); ++k) share[k] /= shares_before[parted_.cell_before[k]];

  renew(cut_.body());
  for (BodyState* each : {of_.state, of_.rest}) carry_over(BodyState(*each), share, *each);
  for (auto& path : paths_) {
    if (!path) continue;
    const auto carried = (*of_.tissue)->carried_over(*path, now);
    for (ToolPort& port : ports)
      if (port.needle.path == path) port.needle.path = carried;
    path = carried;
  }
  for (ToolPort& port : ports) {
    if (port.kind == ContactKind::touch) port.point = moved.on(*of_.skin, state.x, port.point);
    if (!port.on_path()) port.needle.path.reset();
    port.clearance = {};
  }
  const Dynamics& dynamics = **of_.dynamics;
  auto traction = std::make_shared<Traction>();
  traction->begin_s = state.time_s;
  if (of_.scene->tearing) traction->fade_s = fade_s();
  traction->load = -load_of(dynamics, *of_.skin, state, ports);
  for (std::uint32_t k = 0; k < dynamics.nodes(); ++k) {
    const auto before = parted_.node_before[k];
    at_node(traction->load, k) += dynamics.masses()[3 * k] / masses[3 * before] * at_node(load, before);
  }
  mask(of_.scene->body.fixed, traction->load);
  state.traction = std::move(traction);
  torn_s_ = state.time_s;
}

/// Carries positions, velocities and the relaxed stress over; `share`: of each cell, of what it was.
void LiveCuts::carry_over(const BodyState& before, std::span<const double> share, BodyState& state) const {
  state.traction.reset();
  for (const auto& [from, to] : {std::pair{&before.x, &state.x}, {&before.v, &state.v}}) {
    to->resize(3 * static_cast<Eigen::Index>(parted_.node_before.size()));
    for (std::uint32_t k = 0; k < parted_.node_before.size(); ++k) at_node(*to, k) = at_node(*from, parted_.node_before[k]);
  }
  if (before.history) (*of_.dynamics)->relaxation().take_up(*before.history, parted_.cell_before, share, state);
}

/// Replaces the body, and all that is of its nodes alone.
void LiveCuts::renew(const LumpedBody& body) {
  of_.scene->body = body;
  *of_.skin = Skin(of_.scene->body, of_.scene->contact_radii());
  if (*of_.tissue) {
    const std::span own = std::span(cut_.number()).first(own_nodes(cut_.uncut()));
    const auto there = std::ranges::count_if(own, [](std::uint32_t node) { return node != kNoNode; });
    (*of_.tissue)->renew(static_cast<std::size_t>(there));
  }
  of_.dynamics->emplace(of_.scene->body);
}

bool LiveCuts::make_whole() {
  of_.state->traction.reset();
  if (!steps_) return false;
  of_.scene->body = begun_;
  cut_ = begun_cuts(*of_.scene);
  look_for_rows({});
  torn_s_ = kLongAgoS;
  renew(cut_.body());
  const double time_s = of_.state->time_s;
  *of_.rest = rest_;
  *of_.state = rest_;
  of_.state->time_s = time_s;
  paths_.clear();
  noted_ = cut_.cuts();
  steps_.reset();
  return true;
}

}  // namespace palpate
