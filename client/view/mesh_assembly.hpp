// The mesh of the body, put together from pieces that come in any order, twice or not at all.
//
// What a Welcome announces costs nothing: memory is that of the pieces which came, and the mesh is made when they are all there.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

class MeshAssembly {
 public:
  /// Forget everything; expect the mesh that a Welcome announced.
  void expect(std::uint32_t vertices, std::uint32_t triangles, std::uint64_t hash);

  /// A piece that fits into the expected mesh is kept. When the last one is in and the whole does not have the announced
  /// hash, all are dropped (counted in `rejected`) and asked for again.
  void take(const MeshPiece& piece);

  /// The next missing pieces, at most `most`; piece 0 alone until it is known how many there are.
  std::vector<std::uint32_t> missing(std::size_t most) const;
  bool complete() const { return complete_; }
  const BodyMesh& mesh() const { return mesh_; }
  std::uint64_t rejected() const { return rejected_; }

 private:
  bool fits(const MeshPiece& piece) const;
  bool covers_all() const;
  void finish();

  std::uint32_t vertices_ = 0, triangles_ = 0, count_ = 0;  ///< count_ of the pieces, 0 until the first one tells
  std::uint64_t hash_ = 0, rejected_ = 0;
  std::map<std::uint32_t, MeshPiece> pieces_;
  BodyMesh mesh_;  ///< empty until it is complete
  bool complete_ = false;
};

}  // namespace palpate
