#include "server/scene/mesh_solid.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/patch/triangle_tree.hpp"
#include "server/scene/surface.hpp"

namespace palpate {
namespace {

constexpr double kPieces = 32;  // longer triangles, by their share of the size, are examined in parts
constexpr double kOff = 1e-6;   // share of the size: distance from a triangle at which its outer side is tested

using Corners = std::array<Vec3, 3>;

double longest_edge(const Corners& x) {
  return std::sqrt(std::max({(x[1] - x[0]).squaredNorm(), (x[2] - x[1]).squaredNorm(), (x[0] - x[2]).squaredNorm()}));
}

/// Collects the parts of a surface that have the solid on one side only.
class Shown {
 public:
  explicit Shown(const TriangleTree& all) : all_(all), size_(all.bounds().diagonal().norm()) {
    for (const Triangle& t : all.mesh().triangles) {
      const auto& v = all.mesh().vertices;
      add({v[t[0]], v[t[1]], v[t[2]]});
    }
  }

  /// Returns the collected surface; empty if that is all of it.
  std::optional<TriangleMesh> take() {
    if (!hidden_) return std::nullopt;
    return std::move(mesh_);
  }

 private:
  /// Adds a triangle; as one if all of it is shown.
  void add(const Corners& x) {
    const std::size_t before = mesh_.triangles.size();
    if (!add_parts(x)) return;
    mesh_.triangles.resize(before);
    mesh_.vertices.resize(3 * before);
    push(x);
  }
  bool add_parts(const Corners& x) {
    if (longest_edge(x) <= size_ / kPieces) {
      if (is_hidden(x)) {
        hidden_ = true;
        return false;
      }
      push(x);
      return true;
    }
    const Vec3 a = 0.5 * (x[1] + x[2]), b = 0.5 * (x[2] + x[0]), c = 0.5 * (x[0] + x[1]);
    bool whole = true;
    for (const Corners& part : {Corners{x[0], c, b}, Corners{c, x[1], a}, Corners{b, a, x[2]}, Corners{a, b, c}})
      whole = add_parts(part) && whole;
    return whole;
  }
  bool is_hidden(const Corners& x) const {
    const Vec3 outward = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
    return all_.winding_number((x[0] + x[1] + x[2]) / 3 + kOff * size_ * outward) > 0.5;
  }
  void push(const Corners& x) {
    const auto n = static_cast<std::uint32_t>(mesh_.vertices.size());
    mesh_.vertices.insert(mesh_.vertices.end(), x.begin(), x.end());
    mesh_.triangles.push_back({n, n + 1, n + 2});
  }

  const TriangleTree& all_;
  double size_;
  TriangleMesh mesh_;
  bool hidden_ = false;
};

class MeshSolid final : public SignedDistance {
 public:
  explicit MeshSolid(TriangleMesh mesh) : all_(std::move(mesh)) {
    if (auto shown = Shown(all_).take(); shown && !shown->triangles.empty()) shown_.emplace(std::move(*shown));
  }

  double distance(const Vec3& p) const override {
    const double away = (p - nearest(p)).norm();
    return all_.winding_number(p) > 0.5 ? -away : away;
  }
  Vec3 nearest(const Vec3& p) const override { return (shown_ ? *shown_ : all_).nearest(p); }
  Eigen::AlignedBox3d bounds() const override { return all_.bounds(); }
  double volume() const override {
    return shown_ ? counted_volume() : signed_volume(all_.mesh().triangles, all_.mesh().vertices);
  }

 private:
  /// Estimates the volume with points on a grid.
  double counted_volume() const {
    constexpr int kAcross = 40;
    const Vec3 low = all_.bounds().min(), step = all_.bounds().sizes() / kAcross;
    int inside = 0;
    for (int i = 0; i < kAcross; ++i)
      for (int j = 0; j < kAcross; ++j)
        for (int k = 0; k < kAcross; ++k)
          inside += all_.winding_number(low + step.cwiseProduct(Vec3(i + 0.5, j + 0.5, k + 0.5))) > 0.5;
    return inside * step.prod();
  }

  TriangleTree all_;
  std::optional<TriangleTree> shown_;  ///< empty if all of the surface is shown
};

}  // namespace

std::unique_ptr<SignedDistance> make_mesh_solid(TriangleMesh mesh) { return std::make_unique<MeshSolid>(std::move(mesh)); }

}  // namespace palpate
