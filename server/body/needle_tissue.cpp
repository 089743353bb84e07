#include "server/body/needle_tissue.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <utility>

#include "server/scene/grid.hpp"

namespace palpate {
namespace {

constexpr double kLeastSpacings = 2;       // of R; less: too few nodes around a point
constexpr double kRegular = 1e-6;          // of A, relative
constexpr int kMotions = 8, kLengths = 4;  // fixed-point iterations; measured: positions then agree to 1 um
constexpr int kBisections = 20;            // of a layer's begin: to a millionth of the length
constexpr double kLeastStretchM = 1e-5;    // in the body, or between: walls of a closed cut are less apart

/// Returns the place at a depth in the body at rest, of a path of these points.
Vec3 rest_at(const NeedleLayers& layers, const std::array<Vec3, kNeedlePoints>& rest, double depth_m) {
  const PathPlace at = place_on_path(layers, depth_m);
  const auto j = static_cast<std::size_t>(at.j);
  return rest[j] + at.part * (rest[j + 1] - rest[j]);
}

}  // namespace

Vec3 NeedlePath::rest_at(double depth_m) const { return palpate::rest_at(layers, rest, depth_m); }

std::vector<NeedlePath::Stretch> NeedlePath::passed(double depth_m) const {
  std::vector<Stretch> stretches;
  bool is_inside = false;
  for (const NeedleLayer& layer : layers.all()) {
    if (layer.begins_m > depth_m) break;
    if (layer.is_outside() == !is_inside) continue;
    is_inside = !is_inside;
    if (is_inside)
      stretches.push_back({layer.begins_m, depth_m});
    else
      stretches.back().ends_m = layer.begins_m;
  }
  if (is_inside) stretches.clear();
  return stretches;
}

Vec3 NeedlePath::position(double depth_m, const Vector& x, Vec3& tau) const {
  const PathPlace at = place_on_path(layers, depth_m);
  const auto j = static_cast<std::size_t>(at.j);
  const Vec3 from = points[j].position(x), way = points[j + 1].position(x) - from;
  tau = way / layers.spacing_m();
  return from + at.part * way;
}

NodeWeights NeedlePath::weights(double depth_m) const {
  const PathPlace at = place_on_path(layers, depth_m);
  const auto j = static_cast<std::size_t>(at.j);
  const double part = std::min(at.part, 1.0);
  NodeWeights both;
  for (const auto& [node, weight] : points[j].b) both.emplace_back(node, (1 - part) * weight);
  for (const auto& [node, weight] : points[j + 1].b) both.emplace_back(node, part * weight);
  return both;
}

NeedleTissue::NeedleTissue(const Scene& scene, const Skin& skin)
    : body_(&scene.body),
      nodes_(own_nodes(scene.body)),
      skin_(&skin),
      radius_m_(std::max(scene.tool.radius_m, kLeastSpacings * mean_edge_m(scene.body))),
      needle_(*scene.tool.needle) {
  assert(!scene.body.tissue.empty());
}

NeedlePath::Point NeedleTissue::point(const Vec3& rest) const {
  double radius_m = radius_m_;
  NodeWeights near;
  const auto collect = [&] {
    near.clear();
    for (std::uint32_t i = 0; i < nodes_; ++i) {
      const double d2 = (body_->nodes[i] - rest).squaredNorm() / (radius_m * radius_m);
      if (d2 < 1) near.emplace_back(i, (1 - d2) * (1 - d2));
    }
  };
  constexpr std::size_t kFewest = 8;  // a cell's corners
  for (collect(); near.size() < std::min(kFewest, nodes_); collect()) radius_m *= 1.25;
  Eigen::Matrix4d a = Eigen::Matrix4d::Zero();
  const auto p = [&](std::uint32_t i) {
    Eigen::Vector4d value;
    value << 1, (body_->nodes[i] - rest) / radius_m;
    return value;
  };
  for (const auto& [i, weight] : near) a += weight * p(i) * p(i).transpose();
  a += kRegular * a(0, 0) * Eigen::Vector4d(0, 1, 1, 1).asDiagonal().toDenseMatrix();
  const Eigen::Vector4d first = a.ldlt().solve(Eigen::Vector4d::Unit(0));
  NeedlePath::Point made;
  made.offset = rest;
  for (const auto& [i, weight] : near) {
    made.b.emplace_back(i, weight * p(i).dot(first));
    made.offset -= made.b.back().second * body_->nodes[i];
  }
  return made;
}

/// Returns the point of the body at rest that is at `target` in the body at `x`.
Vec3 NeedleTissue::rest_of(const Vec3& target, Vec3 guess, const Vector& x) const {
  for (int k = 0; k < kMotions; ++k) guess += target - point(guess).position(x);
  return guess;
}

std::shared_ptr<const NeedlePath> NeedleTissue::path(const SurfacePoint& entry, const Vec3& way, const Vec3& edge,
                                                     const Vector& x) const {
  auto path = std::make_shared<NeedlePath>();
  NeedlePath::Point& first = path->points.front();
  first.b = skin_->weights(entry);
  std::array<Vec3, kNeedlePoints>& rest = path->rest;
  rest.front() = first.offset = position_at(skin_->view(), skin_->rest(), entry);
  for (const auto& [node, weight] : first.b) first.offset -= weight * body_->nodes[node];
  const double spacing_m = needle_.length_m / (kNeedlePoints - 1);
  Vec3 at = first.position(x);
  Vec3 step = spacing_m * way;
  for (std::size_t j = 1; j < rest.size(); ++j) {
    rest[j] = rest[j - 1] + step;
    double length_m = spacing_m;  // of the step in the body at x
    for (int k = 0; k < kLengths; ++k) {
      rest[j] = rest_of(at + length_m * way, rest[j], x);
      length_m *= spacing_m / (rest[j] - rest[j - 1]).norm();
    }
    step = rest[j] - rest[j - 1];
    path->points[j] = point(rest[j]);
    at = path->points[j].position(x);
  }
  path->layers = layers_along(rest);
  if (needle_.is_blade) {
    const Vec3 middle = path->points[1].position(x), half = 0.5 * needle_.width_m * edge;
    const Vec3 along = rest_of(middle + half, rest[1], x) - rest_of(middle - half, rest[1], x);
    path->edge = needle_.width_m * along.normalized();
  }
  return path;
}

std::shared_ptr<const NeedlePath> NeedleTissue::path_of(const NeedleInBody& needle) const {
  auto path = std::make_shared<NeedlePath>();
  path->layers = needle.layers;
  path->rest = needle.rest;
  path->edge = needle.edge;
  for (std::size_t j = 0; j < needle.rest.size(); ++j) path->points[j] = point(needle.rest[j]);
  return path;
}

std::shared_ptr<const NeedlePath> NeedleTissue::carried_over(const NeedlePath& path, std::span<const std::uint32_t> now) const {
  auto carried = std::make_shared<NeedlePath>(path);
  for (std::size_t j = 0; j < carried->points.size(); ++j) {
    NeedlePath::Point& at = carried->points[j];
    for (auto& [node, weight] : at.b) node = now[node];
    if (std::ranges::any_of(at.b, [](const auto& entry) { return entry.first == kNoNode; })) at = point(carried->rest[j]);
  }
  return carried;
}

CutSettings NeedlePath::cut(double depth_m) const {
  CutSettings cut;
  // It begins a little outside, so that it leaves no link of a curved surface.
  cut.path_m.push_back(rest[0] - 0.5 * edge.norm() * (rest[1] - rest[0]).normalized());
  const PathPlace front = place_on_path(layers, depth_m);
  for (std::size_t j = 1; j <= static_cast<std::size_t>(front.j); ++j) cut.path_m.push_back(rest[j]);
  if (front.part > 0) cut.path_m.push_back(rest_at(depth_m));
  for (Vec3& place : cut.path_m) place -= 0.5 * edge;
  cut.depth_m = edge.norm();
  cut.direction = edge / cut.depth_m;
  return cut;
}

double NeedleTissue::depth_of(const Vec3& rest) const { return -skin_->nearest(0, skin_->rest(), rest).height_m; }

/// Returns the depths at which a path goes through the surface of the body at rest, ascending.
std::vector<double> NeedleTissue::crossings(const std::array<Vec3, kNeedlePoints>& rest) const {
  const Positions x = skin_->rest();
  std::vector<double> depths;
  for (std::size_t j = 0; j + 1 < rest.size(); ++j)
    for (const Triangle& t : body_->triangles) {
      const Vec3 p = vertex(x, t[0]), q = vertex(x, t[1]), r = vertex(x, t[2]);
      for (const std::optional<double>& share : {way_out(rest[j], rest[j + 1], p, q, r), way_out(rest[j], rest[j + 1], p, r, q)})
        if (share) depths.push_back((static_cast<double>(j) + *share) * needle_.length_m / (kNeedlePoints - 1));
    }
  std::ranges::sort(depths);
  return depths;
}

NeedleLayers NeedleTissue::layers_along(const std::array<Vec3, kNeedlePoints>& rest) const {
  NeedleLayers layers;
  layers.length_m = needle_.length_m;
  const auto add = [&](double begins_m, const TissueLayer& tissue) {
    if (layers.count == kMaxNeedleLayers) return;
    layers.of[static_cast<std::size_t>(layers.count++)] = {begins_m, tissue.puncture_n, tissue.toughness_j_m2 * needle_.width_m,
                                                           tissue.friction_n_m};
  };
  // The first depth between two, of those between the points, below `thickness_m` of the body; none: -1.
  const auto first_below = [&](double thickness_m, double from_m, double to_m) {
    const auto is_below = [&](double depth_m) { return depth_of(rest_at(layers, rest, depth_m)) > thickness_m; };
    double low = from_m, high = -1;
    for (int j = 1; j < kNeedlePoints && high < 0; ++j) {
      const double depth_m = j * layers.spacing_m();
      if (depth_m <= from_m || depth_m > to_m) continue;
      (is_below(depth_m) ? high : low) = depth_m;
    }
    for (int k = 0; k < kBisections && high > 0; ++k) (is_below(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
    return high;
  };
  const auto add_deeper = [&](double from_m, double to_m) {
    double thickness_m = 0;
    for (std::size_t k = 0; k + 1 < body_->tissue.size(); ++k) {
      thickness_m += body_->tissue[k].thickness_m;
      from_m = first_below(thickness_m, from_m, to_m);
      if (from_m < 0) return;
      add(from_m, body_->tissue[k + 1]);
    }
  };
  add(0, body_->tissue.front());
  std::vector<double> borders = crossings(rest);
  borders.push_back(layers.length_m);
  bool is_inside = true;
  double since_m = 0, before_m = 0;
  for (const double border_m : borders) {
    const double from_m = std::exchange(before_m, border_m);
    if (border_m - from_m < kLeastStretchM) continue;
    if (skin_->holds(rest_at(layers, rest, 0.5 * (from_m + border_m))) == is_inside) continue;
    is_inside = !is_inside;
    if (is_inside)
      add(since_m = from_m, body_->tissue.front());
    else {
      add_deeper(since_m, from_m);
      add(from_m, {});
    }
  }
  if (is_inside) add_deeper(since_m, layers.length_m);
  return layers;
}

}  // namespace palpate
