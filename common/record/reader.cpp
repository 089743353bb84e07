#include "common/record/reader.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <string_view>
#include <utility>

#include "common/base/error.hpp"
#include "common/record/block_decode.hpp"

namespace palpate {
namespace {

constexpr const char* kExpected = "a recording made by palpate-server or palpate-client with --record";

bool is_cut_as_it_began(std::span<const std::byte> bytes) {
  using namespace layout;
  if (std::ranges::all_of(bytes, [](std::byte b) { return b == std::byte{}; })) return true;
  if (std::memcmp(bytes.data(), kMagic, std::min(bytes.size(), kMagicBytes)) != 0) return false;
  if (bytes.size() < kPreambleBytes + kFrameBytes + kPrefixBytes) return true;
  const PartView head = part_at(bytes, kPreambleBytes);
  return head.fault && head.end > bytes.size();
}

void check_preamble(std::span<const std::byte> bytes, const std::string& name) {
  using namespace layout;
  if (bytes.size() < kPreambleBytes || std::memcmp(bytes.data(), kMagic, kMagicBytes) != 0)
    throw InputError(name, "is no recording", kExpected);
  std::uint32_t version = 0, reserved = 0;
  std::memcpy(&version, bytes.data() + kMagicBytes, sizeof version);
  std::memcpy(&reserved, bytes.data() + kMagicBytes + sizeof version, sizeof reserved);
  if (version != kVersion)
    throw InputError(name, "is a recording of version " + std::to_string(version), "version " + std::to_string(kVersion));
  if (reserved != 0) throw InputError(name, "its first bytes are damaged", kExpected);
}

/// Returns the last item at or before t; nullptr when there is none.
template <class Items>
const typename Items::value_type* last_at(const Items& items, Micros t) {
  const typename Items::value_type* last = nullptr;
  for (const auto& item : items)
    if (item.t <= t) last = &item;
  return last;
}

/// Sets orientation, opening and buttons of the tool from the block.
void add_hold(const RecordedBlock& block, Micros t, RecordedTool& tool) {
  for (const RecordedTurn& turn : block.turns)
    if (turn.station == tool.station && turn.t <= t) {
      tool.orientation = turn.orientation;
      tool.opening = turn.opening;
    }
  for (const RecordedButtons& change : block.buttons)
    if (change.station == tool.station && change.t <= t) tool.buttons = change.pressed;
}

}  // namespace

const char* name_of(RecordedEventKind kind) {
  constexpr std::array<const char*, kRecordedEventKinds> kNames{"joined",  "left",    "silent",   "refused", "motion",
                                                                "overrun", "kept_up", "left_out", "reset",   "released"};
  return kNames[static_cast<std::size_t>(kind)];
}

RecordingReader::RecordingReader(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes) {
  if (is_cut_as_it_began(bytes)) throw CutRecording(name, "is no recording, cut as it began", kExpected);
  check_preamble(bytes, name);
  const layout::PartView first = layout::part_at(bytes, layout::kPreambleBytes);
  if (first.fault) throw InputError(name, std::string("its head is damaged: ") + first.fault, kExpected);
  auto head = decode_head(first.part);
  if (!head) throw InputError(name, "its head is damaged", kExpected);
  head_ = std::move(*head);
  first_block_ = first.end;
  if (!take_index()) scan();
  if (blocks_.empty()) return;
  begin_ = Micros::max();
  end_ = Micros::min();
  for (const BlockPlace& block : blocks_) {
    begin_ = std::min(begin_, block.first);
    end_ = std::max(end_, block.last);
  }
}

/// Reads the index. Returns false when there is none, or one that does not fit the file: then the parts themselves are scanned.
bool RecordingReader::take_index() {
  const std::uint64_t offset = layout::index_offset(bytes_);
  if (offset < first_block_ || offset >= bytes_.size()) return false;
  const layout::PartView view = layout::part_at(bytes_, offset);
  if (view.fault || view.end + layout::kTrailerBytes != bytes_.size()) return false;
  const auto index = decode_index(view.part);
  if (!index) return false;
  std::uint64_t before = 0;
  for (const BlockPlace& block : index->blocks) {
    if (block.offset < first_block_ || block.offset <= before || block.offset >= offset || block.first > block.last) return false;
    before = block.offset;
  }
  blocks_ = index->blocks;
  note_joins(index->joins);
  complete_ = true;
  return true;
}

void RecordingReader::scan() {
  const auto fault_of = [](const layout::PartView& view) -> const char* {
    if (view.fault) return view.fault;
    const bool far = std::chrono::abs(view.first) > kFarthest || std::chrono::abs(view.last) > kFarthest;
    return far || view.first > view.last ? "the times of a part are damaged" : nullptr;
  };
  std::uint64_t offset = first_block_;
  while (offset < bytes_.size()) {
    const layout::PartView view = part_at(offset);
    const char* fault = fault_of(view);
    if (const auto block = fault ? std::nullopt : decode_block(view.part, head_.surface.nodes.size())) {
      blocks_.push_back({offset, view.first, view.last});
      note_joins(block->events);
      offset = view.end;
      continue;
    }
    if (const auto index = fault ? std::nullopt : decode_index(view.part)) {
      stations_.clear();  // the index also lists joins in lost blocks
      note_joins(index->joins);
      if (damaged_.empty()) note_damage(offset, bytes_.size(), "its end is damaged");
      return;
    }
    const std::uint64_t next = next_part(view.fault ? offset + 1 : view.end);
    note_damage(offset, next, fault ? fault : "a part is damaged");
    offset = next;
  }
  if (damaged_.empty() || damaged_.back().end < bytes_.size()) note_damage(offset, offset, "it was not ended");
}

/// Reads a part; one with a wrong checksum counts as searched.
layout::PartView RecordingReader::part_at(std::uint64_t offset) {
  const layout::PartView view = layout::part_at(bytes_, offset);
  if (view.fault && view.end > offset && view.end <= bytes_.size()) searched_ += view.end - offset;
  return view;
}

/// Returns the first valid part from there on; the end of the file when there is none.
std::uint64_t RecordingReader::next_part(std::uint64_t from) {
  const std::string_view text(reinterpret_cast<const char*>(bytes_.data()), bytes_.size());
  for (std::size_t at = text.find(layout::kPartMark, from); at != std::string_view::npos;
       at = text.find(layout::kPartMark, at + 1)) {
    if (text.substr(std::min(at + layout::kIdentifierAt, text.size())).substr(0, 4) != layout::kIdentifier) continue;
    if (searched_ > kMostSearched * bytes_.size()) break;
    if (!part_at(at).fault) return at;
  }
  return bytes_.size();
}

/// Notes damaged bytes. At the end of the file the message has no end.
void RecordingReader::note_damage(std::uint64_t begin, std::uint64_t end, const char* why) {
  damaged_.push_back({begin, end, why});
  damage_ += damage_.empty() ? "" : "; ";
  damage_ += std::string(why) + ", from byte " + std::to_string(begin);
  damage_ += end > begin && end < bytes_.size() ? " to " + std::to_string(end) : " on";
}

void RecordingReader::note_joins(const std::vector<RecordedEvent>& events) {
  for (const RecordedEvent& event : events)
    if (event.kind == RecordedEventKind::joined)
      stations_.push_back({event.station, event.name, event.role, event.scheme, event.tool.name});
}

std::string RecordingReader::name_of(StationId id) const {
  for (const RecordedStation& station : stations_)
    if (station.id == id) return station.name;
  return "station " + std::to_string(id);
}

std::optional<RecordedBlock> RecordingReader::read(std::size_t k) const {
  // A block that reaches into the next is damaged: nested blocks in an index would make a small file decode to a long recording.
  const std::size_t end = k + 1 < blocks_.size() ? blocks_[k + 1].offset : bytes_.size();
  const layout::PartView view = layout::part_at(bytes_.first(end), blocks_[k].offset);
  if (view.fault) return std::nullopt;
  return decode_block(view.part, head_.surface.nodes.size());
}

RecordingLoss loss_of(const RecordingReader& recording) {
  RecordingLoss loss;
  bool lost = false;
  std::optional<Micros> seen;  // last readable moment
  const auto close = [&](Micros until) {
    loss.places += lost;
    if (lost && seen) loss.time += std::max(Micros{}, until - *seen);
    lost = false;
  };
  auto damaged = recording.damaged().begin();
  const auto lose_before = [&](std::uint64_t offset) {
    for (; damaged != recording.damaged().end() && damaged->begin < offset; ++damaged)
      lost = lost || damaged->end > damaged->begin;
  };
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    const BlockPlace& block = recording.blocks()[k];
    lose_before(block.offset);
    if (!recording.read(k)) {
      lost = true;
      continue;
    }
    close(block.first);
    seen = std::max(seen.value_or(block.last), block.last);
  }
  lose_before(UINT64_MAX);
  close(recording.end());
  return loss;
}

