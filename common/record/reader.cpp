#include "common/record/reader.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>

#include "common/base/error.hpp"
#include "common/record/block_decode.hpp"
#include "common/record/layout.hpp"

namespace palpate {
namespace {

constexpr const char* kExpected = "a recording made by palpate-server or palpate-client with --record";

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

/// The last item that happened at or before t; nullptr when none did.
template <class Items>
const typename Items::value_type* last_at(const Items& items, Micros t) {
  const typename Items::value_type* last = nullptr;
  for (const auto& item : items)
    if (item.t <= t) last = &item;
  return last;
}

/// How the tool is held and its buttons, as the block says.
void add_hold(const RecordedBlock& block, Micros t, RecordedTool& tool) {
  for (const RecordedTurn& turn : block.turns)
    if (turn.station == tool.station && turn.t <= t) tool.orientation = turn.orientation;
  for (const RecordedButtons& change : block.buttons)
    if (change.station == tool.station && change.t <= t) tool.buttons = change.pressed;
}

}  // namespace

const char* name_of(RecordedEventKind kind) {
  constexpr std::array<const char*, kRecordedEventKinds> kNames{"joined",  "left",    "silent",   "refused", "motion",
                                                                "overrun", "kept_up", "left_out", "reset"};
  return kNames[static_cast<std::size_t>(kind)];
}

RecordingReader::RecordingReader(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes) {
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

/// False when there is none, or one that does not fit the file: then the parts themselves tell.
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
  std::uint64_t offset = first_block_;
  while (true) {
    const layout::PartView view = layout::part_at(bytes_, offset);
    const char* fault = view.fault;
    if (!fault && (std::chrono::abs(view.first) > kFarthest || std::chrono::abs(view.last) > kFarthest || view.first > view.last))
      fault = "the times of a part are damaged";
    const bool ended = offset == bytes_.size();
    const auto block = fault ? std::nullopt : decode_block(view.part, head_.surface.nodes.size());
    if (!fault && !block) fault = decode_index(view.part) ? "its end is damaged" : "a part is damaged";
    if (ended) fault = "it was not ended";
    if (fault) {
      damage_ = std::string(fault) + ", from byte " + std::to_string(offset) + " on";
      return;
    }
    blocks_.push_back({offset, view.first, view.last});
    note_joins(block->events);
    offset = view.end;
  }
}

void RecordingReader::note_joins(const std::vector<RecordedEvent>& events) {
  for (const RecordedEvent& event : events)
    if (event.kind == RecordedEventKind::joined) stations_.push_back({event.station, event.name, event.role, event.scheme});
}

std::string RecordingReader::name_of(StationId id) const {
  for (const RecordedStation& station : stations_)
    if (station.id == id) return station.name;
  return "station " + std::to_string(id);
}

std::optional<RecordedBlock> RecordingReader::read(std::size_t k) const {
  // A block that reaches into the next is damaged: an index of blocks within blocks would make a small file a long one.
  const std::size_t end = k + 1 < blocks_.size() ? blocks_[k + 1].offset : bytes_.size();
  const layout::PartView view = layout::part_at(bytes_.first(end), blocks_[k].offset);
  if (view.fault) return std::nullopt;
  return decode_block(view.part, head_.surface.nodes.size());
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
