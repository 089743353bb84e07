#include "server/core/surface_mesh.hpp"

#include <utility>

namespace palpate {
namespace {

constexpr std::uint32_t kNoPlace = ~0U;

}  // namespace

SurfaceMesh::SurfaceMesh(BodyMesh mesh, std::vector<std::uint32_t> vertex_of)
    : mesh_(std::move(mesh)), vertex_of_(std::move(vertex_of)) {
  for (std::uint32_t k = 0; k < vertex_of_.size(); ++k) {
    if (vertex_of_[k] >= place_of_.size()) place_of_.resize(vertex_of_[k] + 1, kNoPlace);
    place_of_[vertex_of_[k]] = k;
  }
}

void SurfaceMesh::take(const BodySurface& surface) {
  place_of_.resize(surface.vertices.size(), kNoPlace);
  const auto place = [&](std::uint32_t number) {
    if (place_of_[number] != kNoPlace) return place_of_[number];
    const BodySurface::Vertex& vertex = surface.vertices[number];
    mesh_.vertices.push_back({vertex.rest.unaryExpr(&to_rest_step), vertex.fixed, vertex.wall});
    vertex_of_.push_back(number);
    return place_of_[number] = static_cast<std::uint32_t>(vertex_of_.size() - 1);
  };
  mesh_.triangles.clear();
  for (const Triangle& t : surface.triangles) mesh_.triangles.push_back({place(t[0]), place(t[1]), place(t[2])});
}

}  // namespace palpate
