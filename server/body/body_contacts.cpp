#include "server/body/body_contacts.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

namespace palpate {
namespace {

constexpr std::uint32_t kNowhere = 0xffffffff;

/// w_a and dw_a/dxi of the corners of a cell at xi.
struct Shape {
  std::array<double, 8> w{};
  std::array<Vec3, 8> slope{};

  Shape(const Vec3& xi, std::size_t corners) {
    slope.fill(Vec3::Zero());
    if (corners == 4) {
      w = {1 - xi.sum(), xi[0], xi[1], xi[2]};
      slope[0].setConstant(-1);
      for (int axis = 0; axis < 3; ++axis) slope[static_cast<std::size_t>(axis) + 1] = Vec3::Unit(axis);
      return;
    }
    for (std::size_t a = 0; a < 8; ++a) {
      Vec3 along, sign;
      for (int axis = 0; axis < 3; ++axis) {
        const bool high = (a >> axis & 1) != 0;
        along[axis] = high ? xi[axis] : 1 - xi[axis];
        sign[axis] = high ? 1 : -1;
      }
      w[a] = along.prod();
      slope[a] = Vec3(sign[0] * along[1] * along[2], sign[1] * along[0] * along[2], sign[2] * along[0] * along[1]);
    }
  }
};

/// How far xi is beyond the cell, in its size.
double beyond_cell(const Vec3& xi, std::size_t corners) {
  const double low = -xi.minCoeff();
  return std::max({0.0, low, corners == 4 ? xi.sum() - 1 : xi.maxCoeff() - 1});
}

}  // namespace

struct BodyContacts::Sides {
  static constexpr double kCrowd = 2;
  using Box = Eigen::AlignedBox3d;

  struct Side {
    std::vector<std::uint32_t> nodes;  // of its surface
    std::vector<std::array<std::uint32_t, 8>> cells;
    std::size_t corners = 8;           // of a cell
    std::vector<Vec3> centres;         // of cells at rest
    std::vector<Mat3> edges, inverse;  // dX/dxi there, and its inverse
    double edge_m = 0, mean_n_m = 0;   // mean edge of its triangles, mean K_ii of its surface
  };

  explicit Sides(const LumpedBody& of);
  template <class Cells>
  void take_cells(const Cells& cells);
  double series_n_m(std::uint32_t node, const Side& other) const;
  void meet(std::uint32_t member, const std::vector<std::uint32_t>& nodes, const std::vector<Vec3>& x, const Box& box,
            std::vector<Meeting>& out) const;
  bool fit(const Side& side, std::size_t cell, const std::vector<Vec3>& x, const Vec3& at, Vec3 xi, Meeting& meeting,
           double& beyond) const;
  static Mat3 edges(const Side& side, std::size_t cell, const std::vector<Vec3>& x);

