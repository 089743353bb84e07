// A training task as a FlatBuffers table, in datagrams and in recordings.
#pragma once

#include "common/task/task.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/pack.hpp"

namespace palpate {

flatbuffers::Offset<wire::Task> write_task(flatbuffers::FlatBufferBuilder& builder, pack::Packer& packer, const Task& task);
WireFault read_task(const wire::Task& table, Task& task);

}  // namespace palpate