std::size_t RecordingReader::block_at(Micros t) const {
  std::size_t last = 0;
  for (std::size_t k = 0; k < blocks_.size(); ++k)
    if (blocks_[k].first <= t) last = k;
  return last;
}

const RecordedBlock* RecordingReader::cached(std::size_t k) {
  if (cached_at_ != k) cached_ = read(k);
  cached_at_ = k;
  return cached_ ? &*cached_ : nullptr;
}

std::optional<RecordedShape> RecordingReader::shape_at(Micros t) {
  if (blocks_.empty()) return std::nullopt;
  for (std::size_t k = block_at(t) + 1; k-- > 0;) {
    const RecordedBlock* block = cached(k);
    const RecordedShape* shape = block ? last_at(block->shapes, t) : nullptr;
    if (shape) return *shape;
  }
  return std::nullopt;
}

const BodyMesh* RecordingReader::mesh_of(const RecordedShape& shape) {
  if (!surfaces_) surfaces_.emplace(head_.surface);
  if (shape.mesh > 0 && !std::exchange(has_changes_, true))
    for (std::size_t k = 0; k < blocks_.size(); ++k)
      if (const auto block = read(k))
        for (const RecordedMeshChange& change : block->mesh_changes) surfaces_->take(change);
  return surfaces_->mesh_of(shape);
}

