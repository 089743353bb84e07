#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "server/scene/clip.hpp"
#include "server/scene/tetra_mesh.hpp"

namespace palpate {

namespace {

constexpr double kMinFaceCosine = 0.25;  // least cosine between the two triangles of a face
constexpr int kShortenings = 60;
constexpr double kShortening = 0.85;

using Corners = std::array<std::uint32_t, 8>;

/// Corners of a cell; bit a of the index is the offset along axis a.
Corners corners_of(const Clipped& body, const Grid& grid, const Index3& c) {
  Corners out{};
  for (unsigned b = 0; b < 8; ++b) {
    const Index3 offset{static_cast<int>(b & 1u), static_cast<int>(b >> 1 & 1u), static_cast<int>(b >> 2 & 1u)};
    out[b] = body.nodes.number[grid.index(c + offset)];
  }
  return out;
}

/// Volume of a cell as six tetrahedra around the diagonal 0-7.
double volume_of(const Corners& v, std::span<const Vec3> x) {
  constexpr unsigned kRing[6] = {1, 3, 2, 6, 4, 5};
  const Vec3 diagonal = x[v[7]] - x[v[0]];
  double six_volumes = 0;
  for (unsigned i = 0; i < 6; ++i) {
    const Vec3 a = x[v[kRing[i]]] - x[v[0]], b = x[v[kRing[(i + 1) % 6]]] - x[v[0]];
    six_volumes += a.dot(b.cross(diagonal));
  }
  return six_volumes / 6;
}

class Shortener {
 public:
  Shortener(Clipped& body, const Grid& grid, std::vector<Tetrahedron> tetrahedra)
      : body_(body),
        grid_(grid),
        x_(body.nodes.positions),
        start_(number_nodes(grid, body.cells).positions),
        tetrahedra_(std::move(tetrahedra)),
        moved_(x_.size(), 0) {}

  std::size_t run() {
    for (int step = 0; step < kShortenings; ++step) {
      bad_.assign(x_.size(), 0);
      mark_cells();
      mark_folds();
      mark_tetrahedra();
      if (std::none_of(bad_.begin(), bad_.end(), [](auto b) { return b != 0; })) break;
      for (std::size_t i = 0; i < x_.size(); ++i) {
        if (!bad_[i]) continue;
        x_[i] = start_[i] + kShortening * (x_[i] - start_[i]);
        moved_[i] = 1;
      }
    }
    return static_cast<std::size_t>(std::count(moved_.begin(), moved_.end(), 1));
  }

 private:
  void mark_cells() {
    const double min_volume = kMinCellVolume * grid_.spacing().prod(), min_length = kMinLength * grid_.spacing().minCoeff();
    body_.cells.each([&](const Index3& c) {
      if (!body_.cells.has(c)) return;
      const Corners v = corners_of(body_, grid_, c);
      if (volume_of(v, x_) < min_volume) {
        for (const auto i : v) bad_[i] = 1;
      }
      for (std::size_t i = 0; i < 8; ++i) {
        for (std::size_t j = i + 1; j < 8; ++j) {
          if ((x_[v[i]] - x_[v[j]]).norm() < min_length) bad_[v[i]] = bad_[v[j]] = 1;
        }
      }
    });
  }

  void mark_folds() {
    const auto triangles = split_shorter(body_.faces, x_);
    const auto normal = [&](const Triangle& t) { return (x_[t[1]] - x_[t[0]]).cross(x_[t[2]] - x_[t[0]]).stableNormalized(); };
    for (std::size_t f = 0; f < body_.faces.size(); ++f) {
      if (normal(triangles[2 * f]).dot(normal(triangles[2 * f + 1])) >= kMinFaceCosine) continue;
      for (const auto i : body_.faces[f].corners) bad_[i] = 1;
    }
  }

  void mark_tetrahedra() {
    for (const Tetrahedron& t : tetrahedra_)
      if (quality_of(t, x_) < kGoodQuality)
        for (const auto i : t.nodes) bad_[i] = 1;
  }

  const Clipped& body_;
  const Grid& grid_;
  std::vector<Vec3>& x_;
  const std::vector<Vec3> start_;
  const std::vector<Tetrahedron> tetrahedra_;
  std::vector<std::uint8_t> bad_, moved_;
};

}  // namespace

std::vector<Index3> flat_cells(const Clipped& body, const Grid& grid) {
  std::vector<Index3> flat;
  body.cells.each([&](const Index3& c) {
    if (!body.cells.has(c)) return;
    if (volume_of(corners_of(body, grid, c), body.nodes.positions) < kMinCellVolume * grid.spacing().prod()) flat.push_back(c);
  });
  return flat;
}

void shorten_moves(Clipped& body, const Grid& grid) { body.held_back = Shortener(body, grid, {}).run(); }

void shorten_moves_of_tetrahedra(Clipped& body, const Grid& grid) {
  body.held_back += Shortener(body, grid, split_cells(body.cells, grid, body.nodes.number)).run();
}

}  // namespace palpate
