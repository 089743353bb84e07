// The surface of a body that is cut or tears, with numbers of vertices that stay.
//
// A vertex of the scene's body has its own number, and keeps it; one that a cut makes gets the next. A node keeps its number
// where the body is cut again (the first of what it became); a vertex that is embedded has that of its weights. So two surfaces
// in a row differ in the triangles that a cut changed, and in vertices at the end.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "server/scene/cuts.hpp"

namespace palpate {

/// Vertices by number, those that are gone included, and triangles over them.
struct BodySurface {
  struct Vertex {
    Vec3 rest = Vec3::Zero();
    bool fixed = false, wall = false;
  };
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
};

class LiveSurface {
 public:
  explicit LiveSurface(const LumpedBody& begun);
  /// Takes up the body after a change; none: the body as it began.
  void renew(const LumpedBody& body, const CutChange* change);
  /// Returns the surface; null as long as nothing has cut the body.
  const std::shared_ptr<const BodySurface>& now() const { return now_; }
  /// Returns values of the body's present vertices by number: those that are gone have `gone` of their rest positions.
  template <class Value, class Gone>
  std::vector<Value> by_number(const std::vector<Value>& of_vertices, const Gone& gone) const;

 private:
  std::uint32_t number_of(const LumpedBody& body, const EmbeddedVertex& vertex);

  std::uint32_t begun_nodes_;
  BodySurface all_;
  std::vector<std::uint32_t> node_numbers_;    // of the present nodes
  std::vector<std::uint32_t> vertex_numbers_;  // of the present vertices
  std::map<NodeWeights, std::uint32_t> embedded_;
  std::shared_ptr<const BodySurface> now_;
};

template <class Value, class Gone>
std::vector<Value> LiveSurface::by_number(const std::vector<Value>& of_vertices, const Gone& gone) const {
  if (!now_) return of_vertices;
  std::vector<Value> all;
  for (const BodySurface::Vertex& vertex : all_.vertices) all.push_back(gone(vertex.rest));
  for (std::size_t v = 0; v < of_vertices.size(); ++v) all[vertex_numbers_[v]] = of_vertices[v];
  return all;
}

}  // namespace palpate
