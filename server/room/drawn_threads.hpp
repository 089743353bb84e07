// Threads of a body as viewers draw them: tubes around their first tail, their bites, and their tail up to the hand. Their
// vertices have the numbers after those of the body, in the mesh, in shapes and in recordings.
#pragma once

#include <vector>

#include "server/body/dynamics.hpp"
#include "server/room/thread_chain.hpp"

namespace palpate {

class DrawnThreads {
 public:
  /// `body` must outlive it. Tails begin straight: the first upwards, the other aside.
  explicit DrawnThreads(const LumpedBody& body);
  bool empty() const { return threads_.empty(); }
  /// Moves the tails on to the time of a state.
  void advance(const Dynamics& dynamics, const BodyState& state);
  /// Appends the positions of the tubes' vertices.
  void append(std::vector<Vec3>& positions) const;
  std::size_t vertices() const;
  /// Triangles of the tubes, closed, over the vertices from `first` on.
  std::vector<Triangle> triangles(std::uint32_t first) const;

 private:
  struct Thread {
    ThreadChain first, tail;  ///< from the first bite, and from the last
    std::vector<Vec3> between;
    std::size_t points() const { return first.points().size() + between.size() + tail.points().size(); }
  };
  const LumpedBody* body_;
  std::vector<Thread> threads_;
  double time_s_ = 0;
};

}  // namespace palpate
