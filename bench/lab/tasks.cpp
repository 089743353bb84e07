#include "bench/lab/tasks.hpp"

#include "bench/fidelity/replay.hpp"
#include "bench/lab/parallel.hpp"
#include "bench/measure/examination.hpp"
#include "server/body/unload.hpp"

namespace palpate {

void add_examination(SweepTasks& tasks, const std::filesystem::path& scenes, const std::string& scene) {
  if (tasks.contains(scene)) return;
  Scene body = open_scene((scenes / (scene + ".json")).string());
  Motion motion = examination(body);
  tasks.emplace(scene, SweepTask{std::move(body), std::move(motion), {}});
}

void add_references(SweepTasks& tasks, unsigned jobs) {
  std::vector<SweepTask*> list;
  for (auto& [name, task] : tasks) list.push_back(&task);
  run_all(
      list.size(), [&](std::size_t i) { list[i]->reference = reference_of(list[i]->scene, list[i]->motion); }, jobs,
      "the references");
}

}  // namespace palpate
