#include "common/wire/task_wire.hpp"

#include <array>

#include "common/wire/patch_wire.hpp"
#include "common/wire/sense.hpp"

namespace palpate {
namespace {

enum Kind : std::uint8_t { kFind, kPress, kTrace };

using flatbuffers::Offset;

class GoalWriter {
 public:
  GoalWriter(flatbuffers::FlatBufferBuilder& builder, pack::Packer& packer, const std::string& text)
      : builder_(builder), packer_(packer), text_(builder.CreateString(text)) {}

  Offset<wire::Task> operator()(const FindTask& find) {
    const auto lump = packer_.point(find.lump), above = packer_.point(find.above);
    return wire::CreateTask(builder_, text_, kFind, &lump, &above, packer_.number(find.radius_m), packer_.number(find.within_m));
  }
  Offset<wire::Task> operator()(const PressTask& press) {
    return wire::CreateTask(builder_, text_, kPress, nullptr, nullptr, 0, 0, packer_.number(press.min_n),
                            packer_.number(press.max_n), packer_.number(press.time_s));
  }
  Offset<wire::Task> operator()(const TraceTask& trace) {
    std::array<wire::LinePoint, kMaxLinePoints> points;
    for (std::size_t i = 0; i < trace.line.size(); ++i) {
      const auto [u, v] = pack_normal(trace.line[i].normal);
      points[i] = {packer_.point(trace.line[i].at), u, v};
    }
    const auto line = builder_.CreateVectorOfStructs(points.data(), trace.line.size());
    return wire::CreateTask(builder_, text_, kTrace, nullptr, nullptr, 0, 0, 0, 0, 0, packer_.number(trace.tolerance_m), line);
  }

 private:
  flatbuffers::FlatBufferBuilder& builder_;
  pack::Packer& packer_;
  Offset<flatbuffers::String> text_;
};

WireFault read_find(const wire::Task& table, Task& task) {
  if (!table.lump() || !table.above()) return WireFault::malformed;
  const FindTask find{pack::from(*table.lump()), pack::from(*table.above()), table.radius(), table.within()};
  MessageValidator sense;
  sense.position(find.lump);
  sense.position(find.above);
  sense.number(find.radius_m, 0, kWorldExtentM);
  sense.number(find.within_m, 1e-6, kWorldExtentM);
  task.goal = find;
  return sense.fault();
}

WireFault read_press(const wire::Task& table, Task& task) {
  const PressTask press{table.force_min(), table.force_max(), table.time()};
  MessageValidator sense;
  sense.number(press.min_n, 0, kMaxTaskForceN);
  sense.number(press.max_n, press.min_n, kMaxTaskForceN);
  sense.number(press.time_s, 1e-3, kMaxTaskTimeS);
  task.goal = press;
  return sense.fault();
}

WireFault read_trace(const wire::Task& table, Task& task) {
  if (!table.line() || table.line()->size() < 2 || table.line()->size() > kMaxLinePoints) return WireFault::malformed;
  TraceTask trace{{}, table.tolerance()};
  MessageValidator sense;
  sense.number(trace.tolerance_m, 1e-6, kMaxToleranceM);
  for (const wire::LinePoint* point : *table.line()) {
    sense.that(point->normal_u() != kNoNormal && point->normal_v() != kNoNormal);
    if (!sense.ok()) return sense.fault();
    const LinePoint read{pack::from(point->at()), unpack_normal(point->normal_u(), point->normal_v())};
    sense.position(read.at);
    sense.that(trace.line.empty() || read.at != trace.line.back().at);
    trace.line.push_back(read);
  }
  task.goal = std::move(trace);
  return sense.fault();
}

}  // namespace

Offset<wire::Task> write_task(flatbuffers::FlatBufferBuilder& builder, pack::Packer& packer, const Task& task) {
  packer.require(task.text.size() <= kMaxTaskText);
  if (const auto* trace = std::get_if<TraceTask>(&task.goal))
    packer.require(trace->line.size() >= 2 && trace->line.size() <= kMaxLinePoints);
  if (!packer.ok()) return {};
  return std::visit(GoalWriter(builder, packer, task.text), task.goal);
}

WireFault read_task(const wire::Task& table, Task& task) {
  MessageValidator sense;
  const std::string_view text = table.text() ? table.text()->string_view() : std::string_view();
  sense.text(text, 1, kMaxTaskText);
  if (!sense.ok()) return sense.fault();
  task.text = text;
  switch (table.kind()) {
    case kFind:
      return read_find(table, task);
    case kPress:
      return read_press(table, task);
    case kTrace:
      return read_trace(table, task);
    default:
      return WireFault::out_of_range;
  }
}

}  // namespace palpate
