// The finite elements of a body, for FarTangents.
#pragma once

#include "server/reduce/local_body.hpp"
#include "server/reduce/tetra_bunch.hpp"

namespace palpate {

class FarSolid {
 public:
  static constexpr int kNumbers = TetraBunch::kNumbers;
  static constexpr std::size_t kAFrame = 1500;

  FarSolid(const Dynamics& dynamics, const FarField& field) : dynamics_(&dynamics), field_(&field) {}

  std::uint32_t count() const { return elements_of(dynamics_->body()); }
  std::span<const std::uint32_t> nodes_of(std::uint32_t element) const {
    std::array<std::uint32_t, 2> room;  // of springs, which a solid has not
    return palpate::nodes_of(dynamics_->body(), element, room);
  }
  struct Bunch {
    TetraBunch tetrahedra;
    std::vector<FarField::Shape> shapes;  ///< parallel to its nodes
  };
  Bunch bunch(const std::vector<std::uint32_t>& tetrahedra, std::uint32_t cell) const {
    Bunch bunch{TetraBunch(*dynamics_, tetrahedra), {}};
    for (const std::uint32_t i : bunch.tetrahedra.nodes()) bunch.shapes.push_back(field_->shape_in(i, cell));
    return bunch;
  }
  void add(const Bunch& bunch, std::uint32_t, const BodyState& state, CornerTangent<kNumbers>& to) const {
    add_over_corners(bunch.tetrahedra, bunch.tetrahedra.sums(state.x, false), bunch.shapes, to);
  }

 private:
  const Dynamics* dynamics_;
  const FarField* field_;
};

}  // namespace palpate
