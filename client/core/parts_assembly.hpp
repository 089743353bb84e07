// Requests the rigid parts of a scene piece by piece, and puts them together.
//
// At most kWindow pieces are requested at a time, and again after kRetry. Memory is used by the pieces that arrive. A part whose
// pieces contradict each other is left out.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "common/wire/messages.hpp"

namespace palpate {

class PartsAssembly {
 public:
  static constexpr Micros kRetry{150'000};
  static constexpr std::size_t kWindow = 8;

  /// Expects `parts` parts of a scene. Keeps those that it has of one with the same hash, unless that is 0.
  void expect(std::uint8_t parts, std::uint64_t scene_hash);
  void take(const PartPiece& piece);
  /// Returns the MeshRequest::piece to send now, if any.
  std::optional<std::uint32_t> due(Micros now);
  /// Time of the next request; never once all have arrived.
  Micros deadline() const { return complete_ ? Micros::max() : asking_.empty() ? next_ : Micros{}; }
  /// Empty until all have arrived.
  const std::vector<PartMesh>& parts() const { return parts_; }
  bool complete() const { return complete_; }
  /// Changes with parts().
  std::uint64_t version() const { return version_; }

 private:
  struct Gathered {
    std::uint32_t vertices = 0, triangles = 0;  // numbers of the whole part
    std::map<std::uint32_t, PartPiece> pieces;  // none: not known yet
    std::uint32_t count() const;
  };
  void finish();

  std::uint64_t scene_hash_ = 0, version_ = 0;
  std::vector<Gathered> gathered_;
  std::vector<PartMesh> parts_;
  bool complete_ = true;
  std::deque<std::uint32_t> asking_;
  std::size_t asked_ = 0;  // of the last round, not arrived
  Micros next_{};
};

}  // namespace palpate