  const LumpedBody* body;
  std::vector<Side> members;
  std::vector<std::uint32_t> member_of;              // of each node
  std::vector<std::vector<std::uint32_t>> cells_of;  // of each node
  std::vector<double> own_n_m;
};

BodyContacts::Sides::Sides(const LumpedBody& of)
    : body(&of),
      members(of.members.size()),
      member_of(of.nodes.size(), kNowhere),
      cells_of(of.nodes.size()),
      own_n_m(of.nodes.size(), 0) {
  for (std::size_t m = 0; m < members.size(); ++m)
    for (std::uint32_t i = of.members[m].first_node; i < of.members[m].end_node; ++i)
      member_of[i] = static_cast<std::uint32_t>(m);
  std::vector<std::size_t> edges(members.size(), 0);
  for (const Triangle& t : of.triangles) {
    const std::uint32_t m = member_of[t[0]];
    for (std::size_t k = 0; k < 3; ++k) {
      members[m].nodes.push_back(t[k]);
      members[m].edge_m += (of.nodes[t[k]] - of.nodes[t[(k + 1) % 3]]).norm();
    }
    edges[m] += 3;
  }
  for (std::size_t m = 0; m < members.size(); ++m) {
    Side& side = members[m];
    std::sort(side.nodes.begin(), side.nodes.end());
    side.nodes.erase(std::unique(side.nodes.begin(), side.nodes.end()), side.nodes.end());
    side.edge_m /= static_cast<double>(std::max<std::size_t>(edges[m], 1));
  }
  take_cells(of.hexahedra);
  take_cells(of.tetrahedra);
}

template <class Cells>
void BodyContacts::Sides::take_cells(const Cells& cells) {
  for (const auto& cell : cells) {
    if constexpr (requires { cell.is_triangle(); })
      if (cell.is_triangle()) continue;
    Side& side = members[member_of[cell.nodes[0]]];
    side.corners = cell.nodes.size();
    auto& to = side.cells.emplace_back();
    to.fill(cell.nodes[0]);
    Vec3 sum = Vec3::Zero();
    for (std::size_t a = 0; a < side.corners; ++a) {
      to[a] = cell.nodes[a];
      sum += body->nodes[cell.nodes[a]];
      cells_of[cell.nodes[a]].push_back(static_cast<std::uint32_t>(side.cells.size() - 1));
    }
    side.centres.push_back(sum / static_cast<double>(side.corners));
    side.edges.push_back(edges(side, side.cells.size() - 1, body->nodes));
    side.inverse.push_back(side.edges.back().inverse());
  }
}

/// dx/dxi at the centre of a cell.
Mat3 BodyContacts::Sides::edges(const Side& side, std::size_t cell, const std::vector<Vec3>& x) {
  static const Shape hexahedron(Vec3::Constant(0.5), 8), tetrahedron(Vec3::Constant(0.25), 4);
  const Shape& shape = side.corners == 4 ? tetrahedron : hexahedron;
  Mat3 now = Mat3::Zero();
  for (std::size_t a = 0; a < side.corners; ++a) now += x[side.cells[cell][a]] * shape.slope[a].transpose();
  return now;
}

double BodyContacts::Sides::series_n_m(std::uint32_t node, const Side& other) const {
  return kStiffnessRatio / (1 / own_n_m[node] + 1 / other.mean_n_m);
}

/// Looks for a point in a cell, from xi on; true if it is less far beyond the cell than before.
bool BodyContacts::Sides::fit(const Side& side, std::size_t cell, const std::vector<Vec3>& x, const Vec3& at, Vec3 xi,
                              Meeting& meeting, double& beyond) const {
  constexpr int kIterations = 12;
  constexpr double kFar = 1, kFound = 1e-6;  // quadratic: the step after it is of its square
  const auto& corners = side.cells[cell];
  bool found = false;
  for (int k = 0; k < kIterations && beyond_cell(xi, side.corners) < kFar; ++k) {
    const Shape shape(xi, side.corners);
    Vec3 left = at;
    Mat3 now = Mat3::Zero();
    for (std::size_t a = 0; a < side.corners; ++a) {
      left -= shape.w[a] * x[corners[a]];
      now += x[corners[a]] * shape.slope[a].transpose();
    }
    const Vec3 step = now.inverse() * left;
    if (!step.allFinite()) return false;
    xi += step;
    found = step.cwiseAbs().maxCoeff() < kFound;
    if (found) break;
  }
  const double here = beyond_cell(xi, side.corners);
  if (!found || !(here < beyond)) return false;
  beyond = here;
  meeting.corners = corners;
  meeting.weights = Shape(xi, side.corners).w;
  meeting.rest.setZero();
  for (std::size_t a = 0; a < side.corners; ++a) meeting.rest += meeting.weights[a] * body->nodes[corners[a]];
  return true;
}

void BodyContacts::Sides::meet(std::uint32_t member, const std::vector<std::uint32_t>& nodes, const std::vector<Vec3>& x,
                               const Box& box, std::vector<Meeting>& out) const {
  const Side& side = members[member];
  constexpr double kBeyondByGuess = 0.4, kOutsideByGuess = 0.25;  // by the cell's motion at its centre alone; of an edge
  const DistanceGrid& distance = *body->members[member].distance;
  const double apart_m = kApartEdges * side.edge_m;
  std::vector<std::pair<double, std::uint32_t>> sweep;  // along x
  for (const std::uint32_t i : nodes)
    if (box.contains(x[i])) sweep.emplace_back(x[i].x(), i);
  if (sweep.empty()) return;
  std::sort(sweep.begin(), sweep.end());
  struct Found {
    Meeting meeting;
    double beyond = kBeyond;
  };
  std::vector<Found> found;
  for (std::size_t c = 0; c < side.cells.size(); ++c) {
    Box cell;
    for (std::size_t a = 0; a < side.corners; ++a) cell.extend(x[side.cells[c][a]]);
    const Vec3 margin = kBeyond * cell.sizes();
    cell.min() -= margin, cell.max() += margin;
    if (!cell.intersects(box)) continue;
    std::optional<Mat3> edges_inverse;
    Vec3 middle = Vec3::Zero();
    for (auto at = std::lower_bound(sweep.begin(), sweep.end(), std::pair(cell.min().x(), std::uint32_t{0}));
         at != sweep.end() && at->first <= cell.max().x(); ++at) {
      const std::uint32_t i = at->second;
      if (!cell.contains(x[i])) continue;
      if (member_of[i] == member && (body->nodes[i] - side.centres[c]).norm() < apart_m) continue;
      const auto known = std::find_if(found.begin(), found.end(), [&](const Found& f) { return f.meeting.node == i; });
      Found here = known == found.end() ? Found() : *known;
      if (!(here.beyond > 0)) continue;
      if (!edges_inverse) {
        edges_inverse = edges(side, c, x).inverse();
        for (std::size_t a = 0; a < side.corners; ++a) middle += x[side.cells[c][a]] / static_cast<double>(side.corners);
      }
      const Vec3 xi = Vec3::Constant(side.corners == 4 ? 0.25 : 0.5) + *edges_inverse * (x[i] - middle);
      if (!(beyond_cell(xi, side.corners) < kBeyondByGuess)) continue;
      const auto guess = distance.at(side.centres[c] + side.edges[c] * (*edges_inverse * (x[i] - middle)));
      if (!guess || guess->distance_m > kOutsideByGuess * side.edge_m) continue;
      if (!fit(side, c, x, x[i], xi, here.meeting, here.beyond)) continue;
      here.meeting.node = i;
      here.meeting.member = member;
      known == found.end() ? found.push_back(here) : void(*known = here);
    }
  }
  std::vector<std::optional<Mat3>> gradients(found.empty() ? 0 : side.cells.size());
  for (Found& f : found) {
    const auto at = distance.at(f.meeting.rest);
    if (!at || !(at->distance_m < 0)) continue;
    f.meeting.deformation.setZero();
    for (std::size_t a = 0; a < side.corners; ++a) {
      const std::vector<std::uint32_t>& around = cells_of[f.meeting.corners[a]];
      for (const std::uint32_t c : around) {
        if (!gradients[c]) gradients[c] = edges(side, c, x) * side.inverse[c];
        f.meeting.deformation += f.meeting.weights[a] / static_cast<double>(around.size()) * *gradients[c];
      }
    }
    f.meeting.depth_m = -at->distance_m;
    f.meeting.gradient = f.meeting.deformation.inverse().transpose() * at->gradient;
    out.push_back(f.meeting);
  }
  std::sort(out.begin(), out.end(),
            [](const Meeting& a, const Meeting& b) { return std::pair(a.member, a.node) < std::pair(b.member, b.node); });
}

BodyContacts::BodyContacts(const LumpedBody& body) {
  if (!body.members.empty()) sides_ = std::make_shared<Sides>(body);
}

void BodyContacts::set_stiffness(const std::vector<double>& own_n_m) {
  if (empty()) return;
  sides_->own_n_m = own_n_m;
  for (Sides::Side& side : sides_->members) {
    side.mean_n_m = 0;
    for (const std::uint32_t i : side.nodes) side.mean_n_m += own_n_m[i] / static_cast<double>(side.nodes.size());
  }
}

double BodyContacts::stiffness_n_m(const Meeting& meeting) const {
  return sides_->series_n_m(meeting.node, sides_->members[meeting.member]);
}

double BodyContacts::friction(const Meeting& meeting) const {
  const auto& members = sides_->body->members;
  return std::sqrt(members[sides_->member_of[meeting.node]].friction * members[meeting.member].friction);
}

double BodyContacts::most_w2() const {
  // Of w w^T k over all contacts: the largest sum of a row of M^-1 sum k |w| |w|^T, which is 2 sum k |w_a| / m_a.
  double most = 0;
  if (empty()) return most;
  const LumpedBody& body = *sides_->body;
  for (std::size_t m = 0; m < body.members.size(); ++m)
    for (std::size_t n = 0; n < body.members.size(); ++n) {
      if (m == n && !body.members[m].touches_itself) continue;
      const Sides::Side &own = sides_->members[m], &other = sides_->members[n];
      double stiffest = 0;  // of the other's nodes
      for (const std::uint32_t j : other.nodes) stiffest = std::max(stiffest, sides_->series_n_m(j, own));
      const double finer = own.edge_m / other.edge_m, upon = Sides::kCrowd * std::max(1.0, finer * finer);
      for (const std::uint32_t i : own.nodes)
        if (!body.fixed[i]) most = std::max(most, 2 * (sides_->series_n_m(i, other) + upon * stiffest) / body.masses_kg[i]);
    }
  return most;
}

std::vector<BodyContacts::Meeting> BodyContacts::at(const OfNode& position) const {
  std::vector<Meeting> out;
  if (empty()) return out;
  const LumpedBody& body = *sides_->body;
  std::vector<Vec3> x(body.nodes.size());
  for (std::uint32_t i = 0; i < x.size(); ++i) x[i] = position(i);
  std::vector<Sides::Box> boxes(body.members.size());
  for (std::size_t m = 0; m < boxes.size(); ++m)
    for (const std::uint32_t i : sides_->members[m].nodes) boxes[m].extend(x[i]);
  for (std::uint32_t m = 0; m < boxes.size(); ++m)
    for (std::uint32_t n = 0; n < boxes.size(); ++n) {
      if (m == n && !body.members[m].touches_itself) continue;
      const Sides::Box both = boxes[m].intersection(boxes[n]);
      if (!both.isEmpty()) sides_->meet(m, sides_->members[n].nodes, x, both, out);
    }
  return out;
}

}  // namespace palpate