std::optional<Micros> RecordingReader::next_shape(Micros t) {
  for (std::size_t k = blocks_.empty() ? 0 : block_at(t); k < blocks_.size(); ++k) {
    if (blocks_[k].last <= t) continue;
    const RecordedBlock* block = cached(k);
    if (!block) continue;
    for (const RecordedShape& shape : block->shapes)
      if (shape.t > t) return shape.t;
  }
  return std::nullopt;
}

std::vector<RecordedTool> RecordingReader::tools_at(Micros t) {
  std::vector<RecordedTool> tools;
  if (blocks_.empty()) return tools;
  for (std::size_t k = block_at(t) + 1; k-- > 0 && tools.empty();) {
    const RecordedBlock* block = cached(k);
    if (!block) continue;
    if (const RecordedTick* tick = last_at(block->ticks, t))
      tools.push_back({0, head_.name, tick->position, tick->force, tick->contact});
    const RecordedFrame* frame = last_at(block->frames, t);
    for (const RecordedTouch& touch : block->touches)
      if (frame && touch.t == frame->t)
        tools.push_back({touch.station, name_of(touch.station), touch.tool, touch.force, touch.contact});
    for (RecordedTool& tool : tools) add_hold(*block, t, tool);
    if (frame) break;
  }
  return tools;
}

}  // namespace palpate
